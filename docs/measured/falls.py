"""What a calibration needs, whatever the site: studies of `rockfall ensemble`, samples of run-out, distances between them, the calibration.

    pip install numpy matplotlib
"""

import argparse
import csv
import json
import math
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np

QUANTILES = (10, 50, 90)
GRID = np.linspace(1.0, 99.0, 99)  # per cent, of the distance between two samples
DRAWS = 4000  # of a bootstrap


def arguments(data_help):
    """Command line that all scripts have."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", type=Path, required=True, help=data_help)
    parser.add_argument("--work", type=Path, required=True, help="where studies and results go")
    parser.add_argument("--rockfall", type=Path, default=Path("target/release/rockfall"))
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--points", type=int, nargs=3, default=[40, 20, 12], help="of the calibration: in the whole range, closer, close")
    parser.add_argument("--of", type=int, help="draw the points in the whole range as for so many, and take the first of them")
    parser.add_argument("--members", type=int, nargs=2, default=[2, 8], help="for each start in the calibration, and in what is reported")
    parser.add_argument("--again", type=int, nargs=2, default=[0, 1], help="compute so many of the best points again, with so many members for each start")
    found = parser.parse_args()
    found.work.mkdir(parents=True, exist_ok=True)
    return found


def text(value):
    """A value as TOML writes it."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {text(v)}" for key, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(text, value)) + "]"
    return json.dumps(value)


def study(path, scene, releases, vary, lines=()):
    """Write a study: releases and lines are dictionaries, `vary` has its keys as the study writes them."""
    rows = [f"scene = {text(scene)}", "seed = 1"]
    for name, table in [("release", it) for it in releases] + [("line", it) for it in lines]:
        rows += ["", f"[[{name}]]"] + [f"{key} = {text(value)}" for key, value in table.items()]
    rows += ["", "[vary]"] + [f"{key} = {text(value)}" for key, value in vary.items()]
    path.write_text("\n".join(rows) + "\n")


def spheres(given, scene):
    """File of the spheres that cover the rock of a scene: made once, for a study makes them anew at each start."""
    out = scene.with_name(scene.stem + "-spheres")
    found = out / "clusters" / "rock.xyzr"
    if found.exists():
        return found.relative_to(scene.parent)
    command = [given.rockfall, "run", scene, "--out", out, "--set", "end_time=0.01", "--quiet", "--force"]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if not found.exists():
        raise SystemExit(f"{scene}: {done.stdout}{done.stderr}")
    return found.relative_to(scene.parent)


def ensemble(given, path):
    """Run a study into a directory beside it, anew; its rows."""
    out = path.with_suffix("")
    shutil.rmtree(out, ignore_errors=True)
    command = [given.rockfall, "ensemble", path, "--out", out, "--quiet", "--threads", given.threads]
    command = [str(word) for word in command]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    with open(out / "members.csv", newline="") as file:
        return list(csv.DictReader(file))


def places(rows):
    """Where members that are to be trusted began and ended, seen from above, and how many are not to be trusted."""
    good = [row for row in rows if row["status"] == "done"]
    of = lambda a, b: np.array([[float(row[a]), float(row[b])] for row in good]).reshape(-1, 2)
    return of("x_m", "y_m"), of("end_x_m", "end_y_m"), len(rows) - len(good)


def quantiles(sample):
    """The quantiles of the tables."""
    return [float(q) for q in np.percentile(sample, QUANTILES)]


def intervals(sample, seed=1):
    """For each quantile the interval that 95 % of the resampled samples lie in."""
    draw = np.random.default_rng(seed).choice(sample, (DRAWS, len(sample)))
    low, high = np.percentile(np.percentile(draw, QUANTILES, axis=1), (2.5, 97.5), axis=1)
    return [[float(a), float(b)] for a, b in zip(low, high)]


def distance(one, other):
    """Mean distance of the quantiles of two samples, in their unit."""
    return float(np.mean(np.abs(np.percentile(one, GRID) - np.percentile(other, GRID))))


def noise(sample, seed=2):
    """Distance that two resampled samples of that kind have from each other: median."""
    draw = np.random.default_rng(seed)
    pairs = [(draw.choice(sample, len(sample)), draw.choice(sample, len(sample))) for _ in range(400)]
    return float(np.median([distance(a, b) for a, b in pairs]))


