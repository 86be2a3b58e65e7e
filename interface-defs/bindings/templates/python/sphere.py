#!/usr/bin/env python3
"""A sphere that falls on nodes as the contact solver of a run: a penalty force where it overlaps one.

Mass, radius, start and gravity are those of the scene's first rock; position Verlet, steps of 20 us at most.
"""
import numpy as np
import rockfall

STEP = 2e-5  # the longest [s]


class Sphere(rockfall.Contact):
    program = "sphere (Python)"

    def prepare(self, plan):
        if plan.partner is None:
            raise rockfall.Fault("a sphere needs a net to fall on: give the scene a [structure]", "input")
        rock = plan.scene["rock"][0]
        self.mass, self.radius = rock["mass"], rock["shape"]["radius"]
        self.gravity = np.array(plan.scene["gravity"])
        self.stiffness = plan.scene.get("custom", {}).get("penalty", 2e5)  # [N/m]
        self.nodes = plan.partner.coordinates
        gauges = [rockfall.Gauge("sphere_z", "m"), rockfall.Gauge("sphere_vz", "m/s")]
        return rockfall.Ready(state=(np.array(rock["position"]), np.array(rock["velocity"])), gauges=gauges)

    def start(self, state, gives, gauges):
        gauges[0], gauges[1] = state[0][2], state[1][2]

    def forces(self, x, nodes):
        d = nodes - x
        distance = np.sqrt((d * d).sum(1))
        overlap = self.radius - distance
        return np.where(overlap > 0, self.stiffness * overlap / distance, 0.0)[:, None] * d

    def solve(self, state, window, takes, gives, gauges):
        (x, v), (from_, to) = state, takes[0]
        steps = window.steps(STEP)
        h, mean, path = window.length / steps, 0.0, []
        for step in range(steps):
            x = x + 0.5 * h * v
            f = self.forces(x, self.nodes + (from_ + (step + 0.5) / steps * (to - from_)))
            v = v + h * (self.gravity - f.sum(0) / self.mass)
            x = x + 0.5 * h * v
            mean = mean + f / steps
            path.append((x[2], v[2]))
        for give, force in zip(gives, (mean, self.forces(x, self.nodes + to))):
            if give is not None:  # the plan has one of the two, or both
                give[-1] = force
        gauges[:] = np.stack((path[-1], np.min(path, 0), np.max(path, 0)), 1)
        return x, v


if __name__ == "__main__":
    rockfall.serve(Sphere())
