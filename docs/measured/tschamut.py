"""Tschamut 2014: calibrate the ground on one half of the measured falls, predict the other.

    git clone https://github.com/ofuhrer/rust_rockfall
    python docs/measured/tschamut.py --data rust_rockfall --work out/measured --points 16 8 8 --members 1 2 --again 5 3

That repository derived its files (data/processed/tschamut2014) from Volkwein and Gerber (2018), Repetitive trajectory testing in
Tschamut 2014, EnviDat, doi:10.16904/envidat.34, Open Database License. They are not part of this project. The studies and the
results go to `out/measured/tschamut`.
"""

import csv
import math

import falls
import numpy as np
from falls import Range

DENSITY = 2650.0  # of the blocks [kg/m3], assumed
SPHERES = 48
FARTHEST = 140.0  # m: no block came farther, and beyond it the terrain is extrapolated; both samples are cut here

# What is calibrated, and within which bounds.
RANGES = {
    "friction": Range(0.1, 0.8),
    "restitution": Range(0.1, 0.7),
    "ground_modulus": Range(3e6, 1e8, proportional=True),
    "scarring_drag": Range(0.0, 3.0),
    "rolling_friction": Range(0.02, 0.5),
    "rolling_friction_impact": Range(0.0, 1.0),
}
PRESET = {"friction_max": 2.0, "friction_growth": 1.5, "friction_relaxation": 125.0}  # is kept

SCENE = """# A block of Tschamut 2014 on the terrain proxy of 5 m.
end_time = 90.0
gravity = [0.0, 0.0, -9.81]

[[rock]]
position = [33.0, 237.0, 80.0]
mass = {mass}
shape = {{ type = "convex_hull", points = {points} }}
cluster.{cluster}

[terrain]
file = "{terrain}"

[[contact]]
preset = "meadow"
{rolling}
[limits]
penetration = 1.0
"""

ROLLING = """rolling = "spring"
rolling_friction = 0.1
rolling_damping = 0.3
"""


def corners(size, mass):
    """A box with its edges and corners cut off until it has the block's volume: the hull of these points."""
    axis = (np.arange(80) + 0.5) / 80
    x, y, z = np.meshgrid(axis, axis, axis)

    def share(t):
        """Share of the box that is left: the faces are squares of t."""
        pairs = np.maximum(np.maximum(x + y, y + z), x + z) <= 1 + t
        return np.mean(pairs & (x + y + z <= 1 + 2 * t))

    wanted, low, high = mass / DENSITY / math.prod(size), 0.0, 1.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if share(middle) < wanted else (low, middle)
    signs = [(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]
    faces = [(1, low, low), (low, 1, low), (low, low, 1)]
    return [[round(s * f * e / 2, 5) for s, f, e in zip(sign, face, size)] for sign in signs for face in faces]


def read(folder):
    """Blocks, and the measured runs with their half."""
    table = lambda name: list(csv.DictReader(open(folder / name, newline="")))
    blocks = {row["block_id"]: row for row in table("block_metadata.csv")}
    starts = {row["trajectory_id"]: row for row in table("release_points.csv")}
    runs, seen = [], set()
    for row in sorted(table("observed_deposition.csv"), key=lambda row: (row["block_id"], row["trajectory_id"])):
        start = starts[row["trajectory_id"]]
        place = (start["x_m"], start["y_m"], row["x_m"], row["y_m"])
        if place in seen:  # the same track under two numbers
            continue
        seen.add(place)
        speed = math.hypot(*(float(start[f"v{axis}_mps"]) for axis in "xyz"))
        x, y, u, v = map(float, place)
        runs.append({"id": row["trajectory_id"], "block": row["block_id"], "start": [x, y], "speed": speed, "end": [u, v]})
    for number, run in enumerate(runs):
        run["half"] = "ab"[number % 2]
    return blocks, runs


def run_out(starts, places):
    """Distance from start to end seen from above, up to the farthest that counts [m]."""
    return np.minimum(np.hypot(*(np.asarray(places) - np.asarray(starts)).T), FARTHEST)


class Site:
    """The studies of both halves."""

    def __init__(self, given):
        self.given = given
        folder = given.data / "data/processed/tschamut2014"
        self.work = given.work / "tschamut"
        self.work.mkdir(exist_ok=True)
        self.blocks, self.runs = read(folder)
        for name, block in self.blocks.items():
            mass = float(block["mass_kg"])
            points = corners([float(block[f"size_{axis}_m"]) for axis in "xyz"], mass)
            terrain = (folder / "terrain.asc").resolve()
            path = self.work / f"block-{name}.toml"
            scene = lambda cluster, rolling: SCENE.format(
                mass=mass, points=points, cluster=cluster, terrain=terrain, rolling=rolling
            )
            path.write_text(scene(f"spheres = {SPHERES}", ROLLING))
            spheres = f'file = "{falls.spheres(given, path)}"'
            path.write_text(scene(spheres, ROLLING))
            (self.work / f"preset-{name}.toml").write_text(scene(spheres, ""))

    def measured(self, half, block=None):
        runs = [run for run in self.runs if run["half"] == half and block in (None, run["block"])]
        return run_out([run["start"] for run in runs], [run["end"] for run in runs])

    def computed(self, half, values, each, name="fit", scene="block"):
        """Run-outs from the starts of that half, `each` times, per block; and how many members were not to be trusted."""
        found, bad = {}, 0
        for block in self.blocks:
            runs = [run for run in self.runs if run["half"] == half and run["block"] == block]
            release = {"points": [run["start"] for run in runs], "count": each * len(runs)}
            vary = {"orientation": "uniform", "speed": {"choice": [round(run["speed"], 3) for run in runs]}}
            vary |= {f"contact.0.{key}": value for key, value in values.items()}
            path = self.work / f"{name}-{half}-{block}.toml"
            falls.study(path, f"{scene}-{block}.toml", [release], vary)
            starts, stops, failed = falls.places(falls.ensemble(self.given, path))
            found[block], bad = run_out(starts, stops), bad + failed
        return found, bad

    def cost(self, values, each=None):
        found, bad = self.computed("a", values, each or self.given.members[0])
        mixed = np.concatenate(list(found.values()))
        return {"cost": falls.distance(self.measured("a"), mixed), "quantiles": falls.quantiles(mixed), "bad": bad}


def main():
    given = falls.arguments("a clone of rust_rockfall")
    site = Site(given)
    tried = falls.calibrate(RANGES, site.cost, given.points, site.work / "tried.json")
    deciding = falls.deciding(tried, given.points, lambda it: it["quantiles"][1])
    tried = falls.confirm(tried, site.cost, given.again, site.work / "again.json")
    best = tried[0]["values"]
    result = {"site": "tschamut", "values": best | PRESET, "fit": {}, "runs": len(site.runs), "deciding": deciding, "calibrated": tried[0]}
    for half in "ab":
        found, bad = site.computed(half, best, given.members[1], "final")
        whole = falls.compare(site.measured(half), np.concatenate(list(found.values())))
        parts = {block: falls.compare(site.measured(half, block), part) for block, part in found.items()}
        result["fit"][half] = {"whole": whole, "blocks": parts, "bad": bad}
    plain, _ = site.computed("b", {}, given.members[1], "plain", "preset")  # what the preset says, uncalibrated
    result["preset"] = falls.compare(site.measured("b"), np.concatenate(list(plain.values())))
    falls.write(given.work / "tschamut.json", result)


if __name__ == "__main__":
    main()
