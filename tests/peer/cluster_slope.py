#!/usr/bin/env python3
"""One rigid cluster in contact with a slope of 100 352 triangles: ms of CPU per DEM step.

usage: cluster_slope.py [--spheres-per-edge 10 27] [--blocks 3] [--pose corner face air]
"""
import argparse
import math
import statistics
import time

import common

CELLS, CELL, TILT, EDGE = 224, 0.5, math.radians(30.0), 1.0
SEARCH = 50  # NeighbourSearchFrequency, the application's default


def on_slope(along, across, above):
    """From slope coordinates to the world: x down the slope, z up."""
    return (along * math.cos(TILT) + above * math.sin(TILT), across,
            -along * math.sin(TILT) + above * math.cos(TILT))


def slope():
    n = CELLS + 1
    middle = 0.5 * CELLS * CELL
    points = [on_slope(i * CELL - middle, j * CELL - middle, 0.0) for j in range(n) for i in range(n)]
    triangles = []
    for j in range(CELLS):
        for i in range(CELLS):
            a = j * n + i
            triangles += [(a, a + 1, a + n + 1), (a, a + n + 1, a + n)]
    return points, triangles


def turned(pose):
    """Rows of the rotation from the cube to slope coordinates."""
    if pose != "corner":
        return (1, 0, 0), (0, 1, 0), (0, 0, 1)
    a, b, c = 1 / math.sqrt(2), 1 / math.sqrt(6), 1 / math.sqrt(3)
    return (a, -a, 0), (b, b, -2 * b), (c, c, c)


def cube(per_edge, pose):
    """Sphere centres about the cube's centre, turned into the world, and the radius.

    The turn goes into the file, not into the element: the inertia of a cube is the same
    about every axis, so nothing else changes."""
    spacing = EDGE / (per_edge + 0.6)
    rows = turned(pose)
    at = [(i - 0.5 * (per_edge - 1)) * spacing for i in range(per_edge)]
    local = [(x, y, z) for z in at for y in at for x in at]
    return [on_slope(*(sum(r * q for r, q in zip(row, p)) for row in rows)) for p in local], 0.8 * spacing


def write_cluster(case, centres, radius, position):
    with open("cube.clu", "w") as out:
        out.write("Name\ncube\n\n")
        common.block(out, "centers_and_radii", ((*c, radius) for c in centres))
        out.write("Particle_center_and_diameter\n0.0 0.0 0.0 %r\n\n" % EDGE)
        out.write("Size\n%r\n\nVolume\n%r\n\nInertia per unit mass\n" % (EDGE, EDGE ** 3))
        out.write(3 * ("%r\n" % (EDGE ** 2 / 6)))
    with open(case + "DEM_Clusters.mdpa", "w") as out:
        common.block(out, "Properties 1", [])
        common.block(out, "Nodes", [(1, *position)])
        common.block(out, "Elements Cluster3D", [(1, 1, 1)])
        common.block(out, "NodalData CHARACTERISTIC_LENGTH", [(1, 0, EDGE)])
        common.block(out, "NodalData ORIENTATION", [(1, 0, "[4] (0.0, 0.0, 0.0, 1.0)")])
        common.group(out, "Rock", [1], [1], "Elements")
    with open(case + "DEM.mdpa", "w") as out:
        common.block(out, "Properties 1", [])


def touching(stage, radius):
    """Spheres that carry a force; the deepest point below the slope, m."""
    import KratosMultiphysics.DEMApplication as dem
    loaded, deepest = 0, -1e9
    for node in stage.spheres_model_part.Nodes:
        force = node.GetSolutionStepValue(dem.CONTACT_FORCES)
        loaded += any(force[k] != 0.0 for k in range(3))
        deepest = max(deepest, radius - node.X * math.sin(TILT) - node.Z * math.cos(TILT))
    return loaded, deepest


def measure(per_edge, pose, blocks):
    kratos = common.load("DEMApplication")
    centres, radius = cube(per_edge, pose)
    reach = radius - min(x * math.sin(TILT) + z * math.cos(TILT) for x, _, z in centres)
    write_cluster("slope", centres, radius, on_slope(0.1, 0.2, reach + (10.0 if pose == "air" else -1e-3)))
    common.write_walls("slope", *slope())
    begin = time.process_time()
    stage = common.dem_stage(kratos, "slope", "ClusterPart", 2500.0, 1e8, 1e-5,
                             CLUSTER_FILE_NAME="cube.clu", BREAKABLE_CLUSTER=False)
    read = time.process_time() - begin
    assert stage.spheres_model_part.NumberOfElements() == per_edge ** 3
    assert stage.rigid_face_model_part.NumberOfConditions() == 2 * CELLS * CELLS
    common.advance(stage, SEARCH)
    samples, plain, contacts = [], [], []
    for _ in range(blocks):
        mean, median = common.advance(stage, SEARCH)
        samples.append(1e3 * mean)
        plain.append(1e3 * median)
        contacts.append(touching(stage, radius)[0])
    deepest = touching(stage, radius)[1]
    assert (min(contacts) > 0) == (pose != "air"), contacts
    common.report("cluster %d, %s" % (per_edge ** 3, pose), samples, "ms/step",
                  "%.1f without search, %d to %d spheres touch, %.1e m deep, read %.1f s" % (
                      statistics.median(plain), min(contacts), max(contacts), deepest, read))


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--spheres-per-edge", type=int, nargs="+", default=[10, 27])
    options.add_argument("--blocks", type=int, default=3, help="samples of %d steps" % SEARCH)
    options.add_argument("--pose", nargs="+", default=["corner", "face", "air"])
    given = options.parse_args()
    for count in given.spheres_per_edge:
        for pose in given.pose:
            common.alone(measure, count, pose, given.blocks)
