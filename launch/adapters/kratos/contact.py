#!/usr/bin/env python3
"""Kratos' DEMApplication as the contact solver of a run: spheres, and boxes as clusters of spheres, on the lines and faces of a net.

The net is a part of rigid walls whose nodes are put, before every step, where the structure's motion has them; Kratos says what force
it has on each. Contacts and their history stay in Kratos, which cannot go back to the start of a window: weak coupling alone.
"""
import itertools
import json
import math
import os
import subprocess
import sys
import tempfile

import KratosMultiphysics as Kratos
import KratosMultiphysics.DEMApplication as Dem
import numpy as np
import rockfall
from KratosMultiphysics.DEMApplication.DEM_analysis_stage import DEMAnalysisStage
from rockfall.runs import program

RIGID = 1e20  # Young's modulus of walls: what gives way is the rock alone [Pa]
COLUMNS = [(w + c, unit) for w, unit in (("", "m"), ("v", "m/s"), ("w", "rad/s")) for c in "xyz"]
SETTINGS = {
    "problem_name": "net", "do_print_results_option": False, "dem_inlet_option": False, "NeighbourSearchFrequency": 1,
    "TranslationalIntegrationScheme": "Symplectic_Euler", "RotationalIntegrationScheme": "Direct_Integration",
    "solver_settings": {"strategy": "sphere_strategy", "RemoveBallsInitiallyTouchingWalls": False,
                        "material_import_settings": {"materials_filename": "MaterialsDEM.json"}}}


def refuse(key, what):
    raise rockfall.Fault("%s: %s" % (key, what), "input")


def block(kind, rows):
    """A block of an .mdpa file."""
    return "Begin %s\n%sEnd %s\n" % (kind, "".join(" ".join(map(str, row)) + "\n" for row in rows), kind.split()[0])


def part(name, nodes, of, owned):
    inner = block("SubModelPartNodes", ([i] for i in nodes)) + block("SubModelPart" + of, ([i] for i in owned))
    return "Begin SubModelPart %s\n%sEnd SubModelPart\n" % (name, inner)


def write(file, text):
    with open(file, "w") as out:
        out.write(text)


def write_walls(mesh):
    n, lines, faces = len(mesh.coordinates), mesh.lines.tolist(), mesh.faces.tolist()
    text = block("Properties 0", []) + block("Nodes", ((i, *at) for i, at in enumerate(mesh.coordinates.tolist(), 1)))
    for kind, items, first in (("2N", lines, 1), ("3N", faces, len(lines) + 1)):
        if items:
            text += block("Conditions RigidFace3D" + kind, ((i, 0, *(k + 1 for k in item)) for i, item in enumerate(items, first)))
    write("netDEM_FEM_boundary.mdpa", text + part("Walls", range(1, n + 1), "Conditions", range(1, len(lines) + len(faces) + 1)))


def write_rocks(file, element, rocks, data):
    """Each a part `rock_N` by its number in the scene, of the material N; `data` of their nodes by name."""
    text = "".join(block("Properties %d" % material, []) for material, _ in rocks)
    if rocks:
        text += block("Nodes", ((i, *rock["position"]) for i, (_, rock) in enumerate(rocks, 1)))
        text += block("Elements " + element, ((i, material, i) for i, (material, _) in enumerate(rocks, 1)))
    for name, values in data.items():
        text += block("NodalData " + name, ((i, 0, value) for i, value in enumerate(values, 1)))
    write(file, text + "".join(part("rock_%d" % number, [i], "Elements", [i]) for i, (number, _) in enumerate(rocks, 1)))


def volume(rock):
    """[m3]"""
    shape = rock["shape"]
    return 4.0 / 3.0 * math.pi * shape["radius"] ** 3 if shape["type"] == "sphere" else math.prod(shape["size"])


def write_cluster(file, rock):
    """The spheres that rockfall fills a box with."""
    size, count = rock["shape"]["size"], rock["cluster"]["spheres"]
    words = [program(), "cluster", "box:%r,%r,%r" % tuple(size), "--spheres", str(count), "--method", "lattice", "-o", "spheres.txt"]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        raise rockfall.Fault("rockfall cluster: " + done.stderr.strip(), "input")
    rows = np.loadtxt("spheres.txt", ndmin=2)
    square = np.square(size)
    inertia = (square.sum() - square) / 12.0
    text = "Name\nbox\n" + block("centers_and_radii", rows.tolist())
    text += "Particle_center_and_diameter\n0 0 0 %r\nSize\n%r\nVolume\n%r\n" % (max(size), max(size), volume(rock))
    write(file, text + "Inertia per unit mass\n%r\n%r\n%r\n" % tuple(inertia.tolist()))


