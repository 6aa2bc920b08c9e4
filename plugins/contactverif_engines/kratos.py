"""Kratos Multiphysics: mortar contact without friction, by an augmented Lagrangian or by penalty springs.

Source: the application ContactStructuralMechanicsApplication of Kratos 10.4, `alm_contact_process.py` and
`penalty_contact_process.py`, with their default settings.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from contactverif.contract.engine import EngineAnswer, EngineTraits, SceneArrays
from contactverif_engines.filled import FilledScene, fill_rigid_bodies

# Kratos compares the sum of the squares of residuals with the first one, and their mean square with a number: the
# defaults of 1e-4 and, in whatever unit, 1e-9 leave a hundredth of the first residual, or 3e-5.
_RESIDUAL = 1e-10  # The share of the first residual that may be left.
_ROUNDOFF = 1e-13  # The share of loads or reactions that may be left.
_GAP_ROUNDOFF = 1e-15  # The share of E times the largest coordinate, as gaps are differences of places.
_ITERATIONS = 60
_NORMALS = {"fixed": "no_derivatives_computation", "updated": "no_derivatives_computation_with_normal_update"}
_LAWS = {2: "LinearElasticPlaneStrain2DLaw", 3: "LinearElastic3DLaw"}
_CONDITIONS = {2: "LineCondition2D", 3: "SurfaceCondition3D"}
_SEARCHES = {"boxes": "in_radius_with_obb", "radius": "in_radius"}
_PROCESSES = {
    "multiplier": ("alm_contact_process", "ALMContactProcess", "ALMContactFrictionless"),
    "penalty": ("penalty_contact_process", "PenaltyContactProcess", "PenaltyContactFrictionless"),
}


@dataclass(frozen=True)
class Kratos:
    """Kratos with one of its kinds of mortar contact."""

    # The augmented Lagrangian method with dual multipliers, or penalty springs of the stiffness that Kratos chooses.
    kind: Literal["multiplier", "penalty"] = "multiplier"
    # Pairs of edges whose boxes meet, as Kratos chooses by itself, or all within the radius.
    search: Literal["boxes", "radius"] = "boxes"
    search_factor: float = 3.5  # The radius in which pairs are searched, over the size of a condition.
    # Those of the start of a step, as Kratos chooses by itself, or of each iterate.
    normals: Literal["fixed", "updated"] = "fixed"
    augmentation: float = 1.0  # The penalty of the augmented Lagrangian method over E/h.
    dim: int = 2  # 3 takes scenes in space.

    @property
    def traits(self) -> EngineTraits:
        """The statements. The penalty of Kratos is no stiffness of an area (`reports/findings`), so it is its own."""
        own = self.kind == "penalty"
        return EngineTraits(
            "own" if own else "multiplier",
            accuracy=1e-8 if self.dim == 2 else 1e-6,
            load_scale=2.0**-10 if self.dim == 2 else 2.0**-16,
            passes_flat_patch=None if own else True,
            dimensions=(self.dim,),
        )

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Write a model, solve it in a static step, and read the displacements of its nodes."""
        plane = fill_rigid_bodies(scene)
        with tempfile.TemporaryDirectory() as folder, _working_in(folder):
            import KratosMultiphysics as Kratos
            from KratosMultiphysics import ContactStructuralMechanicsApplication as Contact
            from KratosMultiphysics import StructuralMechanicsApplication as Structural
            from KratosMultiphysics.StructuralMechanicsApplication.structural_mechanics_analysis import (
                StructuralMechanicsAnalysis,
            )

            Path("scene.mdpa").write_text("\n".join(write_model(plane)) + "\n")
            Path("materials.json").write_text(json.dumps(_materials(plane)))
            Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
            model = Kratos.Model()
            job = StructuralMechanicsAnalysis(model, Kratos.Parameters(json.dumps(self._settings(scene))))
            job.Initialize()
            part = model["Structure"]
            for node in part.Nodes:
                index = node.Id - 1
                for axis, name in enumerate("XYZ"[: self.dim]):
                    variable = getattr(Kratos, f"DISPLACEMENT_{name}")
                    if plane.fixed[index, axis]:
                        node.Fix(variable)
                        node.SetSolutionStepValue(variable, float(plane.imposed[index, axis]))
                node.SetSolutionStepValue(Structural.POINT_LOAD, Kratos.Array3([*plane.load[index].tolist(), 0.0][:3]))
            solver = job._GetSolver()
            job.time = solver.AdvanceInTime(job.time)
            job.InitializeSolutionStep()
            solver.Predict()
            try:
                converged = bool(solver.SolveSolutionStep())
            except RuntimeError as error:  # Its solver of linear systems ends so where nothing holds a body.
                return EngineAnswer(np.zeros_like(scene.nodes), False, message=str(error).strip().splitlines()[0])
            nodes = sorted(part.Nodes, key=lambda node: node.Id)[: len(scene.nodes)]
            moves = np.array([list(node.GetSolutionStepValue(Kratos.DISPLACEMENT))[: self.dim] for node in nodes])
            pressures = None
            if self.kind == "multiplier":  # Multipliers have a unit of their own, and press where they are negative.
                name, unit = Contact.LAGRANGE_MULTIPLIER_CONTACT_PRESSURE, float(part.ProcessInfo[Kratos.SCALE_FACTOR])
                slave = np.unique(scene.slave[scene.slave >= 0]).tolist()
                pressures = np.array([-unit * nodes[number].GetSolutionStepValue(name) for number in slave])
            iterations = int(part.ProcessInfo[Kratos.NL_ITERATION_NUMBER])
        message = "" if converged else "no convergence in one step"
        return EngineAnswer(moves, converged, iterations, message, pressures=pressures)

    def _settings(self, scene: SceneArrays) -> dict[str, Any]:
        module, name, mortar = _PROCESSES[self.kind]
        contact: dict[str, Any] = {
            "model_part_name": "Structure",
            "contact_model_part": {"0": ["Touching"]},
            "assume_master_slave": {"0": ["Slave"]},
            "contact_type": "Frictionless",
            "normal_variation": _NORMALS[self.normals],
            "search_parameters": {"type_search": _SEARCHES[self.search], "search_factor": self.search_factor},
            "advance_ALM_parameters": {"stiffness_factor": self.augmentation},
        }
        if self.kind == "multiplier":  # The unit of the multipliers stays that of the default.
            contact["advance_ALM_parameters"]["penalty_scale_factor"] = 1 / self.augmentation
        return {
            "problem_data": {
                "problem_name": "scene", "start_time": 0.0, "end_time": 1.0, "parallel_type": "OpenMP", "echo_level": 0
            },
            "solver_settings": {
                "model_part_name": "Structure",
                "domain_size": self.dim,
                "echo_level": 0,
                "analysis_type": "non_linear",
                "solver_type": "Static",
                "time_stepping": {"time_step": 1.1},
                "model_import_settings": {"input_type": "mdpa", "input_filename": "scene"},
                "material_import_settings": {"materials_filename": "materials.json"},
                "contact_settings": {
                    "mortar_type": mortar,
                    "fancy_convergence_criterion": False,
                    "contact_residual_relative_tolerance": _RESIDUAL**2,
                    "contact_residual_absolute_tolerance": _roundoff(scene, self.kind) ** 2,
                },
                "convergence_criterion": "contact_residual_criterion",
                "residual_relative_tolerance": _RESIDUAL**2,
                "residual_absolute_tolerance": _roundoff(scene, self.kind) ** 2,
                "max_iteration": _ITERATIONS,
                "linear_solver_settings": {"solver_type": "LinearSolversApplication.sparse_lu"},
            },
            "processes": {
                "contact_process_list": [
                    {
                        "python_module": module,
                        "kratos_module": "KratosMultiphysics.ContactStructuralMechanicsApplication",
                        "process_name": name,
                        "Parameters": contact,
                    }
                ]
            },
        }  # fmt: skip


