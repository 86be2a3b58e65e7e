"""What the three measurements share: input files, the time loop, CPU time."""
import importlib
import json
import os
import resource
import statistics
import sys
import tempfile
import time
import traceback

os.environ["OMP_NUM_THREADS"] = "1"  # before Kratos loads OpenMP


FIGURES = os.fdopen(os.dup(1), "w")  # Kratos talks on standard output: that goes to standard error
os.dup2(2, 1)
KEPT = []  # stages that must not be destroyed, see `alone`


def load(*applications):
    """Import Kratos and the named applications, warnings only."""
    kratos = importlib.import_module("KratosMultiphysics")
    kratos.Logger.GetDefaultOutput().SetSeverity(kratos.Logger.Severity.WARNING)
    for name in applications:
        importlib.import_module("KratosMultiphysics." + name)
    return kratos


def alone(work, *arguments):
    """Run `work` in a process and a temporary directory of its own.

    Fresh caches and memory for every figure; and Kratos 10.4.4 corrupts its heap when a
    model with a cluster is destroyed, so the process leaves without destroying it."""
    with tempfile.TemporaryDirectory(prefix="peer-") as folder:
        child = os.fork()
        if child == 0:
            status = 1
            try:
                os.chdir(folder)
                work(*arguments)
                status = 0
            except BaseException:
                traceback.print_exc()
            sys.stdout.flush()
            os._exit(status)
        if os.waitpid(child, 0)[1] != 0:
            sys.exit("%s%r failed" % (work.__name__, arguments))


def write_json(name, value):
    with open(name, "w") as out:
        json.dump(value, out, indent=1)


def block(out, kind, rows):
    """One `Begin KIND ... End KIND` block of an mdpa file; a row is any iterable."""
    out.write("Begin %s\n" % kind)
    out.writelines(" ".join(map(str, row)) + "\n" for row in rows)
    out.write("End %s\n\n" % kind.split()[0])


def group(out, name, nodes, entities, of):
    """A named part: its nodes, and the elements or conditions (`of`) it owns."""
    out.write("Begin SubModelPart %s\n" % name)
    block(out, "SubModelPartNodes", ([i] for i in nodes))
    block(out, "SubModelPart" + of, ([i] for i in entities))
    out.write("End SubModelPart\n")


def write_walls(case, points, triangles):
    """Rigid faces: point coordinates and triangles by point number from 0."""
    with open(case + "DEM_FEM_boundary.mdpa", "w") as out:
        block(out, "Properties 2", [])
        block(out, "Nodes", ((i, *p) for i, p in enumerate(points, 1)))
        block(out, "Conditions RigidFace3D3N",
              ((i, 2, *(c + 1 for c in t)) for i, t in enumerate(triangles, 1)))
        group(out, "Walls", range(1, len(points) + 1), range(1, len(triangles) + 1), "Conditions")


def dem_stage(kratos, case, part, density, young, step, **rock):
    """The DEM analysis with the defaults of the application wherever it has one."""
    contact = {
        "COEFFICIENT_OF_RESTITUTION": 0.5, "STATIC_FRICTION": 0.7, "DYNAMIC_FRICTION": 0.6,
        "FRICTION_DECAY": 500, "ROLLING_FRICTION": 0.01, "ROLLING_FRICTION_WITH_WALLS": 0.01,
        "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": "DEM_D_Hertz_viscous_Coulomb"}
    write_json("MaterialsDEM.json", {
        "materials": [
            {"material_name": "rock", "material_id": 1, "Variables": {
                "PARTICLE_DENSITY": density, "YOUNG_MODULUS": young, "POISSON_RATIO": 0.25, **rock}},
            {"material_name": "ground", "material_id": 2, "Variables": {
                "YOUNG_MODULUS": young, "POISSON_RATIO": 0.25, "COMPUTE_WEAR": False}}],
        "material_relations": [
            {"material_names_list": ["rock", other], "material_ids_list": [1, i], "Variables": contact}
            for i, other in ((1, "rock"), (2, "ground"))],
        "material_assignation_table": [[part, "rock"], ["RigidFacePart", "ground"]]})
    from KratosMultiphysics.DEMApplication.DEM_analysis_stage import DEMAnalysisStage
    stage = DEMAnalysisStage(kratos.Model(), kratos.Parameters(json.dumps({
        "problem_name": case, "do_print_results_option": False, "dem_inlet_option": False,
        "MaxTimeStep": step, "FinalTime": 1e3,
        "solver_settings": {"strategy": "sphere_strategy", "material_import_settings": {
            "materials_filename": "MaterialsDEM.json"}}})))
    KEPT.append(stage)
    stage.Initialize()
    return stage


def advance(stage, steps):
    """`steps` turns of the loop a user's run makes; CPU seconds of the mean and of the median step.

    One step in fifty searches neighbours: the mean carries it, the median does not."""
    marks = [time.process_time()]
    for _ in range(steps):
        stage.time = stage._AdvanceTime()
        stage.InitializeSolutionStep()
        stage.SolveSolutionStep()
        stage.FinalizeSolutionStep()
        stage.OutputSolutionStep()
        marks.append(time.process_time())
    each = [end - begin for begin, end in zip(marks, marks[1:])]
    return statistics.mean(each), statistics.median(each)


def report(name, samples, unit, note=""):
    """One line: median, extremes, number of samples, peak memory of the process so far."""
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print("%-34s %9.3f %-18s (%.3f to %.3f, %d samples, peak %.0f MB%s)" % (
        name, statistics.median(samples), unit, min(samples), max(samples), len(samples), memory,
        ", " + note if note else ""), file=FIGURES, flush=True)
