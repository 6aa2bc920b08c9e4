"""Find how small an error each property still catches.

`tox -e trust` writes `reports/trust/smallest_errors.csv`. Each error is of a kind, such as one
nodal force or one entry of the tangent, and of a size 10^-k. A property is asked about all kinds; the table holds, for
each property and kind, the smallest size that it caught.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from killing import caught_at, properties
from kills import SLOW
from mutate import wrap
from tables import fill

import contactverif_mortar
import contactverif_nts
from contactverif import Property, Subject
from contactverif.contract.arrays import dense

FILE = "smallest_errors.csv"
SMALLEST = 15  # Errors of 10^-1 to 10^-15.
EXAMPLES, EXAMPLES_SOLVED = 20, 3  # Cases that an error may show in; of slow properties one.
Verbs = dict[str, Callable[..., Any]]


def forces_error(change: Callable[[Any, Any, float], Any]) -> Callable[[float], Verbs]:
    """Return an error that a function (interface, forces (..., n_nodes, 2), size) makes in the forces, in place."""

    def verbs(size: float) -> Verbs:
        def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
            answer = np.array(right(interface, pairing, z))
            n = interface.n_unknowns
            forces = answer[..., :n].reshape(*answer.shape[:-1], -1, 2)
            change(interface, forces, size)
            answer[..., :n] = forces.reshape(*answer.shape[:-1], n)
            return answer

        return {"residual": residual}

    return verbs


def _of_tangent(change: Callable[[Any, float], Any]) -> Callable[[float], Verbs]:
    """Return an error that a function (matrix, size) makes in the tangent, in place."""

    def verbs(size: float) -> Verbs:
        def tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
            matrix = dense(right(interface, pairing, z))
            change(matrix, size)
            return matrix

        return {"tangent": tangent}

    return verbs


def _of_points(name: str) -> Callable[[float], Verbs]:
    """Return a relative error of a reported number."""

    def verbs(size: float) -> Verbs:
        def contact_points(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
            points = right(interface, pairing, z)
            return replace(points, **{name: getattr(points, name) * (1 + size)})

        return {"contact_points": contact_points}

    return verbs


def _all_forces(interface: Any, forces: Any, size: float) -> None:
    forces *= 1 + size


def _master_forces(interface: Any, forces: Any, size: float) -> None:
    forces[..., interface.n_slave_nodes :, :] *= 1 + size


def _one_force(interface: Any, forces: Any, size: float) -> None:
    forces[..., interface.n_slave_nodes // 2, :] *= 1 + size


def _turned_forces(interface: Any, forces: Any, size: float) -> None:
    forces += size * np.stack([-forces[..., 1], forces[..., 0]], axis=-1)


def _one_axis(interface: Any, forces: Any, size: float) -> None:
    forces[..., 0] *= 1 + size


def _units(interface: Any, forces: Any, size: float) -> None:
    forces *= 1 + size * np.sin(interface.slave.lengths(interface.nodes)[0])


def _whole_tangent(matrix: Any, size: float) -> None:
    matrix *= 1 + size


def _one_entry(matrix: Any, size: float) -> None:
    row, column = np.unravel_index(np.abs(matrix).argmax(), matrix.shape)
    matrix[row, column] *= 1 + size


def _asymmetry(matrix: Any, size: float) -> None:
    matrix += size * np.triu(matrix, 1)


def _memory(size: float) -> Verbs:
    last: list[Any] = []

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        answer = right(interface, pairing, z)
        error = size * last[0] if last and last[0].shape == answer.shape else 0.0
        last[:] = [answer]
        return answer + error

    return {"residual": residual}


def _rounded_positions(size: float) -> Verbs:
    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        rounded = z + size * np.abs(z).max(axis=-1, keepdims=True) * np.sin(1e9 * np.real(z))
        return right(interface, pairing, rounded)

    return {"residual": residual}


KINDS: dict[str, Callable[[float], Verbs]] = {
    "all forces": forces_error(_all_forces),
    "forces of the master": forces_error(_master_forces),
    "one nodal force": forces_error(_one_force),
    "direction of the forces": forces_error(_turned_forces),
    "forces along one axis": forces_error(_one_axis),
    "forces by a length in its unit": forces_error(_units),
    "forces by the last call": _memory,
    "positions": _rounded_positions,
    "whole tangent": _of_tangent(_whole_tangent),
    "largest entry of the tangent": _of_tangent(_one_entry),
    "symmetry of the tangent": _of_tangent(_asymmetry),
    **{f"reported {name}": _of_points(name) for name in ("pressure", "gap", "xi", "normal", "weight", "position")},
}
# Who carries the errors: a formulation that promises most, one that is symmetric, one with multipliers.
CARRIERS = {
    "vts-ppt-balanced": contactverif_nts.vts_ppt_balanced,
    "nts": contactverif_nts.nts,
    "mortar-lm": contactverif_mortar.mortar_lm,
    "sts": contactverif_mortar.sts,
}


def carrier(question: Property) -> str | None:
    """Return the first formulation that promises to pass a property, or None."""
    for name, make in CARRIERS.items():
        subject = Subject(name, make)
        if question.promise(subject.traits) is True and not question.refusal_of(subject):
            return name
    return None


def is_caught(question: Property, make: Callable[..., Any], verbs: Verbs) -> bool:
    """Return whether the property catches an error."""

    def wrong(*, penalty: float) -> Any:
        return wrap(penalty, make, **verbs)

    examples = 1 if question.id in SLOW else EXAMPLES_SOLVED if question.bodies else EXAMPLES
    return caught_at(question, Subject("wrong", wrong), examples) > 0


def smallest_size(question: Property, make: Callable[..., Any], kind: Callable[[float], Verbs]) -> int:
    """Return the largest k for which an error of 10^-k is caught, 0 if not even 0.1 is; by halving."""
    if not is_caught(question, make, kind(0.1)):
        return 0
    low, high = 1, SMALLEST + 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if is_caught(question, make, kind(10.0**-middle)) else (low, middle)
    return low


def cells(name: str) -> list[str]:
    """Return the formulation that carries the errors for a property, and the power of each smallest error."""
    (question,) = (question for question in properties() if question.id == name)
    if (by := carrier(question)) is None:
        return ["", *("" for _ in KINDS)]
    sizes = [smallest_size(question, CARRIERS[by], kind) for kind in KINDS.values()]
    return [by, *(str(size or "") for size in sizes)]


if __name__ == "__main__":
    ids = [question.id for question in properties()]
    fill(FILE, ["property", "carrier", *KINDS], ids, cells, processes=int(sys.argv[1]) if len(sys.argv) > 1 else 1)
