#!/usr/bin/env python3
"""Kratos' StructuralMechanicsApplication as the structure of a run: cables, their supports, their weight.

The net is what `rockfall export` writes of the scene, read by Kratos; a second export, --at-rest, says where it starts, and Kratos' own
forces must balance there. `fem.integrator` of the scene names the scheme:

- `central_difference`: forces of Kratos' elements as its explicit scheme assembles them, in the position Verlet of rockfall. Kratos' own
  step cannot start again: it sums up its time, and its damping takes the velocity of the step before.
- `bossak`, `newmark`: Kratos' own scheme and Newton's method. Its state is the motion at one instant, written into its buffers
  before each step.
"""
import pathlib
import subprocess
import sys
import tempfile
import tomllib

import KratosMultiphysics as Kratos
import KratosMultiphysics.StructuralMechanicsApplication as Structural
import numpy as np
import rockfall
from rockfall.runs import program

VARIABLES = "DISPLACEMENT VELOCITY ACCELERATION REACTION VOLUME_ACCELERATION POINT_LOAD FORCE_RESIDUAL RESIDUAL_VECTOR".split()
DOFS, REACTIONS = (
    [Kratos.KratosGlobals.GetVariable(name + c) for c in ("_X", "_Y", "_Z")] for name in ("DISPLACEMENT", "REACTION")
)
# What of [structure] is not in an .mdpa file, and the parts that this wrapper has.
UNKNOWN = ("ground", "contact", "dampers", "springs", "masses", "loads", "pressures", "velocities")
PARTS, SCHEMES = ("cable", "none"), ("central_difference", "bossak", "newmark")
MEAN = 1e-3  # time over which the reaction is a mean [s]
AT_REST = 1e-6  # force that may be left at a free node at the start, as a part of the largest one at a node


def refuse(key, what):
    raise rockfall.Fault("%s: %s" % (key, what), "input")


def column(nodes, variable, step=None):
    """(read, write) of a variable of all nodes, (nodes, components); `step` of the buffer: 0 now, 1 the step before."""
    kinds = Kratos.TensorAdaptors
    if step is None:
        adaptor = kinds.VariableTensorAdaptor(nodes, variable)
    else:
        adaptor = kinds.HistoricalVariableTensorAdaptor(nodes, variable, step_index=step)

    def read():
        adaptor.CollectData()
        return np.array(adaptor.data)

    def write(values):
        adaptor.data[:] = values
        adaptor.StoreData()

    return read, write


class Verlet:
    """u_m = u + h/2 v; v' = ((1 - c) v + h f(u_m)/m) / (1 + c); u' = u_m + h/2 v'; c = h/2 times the damping."""

    def __init__(self, part, free, damping):
        self.part, self.damping = part, damping
        self.scheme = Structural.ExplicitCentralDifferencesScheme(1.0, 1.0, 0.0)
        self.strategy = Structural.MechanicalExplicitStrategy(part, self.scheme, False, False, False)
        self.strategy.Initialize()
        self.mass = column(part.Nodes, Kratos.NODAL_MASS)[0]()[:, None]
        self.inverse_mass = np.divide(free, self.mass, where=self.mass > 0.0, out=np.zeros(free.shape))
        self.write = column(part.Nodes, Kratos.DISPLACEMENT, 0)[1]
        self.read = column(part.Nodes, Kratos.FORCE_RESIDUAL, 0)[0]
        self.empty = Kratos.DofsArrayType(), Kratos.CompressedMatrix(), Kratos.Vector(), Kratos.Vector()

    def force(self, u):
        """Weight and elements on each node at the displacement `u` [N]."""
        self.write(u)
        self.strategy.InitializeSolutionStep()  # sets the sums to 0
        self.scheme.Predict(self.part, *self.empty)  # adds up what all elements do
        return self.read()

    def step(self, motion, load, h):
        """The motion after `h` [s], and the force in between."""
        u, v, _ = motion
        c, middle = 0.5 * self.damping * h, u + 0.5 * h * v
        force = self.force(middle) + load
        after = (1.0 - c) / (1.0 + c) * v + h / (1.0 + c) * (self.inverse_mass * force)
        return (middle + 0.5 * h * after, after, motion[2]), force


