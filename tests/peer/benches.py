#!/usr/bin/env python3
"""Spheres down twelve benches, by `rockfall ensemble` and by an event model of the same law, written for this comparison.

usage: benches.py --bin target/release --work DIR [--rocks 200] [--friction 0.1] [--seed 7] [--young 1e13]

The event model knows no contact in time: a sphere flies in parabolas, an impact is an impulse, and lasting contact is a series of impulses
without restitution. What an impact does along the surface is a function of slip over normal speed alone, since the law of Hertz with friction
of Coulomb and Mindlin's spring has no other scale; it is integrated once for some hundred ratios. Rolling resistance is an angular impulse of at
most `mu_r R` times what the weight would have given since the last touch, if that was no longer ago than a hop of 1 % of R
(docs/contact.md). Printed are quantiles of both samples and the p of Kolmogorov and Smirnov for each quantity. Needs numpy.
"""
import argparse
import csv
import math
import subprocess
import time
from pathlib import Path

import numpy as np

G, RADIUS, DENSITY = 9.81, 0.5, 2500.0
RESTITUTION, FRICTION, HOP = 0.4, 0.6, 0.01
POISSON = 0.25
BENCHES, BERM, FACE, TILT, FACE_TILT, RUN_OUT = 12, 8.0, 6.0, 8.0, 45.0, 700.0
REST_SPEED, REST_TIME = 0.01, 0.5  # of the fastest point, and for how long
LINE = 90.0  # where they are counted, on the seventh berm
END = 100.0


def profile():
    """Corners of the slope, from the berm at the top to the end of the level ground."""
    x, z, corners = -5.0, 5.0 * math.tan(math.radians(TILT)), []
    corners.append((x, z))
    for _ in range(BENCHES):
        x, z = x + BERM + (5.0 if len(corners) == 1 else 0.0), z
        z -= (x - corners[-1][0]) * math.tan(math.radians(TILT))
        corners.append((x, z))
        x, z = x + FACE / math.tan(math.radians(FACE_TILT)), z - FACE
        corners.append((x, z))
    corners.append((x + RUN_OUT, z))
    return np.array(corners)


def write(work, corners, rocks, friction, seed, young):
    half = 20.0
    with open(work / "benches.obj", "w") as out:
        for x, z in corners.tolist():
            out.write(f"v {x!r} {-half!r} {z!r}\nv {x!r} {half!r} {z!r}\n")
        for k in range(len(corners) - 1):
            a = 2 * k + 1
            out.write(f"f {a} {a + 2} {a + 3}\nf {a} {a + 3} {a + 1}\n")
    rolling = f"rolling_friction = {friction!r}\n" if friction else ""
    (work / "fall.toml").write_text(f"""end_time = {END}
gravity = [0.0, 0.0, -{G}]
[[rock]]
position = [0.0, 0.0, 10.0]
density = {DENSITY}
shape = {{ type = "sphere", radius = {RADIUS} }}
[terrain]
file = "benches.obj"
rest_speed = {REST_SPEED}
rest_time = {REST_TIME}
[[contact]]
law = "hertz_rock"
young = {young!r}
poisson = 0.25
restitution = {RESTITUTION}
friction = {FRICTION}
{rolling}[output]
interval = 0.05
""")
    (work / "study.toml").write_text(f"""scene = "fall.toml"
seed = {seed}
sampling = "random"
[[release]]
line = [[-3.0, 0.0], [1.0, 0.0]]
height = 0.5
count = {rocks}
[vary]
speed = {{ uniform = [0.5, 4.0] }}
azimuth = {{ uniform = [90.0, 90.001] }}
dip = {{ uniform = [0.0, 0.001] }}
[[line]]
name = "count"
points = [[{LINE}, -19.0], [{LINE}, 19.0]]
""")


class Slope:
    """Closest points of the profile."""

    def __init__(self, corners):
        self.a, self.d = corners[:-1], np.diff(corners, axis=0)
        self.square = (self.d ** 2).sum(1)

    def nearest(self, p, count):
        """Distance, normal and along-slope direction of the `count` closest pieces to each of `p`."""
        v = p[:, None, :] - self.a
        t = np.clip((v * self.d).sum(2) / self.square, 0.0, 1.0)
        v -= t[..., None] * self.d
        size = np.sqrt((v ** 2).sum(2))
        order = np.argsort(size, axis=1)[:, :count]
        take = np.arange(len(p))[:, None]
        normal = v[take, order] / np.maximum(size[take, order], 1e-12)[..., None]
        return size[take, order], normal


def impact_table(ratios):
    """`impact` with the damping ratio that gives the restitution: the contact pushes and does not pull."""
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if impact(np.zeros(1), middle, 2_000)[1] - 1.0 > RESTITUTION else (low, middle)
    return impact(ratios, low, 20_000)


