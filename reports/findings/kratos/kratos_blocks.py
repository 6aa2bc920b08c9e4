"""Two blocks in Kratos alone, one on the other, of height 1 and E = 1, pressed together by 0.1."""

import json
import os
import tempfile

import KratosMultiphysics as Kratos
import KratosMultiphysics.ContactStructuralMechanicsApplication
from KratosMultiphysics.StructuralMechanicsApplication.structural_mechanics_analysis import StructuralMechanicsAnalysis

PACKAGE = "KratosMultiphysics.ContactStructuralMechanicsApplication"


def block(kind, rows, first=1):
    """Return the lines of a block of the model."""
    lines = [f"{n} {row}" if first else str(row) for n, row in enumerate(rows, first or 1)]
    return "\n".join([f"Begin {kind}", *lines, f"End {kind.split()[0]}"])


def part(name, nodes, **others):
    """Return the lines of a part of the model."""
    kinds = {"Nodes": nodes, **others}
    return "\n".join(
        [f"Begin SubModelPart {name}", *(block(f"SubModelPart{k}", v, 0) for k, v in kinds.items()), "End SubModelPart"]
    )


def press(upper, lower, settings, kind="ALM", unit=1.0, overlap=0.0, pushed=0.1, young=1.0, tolerances=()):
    """Return the pressure of each upper element, and the mean gap, of blocks with columns between these places x.

    All lengths are multiplied by the unit. Blocks that overlap do so at the start, before the upper one is pushed.
    Tolerances are the relative and the absolute one of the residual, 1e-4 and 1e-9 unless they are given.
    """
    os.chdir(tempfile.mkdtemp())
    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    n, m = len(upper), len(lower)
    rows = [(upper, -overlap), (upper, 1 - overlap), (lower, -1), (lower, 0)]
    nodes = [f"{unit * x!r} {unit * y!r} 0" for xs, y in rows for x in xs]
    quads = [f"0 {a} {a + 1} {a + 1 + n} {a + n}" for a in range(1, n)]
    quads += [f"0 {a} {a + 1} {a + 1 + m} {a + m}" for a in range(2 * n + 1, 2 * n + m)]
    slave = [f"0 {a} {a + 1}" for a in range(1, n)]
    top = 2 * n + m
    master = [f"0 {a + 1} {a}" for a in range(top + m - 1, top, -1)]
    touching = [*range(1, n + 1), *range(top + 1, top + m + 1)]
    text = ["Begin Properties 0\nEnd Properties", block("Nodes", nodes)]
    text += [
        block("Elements SmallDisplacementElement2D4N", quads),
        block("Conditions LineCondition2D2N", slave + master),
    ]
    text.append(part("Solid", range(1, len(nodes) + 1), Elements=range(1, len(quads) + 1)))
    text.append(part("Touching", touching, Conditions=range(1, n + m - 1)))
    text.append(part("Slave", range(1, n + 1), Conditions=range(1, n)))
    with open("blocks.mdpa", "w") as file:
        file.write("\n".join(text) + "\n")
    law = {"name": "LinearElasticPlaneStrain2DLaw"}
    material = {"constitutive_law": law, "Variables": {"YOUNG_MODULUS": young, "POISSON_RATIO": 0.0}, "Tables": {}}
    with open("materials.json", "w") as file:
        json.dump({"properties": [{"model_part_name": "B.Solid", "properties_id": 1, "Material": material}]}, file)
    contact = {
        "model_part_name": "B",
        "contact_model_part": {"0": ["Touching"]},
        "assume_master_slave": {"0": ["Slave"]},
    }
    names = {"python_module": f"{kind.lower()}_contact_process", "process_name": f"{kind}ContactProcess"}
    process = {**names, "kratos_module": PACKAGE, "Parameters": {**contact, "contact_type": "Frictionless", **settings}}
    solver = {
        "model_part_name": "B",
        "domain_size": 2,
        "echo_level": 0,
        "analysis_type": "non_linear",
        "solver_type": "Static",
        "time_stepping": {"time_step": 1.1},
        "model_import_settings": {"input_type": "mdpa", "input_filename": "blocks"},
        "material_import_settings": {"materials_filename": "materials.json"},
        "contact_settings": {"mortar_type": f"{kind}ContactFrictionless"},
        "convergence_criterion": "contact_residual_criterion",
    }
    for word, tolerance in zip(("relative", "absolute"), tolerances, strict=False):
        solver[f"residual_{word}_tolerance"] = tolerance
        solver["contact_settings"][f"contact_residual_{word}_tolerance"] = tolerance
    problem = {"problem_name": "B", "start_time": 0.0, "end_time": 1.0, "parallel_type": "OpenMP", "echo_level": 0}
    whole = {"problem_data": problem, "solver_settings": solver, "processes": {"contact_process_list": [process]}}
    model = Kratos.Model()
    job = StructuralMechanicsAnalysis(model, Kratos.Parameters(json.dumps(whole)))
    job.Initialize()
    for node in model["B"].Nodes:
        if node.X0 in (unit * upper[0], unit * upper[-1]):  # Rollers at the sides
            node.Fix(Kratos.DISPLACEMENT_X)
        if node.Y0 in (unit * (1 - overlap), -unit):
            node.Fix(Kratos.DISPLACEMENT_Y)
            node.SetSolutionStepValue(Kratos.DISPLACEMENT_Y, -pushed * unit if node.Y0 > 0 else 0.0)
    solver = job._GetSolver()
    solver.AdvanceInTime(0.0)
    job.InitializeSolutionStep()
    solver.Predict()
    converged = solver.SolveSolutionStep()
    y = [
        node.GetSolutionStepValue(Kratos.DISPLACEMENT_Y) / unit
        for node in sorted(model["B"].Nodes, key=lambda node: node.Id)
    ]
    pressures = [(y[a] + y[a + 1] - y[n + a] - y[n + a + 1]) / 2 for a in range(n - 1)]
    gap = sum(y[:n]) / n - sum(y[top : top + m]) / m - overlap
    return bool(converged), pressures, gap