class Implicit:
    """Kratos' Bossak scheme, or Newmark's, with lumped masses; the load is that at the step's end."""

    def __init__(self, part, fem, damping):
        self.part = part
        part.ProcessInfo[Structural.RAYLEIGH_ALPHA], part.ProcessInfo[Structural.RAYLEIGH_BETA] = damping, 0.0
        part.ProcessInfo[Kratos.COMPUTE_LUMPED_MASS_MATRIX] = True
        for node in part.Nodes:
            part.CreateNewCondition("PointLoadCondition3D1N", node.Id, [node.Id], part.GetProperties()[1])
        alpha = fem.get("alpha", -0.3) if fem["integrator"] == "bossak" else 0.0
        scheme = Kratos.ResidualBasedBossakDisplacementScheme(alpha)
        solver = Kratos.LinearSolverFactory().Create(Kratos.Parameters('{"solver_type": "skyline_lu_factorization"}'))
        near = Kratos.ResidualCriteria(1e-10, 1e-9)
        builder = Kratos.ResidualBasedBlockBuilderAndSolver(solver)
        self.strategy = Kratos.ResidualBasedNewtonRaphsonStrategy(part, scheme, near, builder, 50, True, False, False)
        self.strategy.Initialize()
        variables = Kratos.DISPLACEMENT, Kratos.VELOCITY, Kratos.ACCELERATION
        self.buffers = [[column(part.Nodes, variable, step) for variable in variables] for step in (0, 1)]
        self.load = column(part.Nodes, Structural.POINT_LOAD, 0)[1]
        self.reaction = column(part.Nodes, Kratos.REACTION, 0)[0]

    def step(self, motion, load, h):
        """The motion after `h` [s], and at held nodes the force then."""
        for (_, write), values in zip(self.buffers[0] + self.buffers[1], motion + motion):
            write(values)
        self.load(load)
        self.part.ProcessInfo[Kratos.DELTA_TIME] = h
        self.strategy.InitializeSolutionStep()
        self.strategy.Predict()
        done = self.strategy.SolveSolutionStep()
        self.strategy.FinalizeSolutionStep()
        if not done:
            raise rockfall.Fault("Newton's method of Kratos has not converged in 50 iterations", "window")
        return tuple(read() for read, _ in self.buffers[0]), -self.reaction()