def impact(ratios, g, steps):
    """Impulse along the surface over mass and normal speed, and that along the normal, for slip over normal speed `ratios` [-].

    A sphere of mass and radius 1 on a rigid plane, `F = k d^1.5` with a dashpot `2 g sqrt(m) ds/dt` on `s = sqrt(2 U)`."""
    n = len(ratios)
    ratio = 2.0 * (1.0 - POISSON) / (2.0 - POISSON)
    k, d, v = 1.0, 0.0, 1.0
    length = 2.0 * 2.94 * (1.25 ** 0.4)
    h = length / steps
    slip, spring, pushed, pulled = ratios.copy(), np.zeros(n), 0.0, np.zeros(n)
    for _ in range(steps):
        middle = d + 0.5 * h * v
        if middle <= 0.0:
            break
        slope = 1.5 * k * math.sqrt(middle)
        # U = 0.4 k d^2.5, so ds/dt = F v / s.
        force = k * middle ** 1.5
        force = max(0.0, force + 2.0 * g * v * force / math.sqrt(0.8 * k * middle ** 2.5))
        stiff = ratio * slope
        if v < 0.0:
            spring = spring * math.sqrt(middle / max(d, middle))
        trial = spring - stiff * slip * h
        limit = FRICTION * force
        spring = np.clip(trial, -limit, limit)
        total = np.clip(spring - 2.0 * g * math.sqrt(stiff) * slip, -limit, limit)
        slip = slip + 3.5 * total * h
        pulled += total * h
        pushed += force * h
        v -= force * h
        d = middle + 0.5 * h * v
    return pulled, pushed


def event_model(corners, x, speed, friction, step=2e-4):
    """Fall of spheres from `x` [m] with `speed` [m/s] level: what each reached."""
    slope, n = Slope(corners), len(x)
    p = np.stack([x, np.full(n, 50.0)], 1)
    ground = np.interp(x, corners[:, 0], corners[:, 1])
    # In touch with the berm, and half a metre higher.
    p[:, 1] = ground + RADIUS / math.cos(math.radians(TILT)) + 0.5
    v, w = np.stack([speed, np.zeros(n)], 1), np.zeros(n)
    mass = 4.0 / 3.0 * math.pi * RADIUS ** 3 * DENSITY
    inertia = 0.4 * mass * RADIUS ** 2
    out = {k: np.zeros(n) for k in ("time", "run_out", "max_speed", "max_energy", "max_jump")}
    crossed = {k: np.full(n, np.nan) for k in ("line_speed", "line_energy", "line_height")}
    moving, touched, saved = np.ones(n, bool), np.full(n, -np.inf), np.zeros(n)
    slow_since = np.full(n, np.inf)
    hop = math.sqrt(8.0 * HOP * RADIUS / G)
    ratios = np.concatenate([np.linspace(0.0, 8.0, 400), [1e3]])
    pulls, pushes = impact_table(ratios)
    print(f"restitution of the impact that is integrated: {pushes - 1.0:.4f} for {RESTITUTION}")
    now = 0.0
    while now < END and moving.any():
        i = np.flatnonzero(moving)
        before = p[i].copy()
        p[i] += v[i] * step
        p[i, 1] -= 0.5 * G * step ** 2
        v[i, 1] -= G * step
        now += step
        distance, normal = slope.nearest(p[i], 2)
        for rank in range(2):
            touch = distance[:, rank] < RADIUS
            j, m = i[touch], normal[touch, rank]
            if not len(j):
                continue
            along = np.stack([m[:, 1], -m[:, 0]], 1)  # to the right where the normal is up
            vn, vt = (v[j] * m).sum(1), (v[j] * along).sum(1)
            # In lasting contact a step of gravity is all that it comes with.
            bounce = np.where(vn < -4.0 * G * step, RESTITUTION, 0.0)
            push = np.maximum(-(1.0 + bounce) * vn, 0.0) * mass
            slip = vt - w[j] * RADIUS  # spin forwards is positive
            stop = -2.0 / 7.0 * mass * slip
            lasting = np.clip(stop, -FRICTION * push, FRICTION * push)
            speed = np.maximum(-vn, 1e-12)
            struck = np.sign(slip) * np.interp(np.abs(slip) / speed, ratios, pulls) * mass * speed
            pull = np.where(bounce > 0.0, struck, lasting)
            v[j] += (push / mass)[:, None] * m + (pull / mass)[:, None] * along
            w[j] -= pull * RADIUS / inertia
            p[j] += (RADIUS - distance[touch, rank])[:, None] * m
            if friction:
                rate = friction * RADIUS * mass * G * np.maximum(m[:, 1], 0.0)
                gap = now - touched[j]
                saved[j] = np.where(gap > hop, 0.0, saved[j] + rate * np.where(np.isfinite(gap), gap, 0.0))
                most = np.minimum(saved[j] + rate * step, rate * hop)
                brake = np.minimum(np.abs(w[j]) * inertia, np.minimum(most, friction * RADIUS * push))
                w[j] -= np.sign(w[j]) * brake / inertia
                saved[j] = most - brake
            touched[j] = now
        energy = 0.5 * mass * (v[i] ** 2).sum(1) + 0.5 * inertia * w[i] ** 2
        size = np.sqrt((v[i] ** 2).sum(1))
        height = p[i, 1] - RADIUS - np.interp(p[i, 0], corners[:, 0], corners[:, 1])
        for key, value in (("max_speed", size), ("max_energy", energy), ("max_jump", height)):
            out[key][i] = np.maximum(out[key][i], value)
        passed = (before[:, 0] < LINE) & (p[i, 0] >= LINE) & np.isnan(crossed["line_speed"][i])
        for key, value in (("line_speed", size), ("line_energy", energy), ("line_height", height)):
            crossed[key][i[passed]] = value[passed]
        slow_since[i] = np.where(size + np.abs(w[i]) * RADIUS < REST_SPEED, np.minimum(slow_since[i], now), np.inf)
        done = (now - slow_since[i] > REST_TIME) | (p[i, 0] > corners[-1, 0])
        left = p[i, 0] > corners[-1, 0]
        out["time"][i[done]] = now
        out["run_out"][i[done]] = np.where(left[done], np.inf, p[i[done], 0] - x[i[done]])
        moving[i[done]] = False
    out["run_out"][moving] = np.inf
    return out | crossed