def _roundoff(scene: SceneArrays, kind: str) -> float:
    """Return the force that may be left as roundoff; the penalty of springs is 10⁴ E/h."""
    space = scene.nodes.shape[1] == 3
    across = scene.unit if space else 1.0  # In the plane forces are those of a unit of thickness.
    place = float(scene.young[~scene.rigid].max()) * float(np.abs(scene.nodes).max()) * across
    moved = float(np.abs(scene.imposed).max(initial=0.0)) * float(scene.young.max()) * across
    force = max(float(np.abs(scene.load).sum()), moved)  # The size of loads or reactions, whichever is larger.
    return _ROUNDOFF * force + _GAP_ROUNDOFF * place * (1e4 if kind == "penalty" else 1e2 if space else 1.0)


@contextmanager
def _working_in(folder: str) -> Iterator[None]:
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def write_model(plane: FilledScene) -> list[str]:
    """Return the lines of a model of Kratos: nodes, elements, edges, loads, and its parts."""
    scene, dim = plane.scene, plane.nodes.shape[1]
    lines = ["Begin ModelPartData", "End ModelPartData", "Begin Properties 0", "End Properties"]
    places = np.pad(plane.nodes, ((0, 0), (0, 3 - dim))).tolist()
    lines += ["Begin Nodes", *(f"{n} {x!r} {y!r} {z!r}" for n, (x, y, z) in enumerate(places, 1)), "End Nodes"]
    elements, parts = _elements(plane)
    edges = [edge[edge >= 0] + 1 for edge in (*scene.slave, *scene.master)]
    lines += elements
    for n_corners in sorted(set(map(len, edges))):
        rows = [f"{n} 0 {_words(edge)}" for n, edge in enumerate(edges, 1) if len(edge) == n_corners]
        lines += [f"Begin Conditions {_CONDITIONS[dim]}{n_corners}N", *rows, "End Conditions"]
    loaded = (np.flatnonzero(scene.load.any(axis=1)) + 1).tolist()
    points = range(len(edges) + 1, len(edges) + len(loaded) + 1)
    if loaded:
        rows = [f"{n} 0 {node}" for n, node in zip(points, loaded, strict=True)]
        lines += [f"Begin Conditions PointLoadCondition{dim}D1N", *rows, "End Conditions"]
        parts += _part("Loaded", loaded, (), points)
    slave, touching = (np.unique(np.concatenate(part)).tolist() for part in (edges[: len(scene.slave)], edges))
    parts += _part("Touching", touching, (), range(1, len(edges) + 1))
    return lines + parts + _part("Slave", slave, (), range(1, len(scene.slave) + 1))