class Net(rockfall.Structure):
    program = "Kratos StructuralMechanics " + Kratos.Kernel.Version().split("-")[0].replace('"', "")

    def __init__(self, scene):
        """`scene`: with every default."""
        self.scene, self.fem, self.table = scene, scene.get("fem", {}), scene.get("structure", {})
        self.explicit = self.fem.get("integrator") == "central_difference"
        self.takes = [rockfall.Field("force", "means" if self.explicit else "at_ends")]

    def prepare(self, plan):
        self.check()
        self.longest, self.damping = self.fem["time_step"], self.table.get("damping", 0.0)
        part, self.origin = self.read()
        nodes = list(part.Nodes)
        free = np.array([[not node.IsFixed(dof) for dof in DOFS] for node in nodes])
        self.held, verlet = ~free, Verlet(part, free, self.damping)
        self.mass = verlet.mass
        self.weight = self.mass * column(part.Nodes, Kratos.VOLUME_ACCELERATION, 0)[0]()
        force = verlet.force(self.origin)
        left, size = np.where(free, force, 0.0), np.abs(force).max()
        if self.table.get("form_finding") != "none" and np.abs(left).max() > AT_REST * size:
            refuse("structure", "is not at rest for Kratos: %.3e N are left at a node" % np.abs(left).max())
        self.scheme = verlet if self.explicit else Implicit(part, self.fem, self.damping)

        place = np.array([(node.X0, node.Y0, node.Z0) for node in nodes]) + self.origin
        at = {node.Id: i for i, node in enumerate(nodes)}
        lines = [[at[node.Id] for node in element.GetNodes()] for element in part.Elements]
        radius = self.table.get("cable", {}).get("radius", 0.0)
        masses = np.where(free.any(axis=1), self.mass[:, 0], np.inf)
        mesh = rockfall.Mesh(place, lines, line_radius=radius, masses=masses)

        points = [one for one in self.scene.get("gauge", []) if one["quantity"] == "displacement" and "at" in one]
        self.watched = [((place - one["at"]) ** 2).sum(1).argmin() for one in points]
        roles = "kinetic", "potential", "dissipated", "received"
        gauges = [rockfall.Gauge("reaction_" + c, "N", extremes=False) for c in "xyz"]
        gauges += [rockfall.Gauge("energy_%s_fem" % role, "J", role, extremes=False) for role in roles]
        gauges += [rockfall.Gauge("%s_u%s" % (one["name"], c), "m") for one in points for c in "xyz"]
        self.reaction = -(force * self.held).sum(0)
        motion = (self.origin, np.zeros_like(left), left * verlet.inverse_mass)
        # Time [s] and impulse of the supports [N s] in the last millisecond; largest reaction, and of its mean over that.
        past = np.array([[-MEAN, *(-MEAN * self.reaction)], [0.0, 0.0, 0.0, 0.0]])
        return rockfall.Ready(mesh, state=(motion, 0.0, 0.0, past, np.zeros(2)), gauges=gauges)

    def check(self):
        """One error for what Kratos does not get from an .mdpa file."""
        for name in UNKNOWN:
            if self.table.get(name):
                refuse("structure." + name, "it is not in an .mdpa file")
        for i, entry in enumerate(self.table.get("parts", [])):
            if entry.get("element") not in PARTS:
                refuse("structure.parts.%d" % i, "the wrapper of Kratos has cables alone, no %s" % entry.get("element"))
        for i, entry in enumerate(self.table.get("supports", [])):
            if any(entry.get(key) for key in ("motion", "turning", "released_at", "stiffness")):
                refuse("structure.supports.%d" % i, "the wrapper of Kratos has rigid supports alone")
        if not self.fem.get("time_step"):
            refuse("fem.time_step", "Kratos needs one, below 2 / w of the net")
        if self.fem.get("integrator") not in SCHEMES:
            refuse("fem.integrator", "%s is not one of %s" % (self.fem.get("integrator", "nothing"), ", ".join(SCHEMES)))

    def read(self):
        """The net as modelled, and its displacement where it comes to rest [m]."""
        self.model = Kratos.Model()
        with tempfile.TemporaryDirectory() as folder:
            for name, options in (("net", []), ("rest", ["--at-rest"])):
                file = str(pathlib.Path(folder) / name)
                words = [program(), "export", sys.argv[2], "--to", file + ".mdpa", *options]
                done = subprocess.run(words, capture_output=True, text=True)
                if done.returncode:
                    raise rockfall.Fault("rockfall export: " + done.stderr.strip(), "input")
                part = self.model.CreateModelPart(name, 2)
                for variable in VARIABLES:
                    part.AddNodalSolutionStepVariable(Kratos.KratosGlobals.GetVariable(variable))
                part.ProcessInfo[Kratos.DOMAIN_SIZE] = 3
                Kratos.ModelPartIO(file, Kratos.IO.READ | Kratos.IO.SKIP_TIMER).ReadModelPart(part)
        net, rest = self.model["net"], self.model["rest"]
        for dof, reaction in zip(DOFS, REACTIONS):
            Kratos.VariableUtils().AddDof(dof, reaction, net)
        moved = [(b.X0 - a.X0, b.Y0 - a.Y0, b.Z0 - a.Z0) for a, b in zip(net.Nodes, rest.Nodes)]
        return net, np.array(moved)

    def numbers(self, state):
        """Gauges of an instant, but the reactions."""
        (u, v, _), dissipated, received, *_ = state
        energies = 0.5 * (self.mass * v * v).sum(), -(self.weight * u).sum(), dissipated, received
        return [*energies, *(u - self.origin)[self.watched].ravel()]

    def start(self, state, gives, gauges):
        gauges[:] = np.array([*self.reaction, *self.numbers(state)])[:, None]

    def solve(self, state, window, takes, gives, gauges):
        load, steps = takes[0][-1], window.steps(self.longest)
        h, rows, reactions = window.length / steps, [], []
        motion, dissipated, received, past, largest = state
        for step in range(1, steps + 1):
            (u, v, _), (motion, force) = motion, self.scheme.step(motion, load, h)
            dissipated += 0.25 * h * self.damping * (self.mass * (v + motion[1]) ** 2).sum()
            received += (load * (motion[0] - u)).sum()
            reactions.append(-(force * self.held).sum(0))
            time = window.start + step * h
            past = np.vstack((past, [time, *(past[-1, 1:] + h * reactions[-1])]))
            past = past[np.searchsorted(past[:, 0], time - MEAN, "right") - 1 :]
            mean = [end[-1] - np.interp(time - MEAN, past[:, 0], end) for end in past.T[1:]]
            largest = np.maximum(largest, [np.linalg.norm(reactions[-1]), np.linalg.norm(mean) / MEAN])
            state = (motion, dissipated, received, past, largest)
            rows.append([*reactions[-1], *self.numbers(state)])
        gives[0][-1], gives[1][-1] = motion[0] - self.origin, motion[1]
        gauges[:] = np.stack((rows[-1], np.min(rows, 0), np.max(rows, 0)), 1)
        gauges[:3, 0] = np.mean(reactions, 0)
        return state

    def finish(self, state):
        return {"max_reaction": (state[-1][0], "N"), "max_reaction_1ms": (state[-1][1], "N")}


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit("usage: structure.py serve SCENE --run ID --as fem ...: started by rockfall, for a scene that names it in [processes]")
    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    # Several threads add up forces in an order of their own: the bytes of a window would not be those of its repetition.
    Kratos.ParallelUtilities.SetNumThreads(1)
    with open(sys.argv[2], "rb") as file:
        rockfall.serve(Net(tomllib.load(file)))
