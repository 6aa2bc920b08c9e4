"""Ask formulations that are wrong everything, and keep which property catches which of them, and how small an error.

`tox -e trust` writes into `reports/trust`: `kills.csv`, a line for each mutant with the number of the first case that
caught it for each property ("-" where a slow one was not asked); `face_kills.csv`, one for each mutant on faces with
the first case of the property that is meant to catch it, and what else does; `smallest_errors.csv`, the powers of ten
of the smallest error of each kind that each property catches; `curved_damage.csv`, the smallest sizes on a finer scale
for properties off the flat; `smallest_cases.csv`, the sizes of shrunk counterexamples.

`curved_damage_before.csv` and `smallest_cases_before.csv` hold what the same questions found before arcs, rings and
Hertz' contact were asked closer, and before cases were drawn without hypothesis' engine.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import frexp
from typing import Any

import numpy as np
from subjects import Changed, load_property
from tables import SURVIVES, UNKNOWN, fill_all
from zoo.killing import (
    MUTANTS,
    MUTANTS_IN_SPACE,
    OTHERS,
    SURVIVORS,
    caught_at,
    first_accused,
    properties,
    without_points,
)
from zoo.making import wrap

import contactverif_mortar
import contactverif_nts
from contactverif import Property, Subject
from contactverif.contract.arrays import dense
from contactverif.run.run import run

KILLS, FACE_KILLS, ERRORS, DAMAGE, SMALL = (
    f"{name}.csv" for name in ("kills", "face_kills", "smallest_errors", "curved_damage", "smallest_cases")
)
NAMED = {mutant.name: mutant for mutant in MUTANTS} | {SURVIVES + mutant.name: mutant for mutant in SURVIVORS}
# Cases of properties that are not meant to catch the mutant, where they are not OTHERS: these take seconds each. They
# are asked about mutants that at most one other property catches.
SLOW = {
    **dict.fromkeys(("accuracy.arc", "accuracy.hertz", "accuracy.wavy", "accuracy.wavy-curved"), 1),
    **dict.fromkeys(("hard.touch", "patch.kinked", "purity.long", "stability.locking", "tangent.long"), 1),
    "tangent.directional": 5,
}


def is_list(question: Property) -> bool:
    return isinstance(question.cases(None), tuple)


def kill(name: str) -> list[str]:
    """Return the property that is meant to catch a mutant, and the number of the first case that did, for each one."""
    mutant, row = NAMED[name], dict[str, str]()
    for question in sorted(properties().values(), key=lambda question: question.id in SLOW):
        intended, subject = question.id == mutant.caught_by, Subject(mutant.name, mutant.make)
        if question.id in SLOW and not intended and sum(map(bool, row.values())) > 1:
            row[question.id] = UNKNOWN
        else:
            few = SLOW.get(question.id, 1 if question.bodies or is_list(question) else OTHERS)
            row[question.id] = str(caught_at(question, subject, None if intended else few) or "")
    return [mutant.caught_by, *(row[property_id] for property_id in properties())]


INTENDED_ON_FACES, OTHERS_ON_FACES = 300, 5  # Cases of the property that is meant to catch it, and of each other one.
LONG = ("tangent.long", "hard.touch")  # Properties that are asked about mutants that are meant for them alone.


def kill_on_faces(name: str) -> list[str]:
    """Return the property that is meant to catch a mutant, the first case that did, and what else catches it."""
    (mutant,) = (mutant for mutant in MUTANTS_IN_SPACE if mutant.name == name)
    subject, caught_by = Subject(mutant.name, mutant.make), mutant.caught_by
    first = first_accused(properties(True)[caught_by], subject, INTENDED_ON_FACES)[0]
    others = [question for question in properties(True).values() if question.id not in (*LONG, caught_by)]
    also = [question.id for question in others if first_accused(question, subject, OTHERS_ON_FACES)[0]]
    return [caught_by, str(first), "; ".join(also)]


# Errors of a kind, such as one nodal force: from a relative size to changed verbs.
Kind = Callable[[float], dict[str, Callable[..., Any]]]


def of_forces(change: Callable[[Any, Any, float], Any]) -> Kind:
    """Return an error that a function (interface, forces (..., n_nodes, 2), size) makes in the forces, in place."""

    def residual(size: float, right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        answer = np.array(right(interface, pairing, z))
        n = interface.n_unknowns
        forces = answer[..., :n].reshape(*answer.shape[:-1], -1, 2)
        change(interface, forces, size)
        answer[..., :n] = forces.reshape(*answer.shape[:-1], n)
        return answer

    return lambda size: {"residual": partial(residual, size)}


def of_tangent(change: Callable[[Any, float], Any]) -> Kind:
    """Return an error that a function (matrix, size) makes in the tangent, in place."""

    def tangent(size: float, right: Any, *state: Any) -> Any:
        matrix = dense(right(*state))
        change(matrix, size)
        return matrix

    return lambda size: {"tangent": partial(tangent, size)}


def of_points(name: str) -> Kind:
    """Return a relative error of a reported number."""

    def contact_points(size: float, right: Any, *state: Any) -> Any:
        points = right(*state)
        return replace(points, **{name: getattr(points, name) * (1 + size)})

    return lambda size: {"contact_points": partial(contact_points, size)}


def scale(select: Callable[[Any], Any]) -> Kind:
    """Return a relative error of the forces that `select(interface)` indexes."""

    def change(interface: Any, forces: Any, size: float) -> None:
        forces[select(interface)] *= 1 + size

    return of_forces(change)


def _turn(interface: Any, forces: Any, size: float) -> None:
    forces += size * np.stack([-forces[..., 1], forces[..., 0]], axis=-1)


def _units(interface: Any, forces: Any, size: float) -> None:
    forces *= 1 + size * np.sin(interface.slave.lengths(interface.nodes)[0])


def _remember(last: list[Any], size: float, right: Any, *state: Any) -> Any:
    answer = right(*state)
    error = size * last[0] if last and last[0].shape == answer.shape else 0.0
    last[:] = [answer]
    return answer + error


def _round_positions(size: float, right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    return right(interface, pairing, z + size * np.abs(z).max(axis=-1, keepdims=True) * np.sin(1e9 * np.real(z)))


def _scale_matrix(matrix: Any, size: float) -> None:
    matrix *= 1 + size


def _scale_largest_entry(matrix: Any, size: float) -> None:
    row, column = np.unravel_index(np.abs(matrix).argmax(), matrix.shape)
    matrix[row, column] *= 1 + size


def _skew(matrix: Any, size: float) -> None:
    matrix += size * np.triu(matrix, 1)


def _move_points(interface: Any, forces: Any, size: float) -> None:
    """Hand a share of each slave node's force to the next node, as points do that lie farther along the segment."""
    first, second = interface.slave.segments.T
    part = size * forces[..., first, :]
    forces[..., first, :] -= part
    forces[..., second, :] += part