def write_materials(contacts, rocks):
    if len(contacts) != 1 or contacts[0].get("law") != "hertz_mindlin" or "young" not in contacts[0]:
        refuse("contact", "Kratos' wrapper has one contact, of the law hertz_mindlin with its numbers")
    law, wall = contacts[0], len(rocks) + 1
    materials = []
    for i, rock in rocks:
        density = rock.get("density") or rock["mass"] / volume(rock)
        of = {"PARTICLE_DENSITY": density, "YOUNG_MODULUS": law["young"], "POISSON_RATIO": law["poisson"]}
        if "cluster" in rock:
            write_cluster("rock_%d.clu" % i, rock)
            of.update(CLUSTER_FILE_NAME="rock_%d.clu" % i, BREAKABLE_CLUSTER=False)
        materials.append(of)
    materials.append({"YOUNG_MODULUS": RIGID, "POISSON_RATIO": 0.25, "COMPUTE_WEAR": False})
    friction = law.get("friction", 0.0)
    pair = {"COEFFICIENT_OF_RESTITUTION": law.get("restitution", 1.0), "STATIC_FRICTION": friction, "DYNAMIC_FRICTION": friction,
            "FRICTION_DECAY": 500, "ROLLING_FRICTION": 0.0, "ROLLING_FRICTION_WITH_WALLS": 0.0,
            "DEM_ROLLING_FRICTION_MODEL_NAME": "DEMRollingFrictionModelConstantTorque",
            "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": "DEM_D_Hertz_viscous_Coulomb"}
    pairs = [ends for ends in itertools.combinations_with_replacement(range(1, wall + 1), 2) if ends[0] < wall]
    places = [("ClusterPart" if "cluster" in rock else "SpheresPart") + ".rock_%d" % i for i, rock in rocks] + ["RigidFacePart"]
    write("MaterialsDEM.json", json.dumps({
        "materials": [{"material_name": "m%d" % i, "material_id": i, "Variables": of} for i, of in enumerate(materials, 1)],
        "material_relations": [{"material_names_list": ["m%d" % i for i in ends], "material_ids_list": ends, "Variables": pair}
                               for ends in pairs],
        "material_assignation_table": [[place, "m%d" % i] for i, place in enumerate(places, 1)]}))