def _elements(plane: FilledScene) -> tuple[list[str], list[str]]:
    lines, parts, first, dim = list[str](), list[str](), 1, plane.nodes.shape[1]
    for body in range(len(plane.scene.axes)):
        begin, corners = first, list[Any]()
        for cells, bodies in plane.cells:
            of_body = cells[bodies == body]
            rows = [f"{n} 0 {_words(cell + 1)}" for n, cell in enumerate(of_body, first)]
            begin_of_kind = f"Begin Elements SmallDisplacementElement{dim}D{cells.shape[1]}N"
            lines += [begin_of_kind, *rows, "End Elements"] if rows else []
            corners.append(of_body.reshape(-1))
            first += len(of_body)
        parts += _part(f"Body{body}", (np.unique(np.concatenate(corners)) + 1).tolist(), range(begin, first), ())
    return lines, parts


def _words(numbers: Any) -> str:
    return " ".join(map(str, numbers.tolist()))


def _part(name: str, nodes: Sequence[int], elements: Sequence[int], conditions: Sequence[int]) -> list[str]:
    lines = [f"Begin SubModelPart {name}"]
    for kind, numbers in (("Nodes", nodes), ("Elements", elements), ("Conditions", conditions)):
        lines += [f"Begin SubModelPart{kind}", *map(str, numbers), f"End SubModelPart{kind}"]
    return [*lines, "End SubModelPart"]


def _materials(plane: FilledScene) -> dict[str, Any]:
    materials = []
    for body, (young, poisson) in enumerate(plane.materials):
        values = {"YOUNG_MODULUS": young, "POISSON_RATIO": poisson}
        law = {"constitutive_law": {"name": _LAWS[plane.nodes.shape[1]]}, "Variables": values, "Tables": {}}
        materials.append({"model_part_name": f"Structure.Body{body}", "properties_id": body + 1, "Material": law})
    return {"properties": materials}