def _lose_ends(interface: Any, forces: Any, size: float) -> None:
    """Lose a share of the forces of the nodes at which the slave ends."""
    ends = np.flatnonzero(np.bincount(interface.slave.segments.ravel()) == 1)
    forces[..., ends, :] *= 1 - size


KINDS: dict[str, Kind] = {
    "all forces": scale(lambda interface: ...),
    "forces of the master": scale(lambda interface: (..., slice(interface.n_slave_nodes, None), slice(None))),
    "one nodal force": scale(lambda interface: (..., interface.n_slave_nodes // 2, slice(None))),
    "direction of the forces": of_forces(_turn),
    "forces along one axis": scale(lambda interface: (..., 0)),
    "forces by a length in its unit": of_forces(_units),
    "forces by the last call": lambda size: {"residual": partial(_remember, [], size)},
    "positions": lambda size: {"residual": partial(_round_positions, size)},
    "whole tangent": of_tangent(_scale_matrix),
    "largest entry of the tangent": of_tangent(_scale_largest_entry),
    "symmetry of the tangent": of_tangent(_skew),
    **{f"reported {name}": of_points(name) for name in ("pressure", "gap", "xi", "normal", "weight", "position")},
}
# Formulations that carry the errors: one that promises most, one that is symmetric, one with multipliers.
CARRIERS = {
    "vts-ppt-balanced": contactverif_nts.vts_ppt_balanced,
    "nts": contactverif_nts.nts,
    "mortar-lm": contactverif_mortar.mortar_lm,
    "sts": contactverif_mortar.sts,
}
POWERS = tuple(10.0**-power for power in range(1, 16))
EXAMPLES, EXAMPLES_SOLVED = 20, 3  # Cases that an error may show in; of slow properties one.

DAMAGES = {
    "all forces scaled": KINDS["all forces"],
    "all forces turned": KINDS["direction of the forces"],
    "forces of the master scaled": KINDS["forces of the master"],
    "points moved by a share of a segment": of_forces(_move_points),
    "forces lost at the slave's ends": of_forces(_lose_ends),
}
# Relative sizes from 0.5 to 1e-8: 5, 2 and 1 in each decade.
SIZES = tuple(digit * 10.0**-power for power in range(1, 9) for digit in (5, 2, 1))
OFF_THE_FLAT = dict.fromkeys(
    ("accuracy.arc", "accuracy.hertz", "accuracy.wavy", "accuracy.wavy-curved", "patch.curved", "patch.kinked"),
    contactverif_mortar.sts,
) | {"accuracy.wavy-curved": contactverif_mortar.mortar}  # Springs at points lock there.


def smallest(
    question: Property, make: Any, kind: Kind, sizes: tuple[float, ...], examples: int | None, change: Any = None
) -> int | None:
    """Return the number of the smallest size that is caught, by halving; None if not even the largest one is."""

    def catches(number: int) -> bool:
        changes = kind(sizes[number])

        def wrong(*, penalty: float) -> Changed:
            return wrap(penalty, make, **changes)

        return caught_at(question, Subject("wrong", change(wrong) if change else wrong), examples) > 0

    if not catches(0):
        return None
    low, high = 0, len(sizes)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if catches(middle) else (low, middle)
    return low


def smallest_errors(name: str) -> list[str]:
    """Return the formulation that carries the errors for a property, and the power of each smallest error."""
    question = properties()[name]
    for carrier, make in CARRIERS.items():
        subject = Subject(carrier, make)
        if question.promise(subject.traits) is True and not question.refusal_of(subject):
            examples = 1 if name in SLOW else EXAMPLES_SOLVED if question.bodies else EXAMPLES
            numbers = [smallest(question, make, kind, POWERS, examples) for kind in KINDS.values()]
            return [carrier, *("" if number is None else str(number + 1) for number in numbers)]
    return ["", *("" for _ in KINDS)]


def smallest_damages(name: str) -> list[str]:
    """Return the formulation that carries the damage, and the smallest size of each kind.

    It reports no contact points, so that its forces alone count. All cases are asked.
    """
    make, question = OFF_THE_FLAT[name], properties()[name]
    numbers = [smallest(question, make, kind, SIZES, None, without_points) for kind in DAMAGES.values()]
    return [make.__name__, *("" if number is None else f"{SIZES[number]:.0e}" for number in numbers)]


def smallest_case(name: str) -> list[str]:
    """Return the property that is meant to catch a mutant, and the size of its smallest case with seed 0.

    The size is slave segments, master segments, and the bits of the coordinate that needs most, as "1 2 3".
    """
    mutant = NAMED[name]
    question = load_property(mutant.caught_by)
    (row,) = run([Subject(name, mutant.make)], [question], examples=100, seed=0, shrink="all").rows
    if row.shrunk is None:
        return [mutant.caught_by, ""]
    case = row.shrunk.case
    coordinates = np.concatenate([case.interface.nodes.ravel(), case.positions.ravel()])
    digits = [f"{int(frexp(abs(number))[0] * 2**53):b}".rstrip("0") for number in coordinates.tolist()]
    return [
        mutant.caught_by,
        f"{len(case.interface.slave)} {len(case.interface.master)} {max(map(len, digits))}",
    ]


def shrinkable() -> list[str]:
    """Return the mutants of properties with random cases, those that solve bodies last; no list is shrunk."""
    mutants = [mutant for mutant in MUTANTS if not is_list(load_property(mutant.caught_by))]
    return [mutant.name for mutant in sorted(mutants, key=lambda mutant: load_property(mutant.caught_by).bodies)]


if __name__ == "__main__":
    fill_all(
        (KILLS, ["mutant", "caught by", *properties()], kill, NAMED),
        (FACE_KILLS, ("mutant", "caught by", "first case", "also"), kill_on_faces, [m.name for m in MUTANTS_IN_SPACE]),
        (ERRORS, ["property", "carrier", *KINDS], smallest_errors, properties()),
        (DAMAGE, ["property", "carrier", *DAMAGES], smallest_damages, OFF_THE_FLAT),
        (SMALL, ["mutant", "caught by", "seed 0"], smallest_case, shrinkable()),
    )
