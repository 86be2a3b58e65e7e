"""Draws docs/barrier.png from the fields of launch/scenes/barrier-impact.toml.

    target/release/rockfall run launch/scenes/barrier-impact.toml --out out/barrier
    pip install matplotlib meshio pillow
    python docs/barrier.py out/barrier/fields docs/barrier.png

Three moments: before the impact, after 0.1 s, and near the largest deflection, seen from the valley.
"""

import json
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import meshio
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from PIL import Image

AZIMUTH, ELEVATION = np.radians(147.0), np.radians(16.0)  # from the valley
STRONGEST = 150.0  # kN, end of the colour scale
# From light to dark, told apart with any colour vision; without the palest end, which white paper swallows.
COLOURS = matplotlib.colors.ListedColormap(matplotlib.colormaps["cividis_r"](np.linspace(0.12, 1.0, 256)))
POSTS = (0.75, 0.3, 0.0, 1.0)


def series(folder, name):
    """Times and files of a PVD series."""
    root = ElementTree.parse(folder / f"{name}.pvd").getroot()
    return [(float(d.get("timestep")), folder / d.get("file")) for d in root.iter("DataSet")]


def project(points):
    """Places on the paper, and depth towards the eye, of points in space."""
    east = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH), 0.0])
    to_eye = np.array(
        [np.sin(AZIMUTH) * np.cos(ELEVATION), -np.cos(AZIMUTH) * np.cos(ELEVATION), np.sin(ELEVATION)]
    )
    up = np.cross(to_eye, east)
    return np.column_stack([points @ east, points @ up]), points @ to_eye


def draw(axes, structure, rock, time, posts):
    mesh, stone = meshio.read(structure), meshio.read(rock)
    places, depth = project(mesh.points)
    cells = mesh.cells_dict["line"]
    force = mesh.cell_data["axial_force"][0].ravel() / 1000.0
    broken = mesh.cell_data["broken"][0].ravel() > 0
    order = np.argsort(depth[cells].mean(axis=1))
    order = order[~broken[order]]
    widths = np.where(np.abs(force) > 5.0, 1.1, 0.45)
    widths = np.where(posts, 4.0, widths)
    lines = LineCollection(
        places[cells[order]],
        array=np.clip(force[order], 0.0, STRONGEST),
        cmap=COLOURS,
        norm=matplotlib.colors.PowerNorm(0.5, 0.0, STRONGEST),
        linewidths=widths[order],
        capstyle="round",
    )
    colours = lines.cmap(lines.norm(np.clip(force[order], 0.0, STRONGEST)))
    colours[posts[order]] = POSTS
    lines.set_array(None)
    lines.set_color(colours)

    faces = stone.cells_dict["triangle"]
    corners = stone.points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    spots, deep = project(stone.points)
    _, towards = project(normals)
    light = np.clip(normals @ np.array([-0.5, 0.3, 0.8]), 0.0, 1.0)
    front = np.flatnonzero(towards > 0.0)
    front = front[np.argsort(deep[faces[front]].mean(axis=1))]
    grey = (0.35 + 0.45 * light[front])[:, None] * np.array([1.0, 0.93, 0.85])
    solid = PolyCollection(spots[faces[front]], facecolors=grey, edgecolors=grey, linewidths=0.4)
    # The eye is in the valley: the block lies behind the net.
    solid.set_zorder(1)
    lines.set_zorder(2)
    axes.add_collection(solid)
    axes.add_collection(lines)
    axes.text(0.01, 0.95, f"t = {time:.2f} s", transform=axes.transAxes, fontsize=11, va="top")
    axes.set_aspect("equal")
    axes.axis("off")


def main(fields, picture):
    structures, rocks = dict(series(fields, "structure")), dict(series(fields, "rock_surface"))
    times = sorted(set(structures) & set(rocks))
    moments = [min(times, key=lambda t: abs(t - wanted)) for wanted in (0.0, 0.1, 0.3)]
    parts = json.loads((fields / "structure_legend.json").read_text())["part"]
    number = next(int(number) for number, name in parts.items() if name == "posts")
    posts = meshio.read(structures[moments[0]]).cell_data["part"][0].ravel() == number
    figure, panels = plt.subplots(len(moments), 1, figsize=(9.0, 8.0), dpi=100)
    for axes, time in zip(panels, moments):
        draw(axes, structures[time], rocks[time], time, posts)
    spots = np.vstack([project(meshio.read(structures[t]).points)[0] for t in moments])
    for axes in panels:
        axes.set_xlim(spots[:, 0].min() - 0.5, spots[:, 0].max() + 0.5)
        axes.set_ylim(spots[:, 1].min() - 0.3, spots[:, 1].max() + 0.6)
    figure.subplots_adjust(0.01, 0.01, 0.89, 0.99, hspace=0.02)
    norm = matplotlib.colors.PowerNorm(0.5, 0.0, STRONGEST)
    bar = figure.colorbar(
        matplotlib.cm.ScalarMappable(norm, COLOURS), cax=figure.add_axes([0.91, 0.25, 0.018, 0.5])
    )
    bar.set_ticks([0, 10, 25, 50, 100, 150])
    bar.set_label("axial force [kN]; posts thick")
    figure.savefig(picture)
    Image.open(picture).convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(picture, optimize=True)


main(Path(sys.argv[1]), sys.argv[2])
