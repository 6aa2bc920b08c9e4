"""Kratos alone: two blocks, h wide, pressed together by 0.1. Is pressure = penalty × gap? `python shown.py` prints the ratio."""

import json
import os
import sys
import tempfile

import KratosMultiphysics as KM
import KratosMultiphysics.ContactStructuralMechanicsApplication
from KratosMultiphysics.StructuralMechanicsApplication.structural_mechanics_analysis import StructuralMechanicsAnalysis


def solve(h, penalty, kind):
    corners = [(0, 0), (h, 0), (h, 1), (0, 1), (0, -1), (h, -1), (h, 0), (0, 0)]
    nodes = "\n".join(f"{n} {x} {y} 0" for n, (x, y) in enumerate(corners, 1))
    with open("scene.mdpa", "w") as file:
        file.write(
            f"Begin Properties 0\nEnd Properties\nBegin Nodes\n{nodes}\nEnd Nodes\nBegin Elements SmallDisplacementElement2D4N\n1 0 1 2 3 4\n2 0 5 6 7 8\nEnd Elements\nBegin Conditions LineCondition2D2N\n1 0 1 2\n2 0 7 8\nEnd Conditions\nBegin SubModelPart Solid\nBegin SubModelPartNodes\n1\n2\n3\n4\n5\n6\n7\n8\nEnd SubModelPartNodes\nBegin SubModelPartElements\n1\n2\nEnd SubModelPartElements\nEnd SubModelPart\nBegin SubModelPart Touching\nBegin SubModelPartNodes\n1\n2\n7\n8\nEnd SubModelPartNodes\nBegin SubModelPartConditions\n1\n2\nEnd SubModelPartConditions\nEnd SubModelPart\nBegin SubModelPart Slave\nBegin SubModelPartNodes\n1\n2\nEnd SubModelPartNodes\nBegin SubModelPartConditions\n1\nEnd SubModelPartConditions\nEnd SubModelPart\n"
        )
    law = {
        "constitutive_law": {"name": "LinearElasticPlaneStrain2DLaw"},
        "Variables": {"YOUNG_MODULUS": 1.0, "POISSON_RATIO": 0.0},
        "Tables": {},
    }
    json.dump(
        {"properties": [{"model_part_name": "Structure.Solid", "properties_id": 1, "Material": law}]},
        open("materials.json", "w"),
    )
    contact = {
        "model_part_name": "Structure",
        "contact_model_part": {"0": ["Touching"]},
        "assume_master_slave": {"0": ["Slave"]},
        "contact_type": "Frictionless",
    }
    contact |= {"advance_ALM_parameters": {"manual_ALM": True, "penalty": penalty}} if kind == "Penalty" else {}
    process = {
        "python_module": f"{kind.lower()}_contact_process",
        "kratos_module": "KratosMultiphysics.ContactStructuralMechanicsApplication",
        "process_name": f"{kind}ContactProcess",
        "Parameters": contact,
    }
    solver = {
        "model_part_name": "Structure",
        "domain_size": 2,
        "echo_level": 0,
        "analysis_type": "non_linear",
        "solver_type": "Static",
        "time_stepping": {"time_step": 1.1},
        "model_import_settings": {"input_type": "mdpa", "input_filename": "scene"},
        "material_import_settings": {"materials_filename": "materials.json"},
        "contact_settings": {"mortar_type": f"{kind}ContactFrictionless"},
        "convergence_criterion": "contact_residual_criterion",
        "residual_relative_tolerance": 1e-10,
        "residual_absolute_tolerance": 1e-14,
    }
    problem = {"problem_name": "scene", "start_time": 0.0, "end_time": 1.0, "parallel_type": "OpenMP", "echo_level": 0}
    job = StructuralMechanicsAnalysis(
        model := KM.Model(),
        KM.Parameters(
            json.dumps(
                {"problem_data": problem, "solver_settings": solver, "processes": {"contact_process_list": [process]}}
            )
        ),
    )
    job.Initialize()
    for node in model["Structure"].Nodes:
        node.Fix(KM.DISPLACEMENT_X)
        if node.Y0 == 1 or node.Y0 == -1:
            node.Fix(KM.DISPLACEMENT_Y)
            node.SetSolutionStepValue(KM.DISPLACEMENT_Y, -0.1 if node.Y0 == 1 else 0.0)
    job.RunSolutionLoop()
    y = {node.Id: node.GetSolutionStepValue(KM.DISPLACEMENT_Y) for node in model["Structure"].Nodes}
    return y[1] - y[4], y[8] - y[1]  # The strain of the upper block is the pressure, since E is 1; the penetration.


os.chdir(tempfile.mkdtemp())
KM.Logger.GetDefaultOutput().SetSeverity(KM.Logger.Severity.WARNING)
for h in (0.5, 1.0, 2.0, 4.0):
    pressure, gap = solve(h, 10.0, sys.argv[1] if len(sys.argv) > 1 else "Penalty")
    print(
        f"h = {h}: pressure {pressure:.6f}, gap {gap:.6f}, pressure/(penalty gap) {pressure / gap / 10 if abs(gap) > 1e-12 else float('nan'):.4f}"
    )
