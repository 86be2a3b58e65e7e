#!/usr/bin/env python3
"""A square cable net, implicit dynamics: ms of CPU per Newton iteration.

All border nodes are held, no cable runs along the border; prestressed, at rest, then hit:
the middle gets a velocity across the net.

usage: cable_net.py [--nodes-per-edge 58 27] [--steps 10] [--solver sparse_lu]
"""
import argparse
import json
import time

import common

MESH, AREA, YOUNG, DENSITY, PRESTRESS = 0.3, 1e-4, 1.2e11, 7850.0, 1e8
STEP, SPEED = 1e-3, 30.0


def write_net(n):
    """Nodes row by row; cables on the inner grid lines only. Their number."""
    node = lambda i, j: j * n + i + 1
    inner = range(1, n - 1)
    cables = [(node(i, j), node(i + 1, j)) for j in inner for i in range(n - 1)]
    cables += [(node(i, j), node(i, j + 1)) for i in inner for j in range(n - 1)]
    border = [node(i, j) for j in range(n) for i in range(n) if {i, j} & {0, n - 1}]
    with open("net.mdpa", "w") as out:
        common.block(out, "Properties 1", [])
        common.block(out, "Nodes", ((node(i, j), i * MESH, j * MESH, 0.0) for j in range(n) for i in range(n)))
        common.block(out, "Elements CableElement3D2N", ((k, 1, *c) for k, c in enumerate(cables, 1)))
        common.group(out, "Net", range(1, n * n + 1), range(1, len(cables) + 1), "Elements")
        common.group(out, "Border", border, [], "Elements")
    return len(cables)


def stage_of(kratos, solver):
    common.write_json("materials.json", {"properties": [{
        "model_part_name": "Structure.Net", "properties_id": 1, "Material": {
            "constitutive_law": {"name": "TrussConstitutiveLaw"}, "Tables": {},
            "Variables": {"DENSITY": DENSITY, "YOUNG_MODULUS": YOUNG, "CROSS_AREA": AREA,
                          "TRUSS_PRESTRESS_PK2": PRESTRESS}}}]})
    settings = {
        "problem_data": {"problem_name": "net", "parallel_type": "OpenMP", "echo_level": 0,
                         "start_time": 0.0, "end_time": 1e3},
        "solver_settings": {
            "solver_type": "Dynamic", "model_part_name": "Structure", "domain_size": 3,
            "analysis_type": "non_linear", "time_integration_method": "implicit",
            "model_import_settings": {"input_type": "mdpa", "input_filename": "net"},
            "material_import_settings": {"materials_filename": "materials.json"},
            "time_stepping": {"time_step": STEP}},
        "processes": {"held": [{
            "kratos_module": "KratosMultiphysics", "python_module": "fix_vector_variable_process",
            "Parameters": {"model_part_name": "Structure.Border", "variable_name": "DISPLACEMENT"}}]}}
    if solver != "default":
        settings["solver_settings"]["linear_solver_settings"] = {"solver_type": solver}
    from KratosMultiphysics.StructuralMechanicsApplication.structural_mechanics_analysis import (
        StructuralMechanicsAnalysis)
    stage = StructuralMechanicsAnalysis(kratos.Model(), kratos.Parameters(json.dumps(settings)))
    stage.Initialize()
    return stage


def parts(kratos, solver, repeats):
    """The parts of an iteration by themselves, ms: assembly, factorisation with solve,
    the two together, and the residual that the convergence check assembles again."""
    builder, scheme, part = solver._GetBuilderAndSolver(), solver._GetScheme(), solver.GetComputingModelPart()
    strategy = solver._GetSolutionStrategy()
    matrix, change, residual = (strategy.GetSystemMatrix(), strategy.GetSolutionVector(),
                                strategy.GetSystemVector())
    zero, spaces = kratos.Vector(residual.Size(), 0.0), kratos.UblasSparseSpace()
    times = ([], [], [], [])
    for _ in range(repeats):
        spaces.SetToZeroMatrix(matrix)
        spaces.SetToZeroVector(residual)
        marks = [time.process_time()]
        builder.Build(scheme, part, matrix, residual)
        marks.append(time.process_time())
        builder.ApplyDirichletConditions(scheme, part, matrix, change, residual)
        builder.SystemSolve(matrix, change, residual)
        marks.append(time.process_time())
        spaces.SetToZeroVector(residual)
        builder.BuildRHS(scheme, part, residual)
        marks.append(time.process_time())
        for samples, begin, end in zip(times, (0, 1, 0, 2), (1, 2, 2, 3)):
            samples.append(1e3 * (marks[end] - marks[begin]))
    return times


def measure(n, steps, solver):
    kratos = common.load("LinearSolversApplication", "StructuralMechanicsApplication")
    cables = write_net(n)
    stage = stage_of(kratos, solver)
    part = stage._GetSolver().GetComputingModelPart()
    assert (part.NumberOfNodes(), part.NumberOfElements()) == (n * n, cables)
    middle = 0.5 * (n - 1) * MESH
    for node in part.Nodes:
        if max(abs(node.X - middle), abs(node.Y - middle)) < 0.15 * n * MESH:
            node.SetSolutionStepValue(kratos.VELOCITY_Z, -SPEED)
    samples, turns = [], []
    for _ in range(steps + 1):
        stage.time = stage._AdvanceTime()
        stage.InitializeSolutionStep()
        stage._GetSolver().Predict()
        begin = time.process_time()
        stage._GetSolver().SolveSolutionStep()
        turns.append(part.ProcessInfo[kratos.NL_ITERATION_NUMBER])
        samples.append(1e3 * (time.process_time() - begin) / turns[-1])
        stage.FinalizeSolutionStep()
    sag = min(node.GetSolutionStepValue(kratos.DISPLACEMENT_Z) for node in part.Nodes)
    assert -1.1 * SPEED * STEP * (steps + 1) < sag < 0.0, sag
    common.report("net of %d nodes, %s" % (n * n, solver), samples[1:], "ms/iteration",
                  "%d dofs, %d cables, %.1f iterations per step, sag %.4f m" % (
                      3 * n * n, cables, sum(turns[1:]) / steps, sag))
    for name, of in zip(("assembly", "factorisation + solve", "both", "residual"),
                        parts(kratos, stage._GetSolver(), steps)):
        common.report("  " + name, of, "ms")


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--nodes-per-edge", type=int, nargs="+", default=[58, 27])
    options.add_argument("--steps", type=int, default=10)
    options.add_argument("--solver", default="default", help="a solver_type of Kratos")
    given = options.parse_args()
    for edge in given.nodes_per_edge:
        common.alone(measure, edge, given.steps, given.solver)
