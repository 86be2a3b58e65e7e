#!/usr/bin/env python3
"""A net of cables and trusses as the structure of a run, read from what `rockfall export` writes of a scene.

usage: net.py MODELLED.mdpa REST.mdpa ...   (both files are of one scene, the second is written with --at-rest)

Position Verlet in steps of `fem.time_step` of the scene at most, with its `structure.damping`; it repeats a window to equal bytes.
"""
import re
import sys

import numpy as np
import rockfall

LEAST = {"CableElement3D2N": 0.0, "TrussElement3D2N": -np.inf}  # pull


def blocks(file):
    """Blocks of an .mdpa file in their order: kind, name, rows of words."""
    try:
        with open(file) as lines:
            text = re.sub(" *//.*", "", lines.read())
    except OSError as error:
        raise rockfall.Fault("%s (usage: net.py MODELLED.mdpa REST.mdpa, of rockfall export)" % error, "input") from None
    found = re.findall(r"^Begin (\w+) ?([^\n]*)\n(.*?)^End ", text, re.M | re.S)
    return [(kind, name, [row.split() for row in rows.splitlines()]) for kind, name, rows in found]


def places(read):
    return np.array([row[1:] for kind, _, rows in read if kind == "Nodes" for row in rows], dtype=float)


class Net(rockfall.Structure):
    program = "net of cables (Python)"

    def prepare(self, plan):
        read = blocks(sys.argv[1])
        modelled, self.rest = places(read), places(blocks(sys.argv[2]))
        at = {row[0]: i for kind, _, rows in read if kind == "Nodes" for i, row in enumerate(rows)}
        sections = {name: dict(rows) for kind, name, rows in read if kind == "Properties"}
        self.held, gravity = np.zeros(modelled.shape, dtype=bool), np.zeros(modelled.shape)
        elements = []
        for kind, name, rows in read:
            if kind == "Elements" and name not in LEAST:
                raise rockfall.Fault("%s: %s: cables and trusses alone are computed" % (sys.argv[1], name), "input")
            elif kind == "Elements":
                elements += [(at[a], at[b], section, LEAST[name]) for _, section, a, b in rows]
            elif kind == "NodalData":
                nodes, c = [at[row[0]] for row in rows], "XYZ".index(name[-1])
                self.held[nodes, c] |= name.startswith("DISPLACEMENT")
                if name.startswith("VOLUME"):
                    gravity[nodes, c] = [float(row[2]) for row in rows]
        names = "YOUNG_MODULUS", "CROSS_AREA", "DENSITY", "TRUSS_PRESTRESS_PK2"
        young, area, density, prestress = np.array([[float(sections[of][n]) for n in names] for _, _, of, _ in elements]).T
        self.ends = np.array([(a, b) for a, b, _, _ in elements])
        self.floor = np.array([floor for *_, floor in elements])
        self.square = self.squares(modelled)
        length = np.sqrt(self.square)
        # Pull per length: S A / L with S = prestress + E e, and the Green-Lagrange strain e = (l^2 - L^2) / (2 L^2).
        self.pull, self.slope = prestress * area / length, young * area / (2.0 * length**3)
        self.mass = np.bincount(self.ends.T.ravel(), np.tile(0.5 * density * area * length, 2), len(modelled))[:, None]
        self.weight = self.mass * gravity
        self.gain = np.where(self.held, 0.0, 1.0 / self.mass)

        self.longest, self.damping = plan.scene["fem"].get("time_step"), plan.scene["structure"].get("damping", 0.0)
        if not self.longest:
            raise rockfall.Fault("fem.time_step: the net needs one, below 2 / w (`rockfall check` prints it)", "input")
        shown = next((gauge["at"] for gauge in plan.scene.get("gauge", []) if "at" in gauge), [0.0, 0.0, 0.0])
        self.shown = ((self.rest - shown) ** 2).sum(1).argmin()
        self.reaction = -(self.force(self.rest) * self.held).sum(0)
        gauges = [rockfall.Gauge("reaction_" + c, "N", extremes=False) for c in "xyz"] + [rockfall.Gauge("centre_uz", "m")]
        masses, radius = np.where(self.held.all(1), np.inf, self.mass[:, 0]), plan.scene["structure"].get("cable", {}).get("radius", 0.0)
        mesh = rockfall.Mesh(self.rest, self.ends, line_radius=radius, masses=masses)
        return rockfall.Ready(mesh, state=(self.rest, 0.0 * self.rest, 0.0), gauges=gauges)

    def squares(self, x):
        d = x[self.ends[:, 1]] - x[self.ends[:, 0]]
        return (d * d).sum(1)

    def force(self, x):
        """Of elements and weight on each node at the places `x` [N]."""
        d = x[self.ends[:, 1]] - x[self.ends[:, 0]]
        pull = np.maximum(self.pull + self.slope * ((d * d).sum(1) - self.square), self.floor)[:, None] * d
        force = self.weight.copy()
        np.add.at(force, self.ends[:, 0], pull)
        np.subtract.at(force, self.ends[:, 1], pull)
        return force

    def start(self, state, gives, gauges):
        gauges[:3] = self.reaction[:, None]

    def solve(self, state, window, takes, gives, gauges):
        (x, v, largest), load, steps = state, takes[0][-1], window.steps(self.longest)
        h, rows = window.length / steps, []
        c = 0.5 * h * self.damping
        for _ in range(steps):
            middle = x + 0.5 * h * v
            force = self.force(middle) + load
            v = ((1.0 - c) * v + h * self.gain * force) / (1.0 + c)
            x = middle + 0.5 * h * v
            reaction = -(force * self.held).sum(0)
            largest = max(largest, np.linalg.norm(reaction))
            rows.append([*reaction, x[self.shown, 2] - self.rest[self.shown, 2]])
        gives[0][-1], gives[1][-1] = x - self.rest, v
        gauges[:] = np.stack((rows[-1], np.min(rows, 0), np.max(rows, 0)), 1)
        gauges[:3, 0] = np.mean(rows, 0)[:3]
        return x, v, largest

    def finish(self, state):
        return {"max_reaction": (state[2], "N")}


if __name__ == "__main__":
    rockfall.serve(Net())
