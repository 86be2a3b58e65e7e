#!/usr/bin/env python3
"""10 000 separate spheres in a box of rigid walls: us of CPU per sphere and DEM step.

loose: a fifth of the volume filled, falling with random velocities; dense: a jittered
cubic packing pressed together, six neighbours each, at rest under gravity.

usage: settling_box.py [--blocks 3] [--radius 0.05] [--order rows shuffled]
"""
import argparse
import math
import random
import statistics

import common

COUNT = (25, 20, 20)
SEARCH = 50  # NeighbourSearchFrequency, the application's default
CORNERS = ((0, 1, 2), (1, 3, 2), (4, 6, 5), (5, 6, 7), (0, 4, 1), (1, 4, 5),
           (2, 3, 6), (3, 7, 6), (0, 2, 4), (2, 6, 4), (1, 5, 3), (3, 5, 7))


def packing(state, order, radius):
    """Centres, velocities, and the size of the box."""
    dice = random.Random(1)
    if state == "loose":
        spacing, jitter, speed = radius * (4 / 3 * math.pi / 0.2) ** (1 / 3), 0.35, 3.0
    else:
        spacing, jitter, speed = 1.98 * radius, 0.004, 0.0
    gap = spacing / 2 if state == "loose" else 0.995 * radius
    box = [spacing * (n - 1) + 2 * gap for n in COUNT]
    centres = [tuple(gap + spacing * i + radius * dice.uniform(-jitter, jitter) for i in (x, y, z))
               for z in range(COUNT[2]) for y in range(COUNT[1]) for x in range(COUNT[0])]
    if order == "shuffled":  # neighbours in the box are not neighbours in memory
        dice.shuffle(centres)
    return centres, [[speed * dice.uniform(-1, 1) for _ in range(3)] for _ in centres], box


def write_spheres(case, centres, velocities, radius):
    ids = range(1, len(centres) + 1)
    with open(case + "DEM.mdpa", "w") as out:
        common.block(out, "Properties 1", [])
        common.block(out, "Nodes", ((i, *c) for i, c in zip(ids, centres)))
        common.block(out, "Elements SphericParticle3D", ((i, 1, i) for i in ids))
        common.block(out, "NodalData RADIUS", ((i, 0, radius) for i in ids))
        for k, axis in enumerate("XYZ"):
            common.block(out, "NodalData VELOCITY_" + axis, ((i, 0, v[k]) for i, v in zip(ids, velocities)))
        common.group(out, "Body", ids, ids, "Elements")


def contacts(nodes, radius):
    """Touching pairs per sphere (each pair counts for both), and the deepest overlap."""
    cells = {}
    for node in nodes:
        p = (node.X, node.Y, node.Z)
        cells.setdefault(tuple(int(q // (2 * radius)) for q in p), []).append(p)
    ends, deepest = 0, 0.0
    for (a, b, c), here in cells.items():
        near = [q for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)
                for q in cells.get((a + i, b + j, c + k), ())]
        for p in here:
            for q in near:
                apart = math.dist(p, q)
                if p is not q and apart < 2 * radius:
                    ends += 1
                    deepest = max(deepest, 2 * radius - apart)
    return ends / len(nodes), deepest


def measure(state, order, radius, blocks):
    kratos = common.load("DEMApplication")
    centres, velocities, box = packing(state, order, radius)
    write_spheres("box", centres, velocities, radius)
    common.write_walls("box", [tuple(s * b for s, b in zip((i & 1, i >> 1 & 1, i >> 2), box)) for i in range(8)],
                       CORNERS)
    stage = common.dem_stage(kratos, "box", "SpheresPart", 2500.0, 1e7, 1e-5)
    nodes = stage.spheres_model_part.Nodes
    assert len(nodes) == stage.spheres_model_part.NumberOfElements() == len(centres)
    common.advance(stage, SEARCH)
    first = contacts(nodes, radius)[0]
    steps = [common.advance(stage, SEARCH) for _ in range(blocks)]
    samples, plain = ([1e6 * t / len(nodes) for t in times] for times in zip(*steps))
    last, deepest = contacts(nodes, radius)
    assert len(nodes) == len(centres)
    filled = len(centres) * 4 / 3 * math.pi * radius ** 3 / math.prod(box)
    common.report("box of %d, %s, %s" % (len(centres), state, order), samples, "us/sphere/step",
                  "%.2f without search, %.3f filled, %.2f to %.2f contacts per sphere, "
                  "overlap up to %.1f %% of radius" % (
                      statistics.median(plain), filled, first, last, 100 * deepest / radius))


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--blocks", type=int, default=3, help="samples of %d steps" % SEARCH)
    options.add_argument("--radius", type=float, default=0.05)
    options.add_argument("--order", nargs="+", default=["rows", "shuffled"])
    given = options.parse_args()
    for state in ("loose", "dense"):
        for order in given.order:
            common.alone(measure, state, order, given.radius, given.blocks)