def kolmogorov_smirnov(one, other):
    """Largest distance of two empirical distributions, and the probability of that or more if both are of one kind.

    Source of the probability: Stephens (1970), J. R. Stat. Soc. B 32, 115, for the sum of Kolmogorov.
    """
    one, other = np.sort(one), np.sort(other)
    both = np.concatenate([one, other])
    share = lambda sample: np.searchsorted(sample, both, side="right") / len(sample)
    largest = float(np.max(np.abs(share(one) - share(other))))
    root = math.sqrt(len(one) * len(other) / (len(one) + len(other)))
    scaled = (root + 0.12 + 0.11 / root) * largest
    terms = [2.0 * (-1) ** (k - 1) * math.exp(-2.0 * (k * scaled) ** 2) for k in range(1, 101)]
    return largest, min(max(sum(terms), 0.0), 1.0) if scaled > 0.2 else 1.0


def compare(measured, computed):
    """What a table says of two samples."""
    largest, probability = kolmogorov_smirnov(measured, computed)
    return {
        "measured": [float(v) for v in np.sort(measured)],
        "computed": [float(v) for v in np.sort(computed)],
        "measured_quantiles": quantiles(measured),
        "measured_intervals": intervals(measured),
        "computed_quantiles": quantiles(computed),
        "distance": distance(measured, computed),
        "noise": noise(measured),
        "ks": largest,
        "ks_probability": probability,
    }


class Range:
    """Values that a parameter may take: from `low` to `high`, evenly or in proportion."""

    def __init__(self, low, high, proportional=False):
        self.low, self.high, self.proportional = low, high, proportional

    def at(self, share):
        if self.proportional:
            return self.low * (self.high / self.low) ** share
        return self.low + (self.high - self.low) * share


def hypercube(count, dimensions, draw):
    """Latin hypercube: one point in each of `count` equal parts of every dimension."""
    return (np.argsort(draw.random((dimensions, count)), axis=1).T + draw.random((count, dimensions))) / count


def calibrate(ranges, cost, points, log, seed=3, of=None):
    """The cheapest point of `cost` within `ranges`: a Latin hypercube, then two smaller ones around the best so far.

    `cost` takes a dictionary of values; `of`: the first hypercube is drawn for so many points, of which the first are taken. Returns
    all points that were tried, the best first. What `log` holds is not done again.
    """
    draw = np.random.default_rng(seed)
    known = {str(it["values"]): it for it in json.loads(log.read_text())} if log.exists() else {}
    tried = []
    for count, width in zip(points, (1.0, 0.4, 0.15)):
        centre = min(tried, key=lambda it: it["cost"])["shares"] if tried else [0.5] * len(ranges)
        drawn = of if of and width == 1.0 else count
        for point in hypercube(drawn, len(ranges), draw)[:count]:
            shares = [min(max(c + width * (p - 0.5), 0.0), 1.0) for c, p in zip(centre, point)]
            values = {name: float(f"{it.at(s):.4g}") for (name, it), s in zip(ranges.items(), shares)}
            tried.append(known.get(str(values)) or {"values": values, "shares": shares, **cost(values)})
            tried[-1]["number"] = len(tried)
            write(log, tried if len(tried) > len(known) else list(known.values()))
    return sorted(tried, key=lambda it: it["cost"])


def confirm(tried, cost, again, log):
    """The best points computed again with more members, the best of these first: the best of many small samples is so by chance as well.

    `cost` takes values and members for each start.
    """
    count, each = again
    known = json.loads(log.read_text()) if log.exists() else []
    found = []
    for it in tried[:count]:
        same = [one for one in known if one["values"] == it["values"]]
        found.append(same[0] if same else it | {"first_cost": it["cost"]} | cost(it["values"], each))
        write(log, found if len(found) > len(known) else known)
    return sorted(found, key=lambda it: it["cost"]) + tried[count:]


def rank(sample):
    """Place of each value in order; equal ones share the mean of theirs."""
    sample = np.asarray(sample)
    return np.array([(np.sum(sample < v) + np.sum(sample <= v) + 1) / 2 for v in sample])


def deciding(tried, points, result):
    """Rank correlation (Spearman) of each parameter with a result, over the points in the whole range."""
    whole = sorted(tried, key=lambda it: it["number"])[: points[0]]
    of = lambda values: rank(values) - (len(whole) + 1) / 2
    target = of([result(it) for it in whole])
    found = {}
    for name in whole[0]["values"]:
        one = of([it["values"][name] for it in whole])
        found[name] = float(one @ target / math.sqrt(float(one @ one) * float(target @ target)))
    return found


def write(path, what):
    path.write_text(json.dumps(what, indent=1))
