"""One site predicted from the other: the ground of Tschamut at Authume and the reverse, beside what needs no model of a fall.

    python docs/measured/transfer.py --tschamut rust_rockfall --authume AuthumeQuarryRockfalls_Data-in-Brief --work out/measured

`tschamut.py` and `authume.py` come first: their calibrated values and their folders are used. Predicted are the halves that were not
calibrated. Beside them: the run-outs of the calibrated half as they are, and the line of energy: a straight line from the start, as steep
as the reach angles that were measured (at the site itself: of the calibrated half; at the other site: of all), meets the ground again. At
Authume it starts where the blocks were dropped, some metres above the ground.
"""

import argparse
import json
from pathlib import Path

import authume
import falls
import numpy as np
import tschamut


class Grid:
    """Terrain of Tschamut: heights at the middles of its cells, linear between them."""

    def __init__(self, path):
        lines = path.read_text().splitlines()
        head = {line.split()[0].lower(): float(line.split()[1]) for line in lines[:6]}
        self.cell = head["cellsize"]
        half = {"corner": self.cell / 2, "center": 0.0}
        self.low = [next(head[f"{axis}ll{k}"] + half[k] for k in half if f"{axis}ll{k}" in head) for axis in "xy"]
        self.z = np.array([line.split() for line in lines[6:]], dtype=float)[::-1].T

    def height(self, places):
        where = np.clip((np.asarray(places, dtype=float)[:, :2] - self.low) / self.cell, 0, np.array(self.z.shape) - 1.001)
        i, j = np.floor(where).astype(int).T
        u, v = (where - np.floor(where)).T
        low, high = self.z[i, j] * (1 - u) + self.z[i + 1, j] * u, self.z[i, j + 1] * (1 - u) + self.z[i + 1, j + 1] * u
        return low * (1 - v) + high * v


def reach(ground, starts, ends, up=0.0):
    """Tangents of the reach angles, from so far above the ground."""
    starts, ends = np.asarray(starts)[:, :2], np.asarray(ends)[:, :2]
    return (ground.height(starts) + up - ground.height(ends)) / np.hypot(*(ends - starts).T)


def line_of_energy(ground, start, towards, tangents, farthest, up=0.0):
    """Where lines of such tangents meet the ground, along the straight way from the start [m]."""
    way = np.arange(0.0, farthest + 0.25, 0.25)
    unit = np.asarray(towards) / np.hypot(*towards)
    heights = ground.height(np.asarray(start)[:2] + way[:, None] * unit)
    way, heights = way[np.isfinite(heights)], heights[np.isfinite(heights)]
    # The rock stops at the first place from which the line stays below the ground for a metre.
    found = []
    for tangent in tangents:
        below = heights[0] + up - tangent * way <= heights
        stays = [k for k in range(4, len(way) - 4) if below[k : k + 4].all()]
        found.append(way[stays[0]] if stays else way[-1])
    return np.array(found)


def main():
    parser = argparse.ArgumentParser()
    for name in ("tschamut", "authume", "work"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--rockfall", type=Path, default=Path("target/release/rockfall"))
    parser.add_argument("--threads", type=int, default=1)
    given = parser.parse_args()
    load = lambda site: json.loads((given.work / f"{site}.json").read_text())["values"]
    of = lambda data: argparse.Namespace(data=data, work=given.work, rockfall=given.rockfall, threads=given.threads)
    meadow, quarry = tschamut.Site(of(given.tschamut)), authume.Site(of(given.authume))
    grid = Grid(given.tschamut / "data/processed/tschamut2014/terrain.asc")
    result = {"tschamut": {}, "authume": {}}

    # Tschamut, by the slope with plants of Authume.
    keys = [key for key in load("authume") if key.startswith("0.")]
    values = {key[2:]: load("authume")[key] for key in keys}
    found, bad = meadow.computed("b", values, 1, "transfer")
    runs = {half: [run for run in meadow.runs if run["half"] == half] for half in "ab"}
    tangents = {half: reach(grid, [run["start"] for run in runs[half]], [run["end"] for run in runs[half]]) for half in "ab"}
    start = np.mean([run["start"] for run in runs["b"]], axis=0)
    towards = np.mean([np.subtract(run["end"], run["start"]) for run in runs["a"]], axis=0)
    middles = {p: quarry.drops[p].mean(axis=0) for p in authume.PROFILES}
    ups = {p: float(middle[2] - quarry.ground.height([middle])[0]) for p, middle in middles.items()}
    other = np.concatenate([reach(quarry.ground, [middles[p]] * len(e), e, ups[p]) for (p, _), e in quarry.ends.items()])
    samples = {
        "other site": np.concatenate(list(found.values())),
        "calibrated half": meadow.measured("a"),
        "reach angle": line_of_energy(grid, start, towards, tangents["a"], tschamut.FARTHEST),
        "reach angle of the other site": line_of_energy(grid, start, towards, other, tschamut.FARTHEST),
    }
    result["tschamut"] = {name: falls.compare(meadow.measured("b"), sample) for name, sample in samples.items()} | {"bad": bad, "values": values}
    falls.write(given.work / "transfer.json", result)

    # Authume, by the meadow of Tschamut, on both its grounds.
    own = {key: value for key, value in load("tschamut").items() if key in tschamut.RANGES}
    found, bad, left = quarry.computed("b", {f"{zone}.{key}": value for zone in (0, 1) for key, value in own.items()}, 1, "transfer")
    result["authume"] = {"bad": bad, "left": left, "values": own}
    for profile in authume.PROFILES:
        middle, up = middles[profile], ups[profile]
        ends = quarry.ends[profile, "a"]
        towards = (ends - middle).mean(axis=0)[:2]
        mine = reach(quarry.ground, [middle] * len(ends), ends, up)
        line = lambda tangents: line_of_energy(quarry.ground, middle, towards, tangents, 150.0, up)
        samples = {
            "other site": found[profile]["run_out"],
            "calibrated half": quarry.measured(profile, "a")["run_out"],
            "reach angle": line(mine),
            "reach angle of the other site": line(np.concatenate(list(tangents.values()))),
        }
        result["authume"][profile] = {name: falls.compare(quarry.measured(profile, "b")["run_out"], sample) for name, sample in samples.items()}
    falls.write(given.work / "transfer.json", result)
    for site, table in [("Tschamut", result["tschamut"])] + [(f"Authume {p}", result["authume"][p]) for p in authume.PROFILES]:
        for name, it in table.items():
            if isinstance(it, dict) and "ks" in it:
                print(f"{site} {name}: {np.round(it['computed_quantiles'], 1)} of {np.round(it['measured_quantiles'], 1)}, {it['distance']:.2f} ({it['noise']:.2f}), {it['ks']:.2f} ({it['ks_probability']:.2g})")


if __name__ == "__main__":
    main()
