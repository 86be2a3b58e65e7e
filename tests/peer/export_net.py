#!/usr/bin/env python3
"""A structure that `rockfall export` writes, in CalculiX and in Kratos: the rest shape under dead load against ours.

The net of `launch/scenes/cable-net.toml`, level under its weight, with wires of steel. Each program opens the
exported file as it is, without another line; ours is the sag that `fem-solver check` finds. A program that is not
installed is skipped, with the reason.

usage: export_net.py [--programs target/release] [--tolerance 1e-3]
"""
import argparse
import importlib.util
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

SCENE = pathlib.Path(__file__).resolve().parents[2] / "launch/scenes/cable-net.toml"
# Steel with 10 MPa: the scene itself has no weight, and a prestress of a thousand times its modulus.
SETS = ["gravity=[0.0, 0.0, -9.81]", "structure.cable.young=1e11", "structure.cable.prestress=1e7",
        "structure.dead_load=true", "structure.form_finding=static"]

KRATOS = """
import json, os, KratosMultiphysics as kratos
from KratosMultiphysics.StructuralMechanicsApplication.structural_mechanics_analysis import StructuralMechanicsAnalysis
json.dump({"properties": []}, open("none.json", "w"))
settings = {
    "problem_data": {"problem_name": "net", "parallel_type": "OpenMP", "echo_level": 0, "start_time": 0.0, "end_time": 1.0},
    "solver_settings": {
        "solver_type": "Static", "model_part_name": "Structure", "domain_size": 3, "analysis_type": "non_linear",
        "model_import_settings": {"input_type": "mdpa", "input_filename": "net"},
        "material_import_settings": {"materials_filename": "none.json"},
        "residual_relative_tolerance": 1e-9, "residual_absolute_tolerance": 1e-9, "max_iteration": 100,
        "time_stepping": {"time_step": 1.1}},
    "processes": {}}
model = kratos.Model()
stage = StructuralMechanicsAnalysis(model, kratos.Parameters(json.dumps(settings)))
stage.Initialize()
stage.RunSolutionLoop()
nodes = model["Structure"].Nodes
json.dump([len(nodes), min(n.GetSolutionStepValue(kratos.DISPLACEMENT_Z) for n in nodes)], open("sag.json", "w"))
os._exit(0)
"""


def said(command, **how):
    done = subprocess.run(command, capture_output=True, text=True, **how)
    if done.returncode != 0:
        sys.exit("%s failed:\n%s%s" % (command[0], done.stdout[-2000:], done.stderr[-2000:]))
    return done.stdout


def calculix(folder):
    if shutil.which("ccx") is None:
        return "ccx is not installed (apt-get install calculix-ccx)"
    said(["ccx", "net"], cwd=folder)
    # Lines of the last block of displacements: ` -1`, ten characters of a node, twelve of each number.
    rows = (folder / "net.frd").read_text().split("DISP")[-1].splitlines()
    rows = [row for row in rows if row.startswith(" -1")]
    return len(rows), min(float(row[37:49]) for row in rows)


def kratos(folder):
    found = importlib.util.find_spec("KratosMultiphysics")
    places = found.submodule_search_locations if found else []
    if not any((pathlib.Path(place) / "StructuralMechanicsApplication").is_dir() for place in places):
        return "it is not installed (pip install KratosMultiphysics KratosStructuralMechanicsApplication)"
    said([sys.executable, "-c", KRATOS], cwd=folder)
    return json.loads((folder / "sag.json").read_text())


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--programs", default=SCENE.parents[2] / "target/release", type=pathlib.Path)
    options.add_argument("--tolerance", default=1e-3, type=float)
    given = options.parse_args()
    program = str(given.programs.resolve() / "fem-solver")
    scene = [str(SCENE)] + ["--set=" + one for one in SETS]
    ours = json.loads(said([program, "check", "--format=json"] + scene))["numbers"]["sag_m"]
    print("rockfall: sag %.9f m" % ours)
    far = False
    for name, file, peer in (("CalculiX", "net.inp", calculix), ("Kratos", "net.mdpa", kratos)):
        with tempfile.TemporaryDirectory(prefix="peer-") as folder:
            folder = pathlib.Path(folder)
            said([program, "export", "--to", str(folder / file)] + scene)
            answer = peer(folder)
        if isinstance(answer, str):
            print("%s: skipped, %s" % (name, answer))
            continue
        nodes, lowest = answer
        off = abs(-lowest / ours - 1.0)
        far |= not off <= given.tolerance
        print("%s: %d nodes, sag %.9f m, off by %.2e" % (name, nodes, -lowest, off))
    sys.exit("a rest shape is off by more than %g" % given.tolerance if far else 0)


if __name__ == "__main__":
    main()