class Rocks(rockfall.Contact):
    program = "Kratos DEM " + Kratos.Kernel.Version().split("-")[0].replace('"', "")
    gives = [rockfall.Field("force", "means")]
    repeats = None
    goes_on = False

    def prepare(self, plan):
        if plan.partner is None:
            refuse("structure", "there is none, and Kratos' rocks have nothing to fall on")
        scene, mesh = plan.scene, plan.partner
        rocks, gravity = list(enumerate(scene["rock"], 1)), scene["gravity"]
        self.longest = scene.get("dem", {}).get("time_step") or refuse("dem.time_step", "Kratos needs one")
        print("Kratos' DEM cannot repeat a window: it is coupled weakly", flush=True)
        if np.any(mesh.line_radius):
            print("wires are lines for Kratos: their radius of %g m is left out" % np.max(mesh.line_radius), flush=True)
        for i, rock in rocks:
            if (rock.get("shape", {}).get("type"), "cluster" in rock) not in (("sphere", False), ("box", True)):
                refuse("rock.%d" % (i - 1), "neither a sphere nor a box with cluster.spheres: Kratos' wrapper has these alone")
        spheres, boxes = ([one for one in rocks if ("cluster" in one[1]) is such] for such in (False, True))
        self.folder = tempfile.TemporaryDirectory()
        os.chdir(self.folder.name)  # Kratos reads and writes where it stands
        write_walls(mesh)
        write_rocks("netDEM.mdpa", "SphericParticle3D", spheres, {"RADIUS": [rock["shape"]["radius"] for _, rock in spheres]} if spheres else {})
        turns = [rock.get("orientation", [1, 0, 0, 0]) for _, rock in boxes]
        turns = ["[4] (%r, %r, %r, %r)" % (x, y, z, w) for w, x, y, z in turns]
        sizes = [max(rock["shape"]["size"]) for _, rock in boxes]
        if boxes:
            write_rocks("netDEM_Clusters.mdpa", "Cluster3D", boxes, {"CHARACTERISTIC_LENGTH": sizes, "ORIENTATION": turns})
        write_materials(scene.get("contact", []), rocks)
        settings = {**SETTINGS, **dict(zip(("GravityX", "GravityY", "GravityZ"), gravity)), "MaxTimeStep": self.longest, "FinalTime": plan.end_time}
        self.stage = DEMAnalysisStage(Kratos.Model(), Kratos.Parameters(json.dumps(settings)))
        self.stage.Initialize()
        if "damping_ratio" in scene["contact"][0]:
            for one in (one for properties in self.stage.spheres_model_part.Properties for one in properties.GetSubProperties()):
                one[Dem.DAMPING_GAMMA] = scene["contact"][0]["damping_ratio"]

        # Kratos adds a node of its own to a part of walls, and the spheres of clusters, behind all others.
        self.walls, self.count = self.stage.rigid_face_model_part.Nodes, len(mesh.coordinates)
        variables = Kratos.DISPLACEMENT, Kratos.VELOCITY, Dem.CONTACT_FORCES
        columns = Kratos.TensorAdaptors.HistoricalVariableTensorAdaptor
        self.wall_u, self.wall_v, self.wall_force = (columns(self.walls, variable) for variable in variables)
        self.mover, self.h = Dem.MoveMeshUtility(), 0.0
        nodes = dict(zip((i for i, _ in spheres), self.stage.spheres_model_part.Nodes))
        nodes.update(zip((i for i, _ in boxes), self.stage.cluster_model_part.Nodes))
        self.nodes = [nodes[i] for i, _ in rocks]
        for node, (_, rock) in zip(self.nodes, rocks):
            node.SetSolutionStepValue(Kratos.VELOCITY, Kratos.Array3(rock.get("velocity", [0, 0, 0])))
            node.SetSolutionStepValue(Kratos.ANGULAR_VELOCITY, Kratos.Array3(rock.get("angular_velocity", [0, 0, 0])))
        names = [rock.get("name", "rock_%d" % i) for i, rock in rocks]
        gauges = [rockfall.Gauge("%s_%s" % (name, c), unit, extremes=False) for name in names for c, unit in COLUMNS]
        return rockfall.Ready(state=None, gauges=gauges)

    def numbers(self):
        """Gauges now: Kratos has each place half a step ahead."""
        found = []
        for node in self.nodes:
            v, w = (np.array(node.GetSolutionStepValue(of)) for of in (Kratos.VELOCITY, Kratos.ANGULAR_VELOCITY))
            found += [*(np.array((node.X, node.Y, node.Z)) - 0.5 * self.h * v), *v, *w]
        return found

    def step_of(self, h):
        """Steps are `h` long from now on [s]."""
        ahead, self.h = 0.5 * (h - self.h), h
        for node in itertools.chain(self.stage.spheres_model_part.Nodes, self.stage.cluster_model_part.Nodes):
            x, y, z = (ahead * c for c in node.GetSolutionStepValue(Kratos.VELOCITY))
            node.X0, node.Y0, node.Z0 = node.X0 + x, node.Y0 + y, node.Z0 + z
            node.X, node.Y, node.Z = node.X + x, node.Y + y, node.Z + z

    def start(self, state, gives, gauges):
        gauges[:] = np.array(self.numbers())[:, None]

    def solve(self, state, window, takes, gives, gauges):
        from_, to = takes[0]
        steps = window.steps(self.longest)
        h, rows, solver = window.length / steps, [], self.stage._GetSolver()
        # From window to window lengths of steps differ by rounding.
        if abs(h - self.h) > 1e-9 * h:
            self.step_of(h)
        solver.SetDt(h)
        self.wall_v.data[: self.count] = (to - from_) / window.length
        self.wall_v.StoreData()
        gives[0][-1] = 0.0
        for step in range(steps):
            # Kratos' step takes the force where things are, then velocity and place. All are half a step ahead, in the step's middle: the
            # force of a step is that of its own time, and not late by half of it, which would make energy.
            self.wall_u.data[: self.count] = from_ + (step + 0.5) / steps * (to - from_)
            self.wall_u.StoreData()
            self.mover.MoveDemMesh(self.walls, True)
            self.stage.time = solver.AdvanceInTime(window.start + step * h)
            self.stage.InitializeSolutionStep()
            solver.SolveSolutionStep()
            self.stage.FinalizeSolutionStep()
            self.wall_force.CollectData()
            gives[0][-1] += self.wall_force.data[: self.count] / steps
            rows.append(self.numbers())
        gauges[:] = np.stack((rows[-1], np.min(rows, 0), np.max(rows, 0)), 1)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit("usage: contact.py serve SCENE --run ID --as dem ...: started by rockfall, for a scene that names it in [processes]")
    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    Kratos.ParallelUtilities.SetNumThreads(1)
    try:
        rockfall.serve(Rocks())
    except SystemExit as end:
        # Kratos 10.4.4 may destroy its heap together with a model that has a cluster: leave without that.
        sys.stdout.flush()
        os._exit(end.code or 0)