def kolmogorov_smirnov(a, b):
    """Distance of two samples, and its p (asymptotic, with Stephens' correction)."""
    a, b = np.sort(a), np.sort(b)
    both = np.concatenate([a, b])
    d = np.abs(np.searchsorted(a, both, "right") / len(a) - np.searchsorted(b, both, "right") / len(b)).max()
    n = math.sqrt(len(a) * len(b) / (len(a) + len(b)))
    t = (n + 0.12 + 0.11 / n) * d
    return d, min(1.0, max(0.0, 2.0 * sum((-1) ** (k - 1) * math.exp(-2.0 * (k * t) ** 2) for k in range(1, 100))))


def ours(work, binary):
    begun = time.process_time()
    out = work / "out"
    subprocess.run([binary / "rockfall", "ensemble", work / "study.toml", "--out", out, "--force", "--quiet"], check=True)
    rows = list(csv.DictReader(open(out / "members.csv")))
    number = lambda row, key: float(row[key]) if row[key] else math.inf
    found = {key: np.array([number(r, column) for r in rows]) for key, column in (
        ("time", "time_s"), ("run_out", "run_out_m"), ("max_speed", "max_speed_m_per_s"),
        ("max_energy", "max_kinetic_energy_J"), ("max_jump", "max_jump_height_m"))}
    first = {}
    for row in csv.DictReader(open(out / "lines" / "count.csv")):
        first.setdefault(row["member"], row)
    return found, first, rows


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--bin", type=Path, required=True)
    options.add_argument("--work", type=Path, required=True)
    options.add_argument("--rocks", type=int, default=200)
    options.add_argument("--friction", type=float, default=0.1)
    options.add_argument("--seed", type=int, default=7)
    options.add_argument("--young", type=float, default=1e13)
    o = options.parse_args()
    o.work.mkdir(parents=True, exist_ok=True)
    corners = profile()
    write(o.work, corners, o.rocks, o.friction, o.seed, o.young)
    found, first, rows = ours(o.work, o.bin)
    for key, parts in (("line_speed", ("speed_m_per_s",)), ("line_energy", ("kinetic_energy_J",)),
                       ("line_height", ("passing_height_m",))):
        found[key] = np.array([sum(float(r[p]) for p in parts) for r in first.values()])
    # Starts of its own: two samples of one distribution.
    random = np.random.default_rng(o.seed)
    model = event_model(corners, random.uniform(-3.0, 1.0, o.rocks), random.uniform(0.5, 4.0, o.rocks), o.friction)
    print(f"{'quantity':<14}{'rockfall q10/q50/q90':>32}{'event model':>32}{'KS':>8}{'p':>9}")
    for key in found:
        a, b = found[key], model[key]
        b = b[~np.isnan(b)]
        d, p = kolmogorov_smirnov(a, b)
        three = lambda s: " / ".join("%.4g" % q for q in np.quantile(s, [0.1, 0.5, 0.9], method="inverted_cdf"))
        print(f"{key:<14}{three(a):>32}{three(b):>32}{d:>8.3f}{p:>9.3g}")


if __name__ == "__main__":
    main()
