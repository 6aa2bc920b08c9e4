"""Whether the errors of a formulation fall on finer and finer meshes of a problem: what `accuracy.*` measures.

No problem is known here. The studies of a problem say what is solved, what is measured, and which bounds hold.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import fit_rate, solve_for_accuracy
from contactverif.problems.problem import ITERATIONS, Bound, Errors, PosedProblem, Studies, Study


def measure_convergence(studies: Studies, case: Case, subject: Subject) -> Measurement:
    """Solve a study on all meshes, and return the rates of its errors and their sizes on the finest mesh.

    All errors are kept as series. A number whose errors are not reported is left out.
    """
    study, lost, rows = studies.read(case), [], []
    for mesh in study.meshes:
        posed = study.pose(mesh, subject.traits)
        solution = solve_for_accuracy(posed.scene, subject, posed.start, posed.step)
        largest = float(np.abs(posed.exact_forces(solution.state)).max())
        if not solution.is_balanced_to(studies.nearly * largest):
            lost.append(f"mesh {mesh}: {solution.end}")
        rows.append(posed.errors(solution) | {ITERATIONS: float(solution.n_iterations)})
    undecided = f"Newton's method finds no solution on {', '.join(lost)}" if lost else ""
    details = {} if ITERATIONS in studies.series.values() else {ITERATIONS: rows[-1][ITERATIONS]}
    errors = _by_kind(rows)
    series = {name: np.array(errors[kind]) for name, kind in studies.series.items() if kind in errors}
    group = study.group(subject.traits)
    numbers = [
        bound.quantity.check(_value(bound, study, errors), _tolerance(bound, group, posed))
        for bound in studies.bounds
        if errors.keys() >= set(bound.kinds)
    ]
    return Measurement(numbers, undecided, details=details, series=series)


def _by_kind(rows: list[Errors]) -> dict[str, list[float]]:
    """Return the errors of all meshes by kind, where all have it."""
    kinds = [kind for kind in rows[0] if all(kind in row for row in rows)]
    return {kind: [row[kind] for row in rows] for kind in kinds}


def _value(bound: Bound, study: Study, errors: dict[str, list[float]]) -> float:
    """Return the least rate of the errors, or the largest one on the finest mesh."""
    if not bound.rate:
        return max(errors[kind][-1] for kind in bound.kinds)
    sizes = [study.size(mesh) for mesh in study.meshes]
    return min(fit_rate(sizes, errors[kind]) for kind in bound.kinds)


def _tolerance(bound: Bound, group: str, finest: PosedProblem) -> float:
    limit = bound.limit(group)
    return limit * max(finest.best[kind] for kind in bound.kinds) if bound.of_best else limit


def exact_forces(studies: Studies, case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, 2) that push the nodes of the coarsest mesh, for pictures."""
    study = studies.read(case)
    return study.pose(study.meshes[0], Traits()).exact_forces(case)
