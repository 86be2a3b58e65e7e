#!/usr/bin/env python3
"""A net of masses and springs as the structure of a run.

7 x 7 nodes, the edge held; position Verlet, steps of 0.1 ms at most; it repeats a window to equal bytes.
"""
import numpy as np
import rockfall

SIDE = 7  # nodes along an edge
SPACING, REST = 0.5, 0.49  # of nodes; length of a spring without force [m]
MASS, STIFFNESS, STEP = 1.0, 5e4, 1e-4  # of a node [kg], of a spring [N/m], the longest [s]


class Net(rockfall.Structure):
    program = "net (Python)"
    largest_window = 1e-3  # [s]

    def prepare(self, plan):
        nodes = [(i, j) for j in range(SIDE) for i in range(SIDE)]
        self.x = SPACING * np.array([(i - 3, j - 3, 0) for i, j in nodes])
        springs = [(n, n + s) for n, at in enumerate(nodes) for k, s in enumerate((1, SIDE)) if at[k] + 1 < SIDE]
        self.springs = np.array(springs)
        self.held = np.array([i in (0, SIDE - 1) or j in (0, SIDE - 1) for i, j in nodes])
        mesh = rockfall.Mesh(self.x, springs, line_radius=0.01, masses=np.where(self.held, np.inf, MASS))
        gauges = [rockfall.Gauge("centre_uz", "m"), rockfall.Gauge("reaction_z", "N")]
        return rockfall.Ready(mesh, state=(0 * self.x, 0 * self.x), gauges=gauges)

    def forces(self, u):
        x = self.x + u
        d = x[self.springs[:, 1]] - x[self.springs[:, 0]]
        length = np.sqrt((d * d).sum(1))
        pull = (STIFFNESS * (length - REST) / length)[:, None] * d
        f = np.zeros_like(x)
        np.add.at(f, self.springs.ravel(), np.stack((pull, -pull), 1).reshape(-1, 3))
        return f

    def solve(self, state, window, takes, gives, gauges):
        (u, v), load = state, takes[0][0]
        steps = window.steps(STEP)
        h, free = window.length / steps, ~self.held[:, None]
        uz, reaction = [], []
        for _ in range(steps):
            u = u + 0.5 * h * v
            f = self.forces(u) + load
            v = v + free * (h * f / MASS)
            u = u + 0.5 * h * v
            uz.append(u[len(u) // 2, 2])
            reaction.append(-f[self.held, 2].sum())
        gives[0][-1], gives[1][-1] = u, v
        gauges[0] = uz[-1], min(uz), max(uz)
        gauges[1] = np.mean(reaction), min(reaction), max(reaction)
        return u, v


if __name__ == "__main__":
    rockfall.serve(Net())
