"""Find how small a damage each property off the flat still catches, on a scale that is finer than powers of ten.

`tox -e trust` writes `reports/trust/curved_damage.csv`: a line for each property, a column for each kind of damage, in
the cell the smallest size that was caught. The formulation reports no contact points, so that its forces alone count.
`curved_damage_before.csv` holds what the same script found before arcs, rings and Hertz' contact were asked closer.
"""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from killing import caught_at, properties
from mutate import wrap
from smallest_errors import KINDS, Verbs, forces_error
from subjects import Changed
from tables import fill

import contactverif_mortar
from contactverif import Subject

FILE = "curved_damage.csv"
# Relative sizes from 0.5 to 1e-8: 5, 2 and 1 in each decade.
SIZES = tuple(digit * 10.0**-power for power in range(1, 9) for digit in (5, 2, 1))
CARRIERS: dict[str, Callable[..., Any]] = {
    "accuracy.arc": contactverif_mortar.sts,
    "accuracy.hertz": contactverif_mortar.sts,
    "accuracy.wavy": contactverif_mortar.sts,
    "accuracy.wavy-curved": contactverif_mortar.mortar,  # Springs at points lock there.
    "patch.curved": contactverif_mortar.sts,
    "patch.kinked": contactverif_mortar.sts,
}


def _moved_points(interface: Any, forces: Any, size: float) -> None:
    """Hand a share of each slave node's force to the next node, as points do that lie farther along the segment."""
    first, second = interface.slave.segments.T
    part = size * forces[..., first, :]
    forces[..., first, :] -= part
    forces[..., second, :] += part


def _dropped_ends(interface: Any, forces: Any, size: float) -> None:
    """Lose a share of the forces of the nodes at which the slave ends."""
    ends = np.flatnonzero(np.bincount(interface.slave.segments.ravel()) == 1)
    forces[..., ends, :] *= 1 - size


DAMAGES: dict[str, Callable[[float], Verbs]] = {
    "all forces scaled": KINDS["all forces"],
    "all forces turned": KINDS["direction of the forces"],
    "forces of the master scaled": KINDS["forces of the master"],
    "points moved by a share of a segment": forces_error(_moved_points),
    "forces lost at the slave's ends": forces_error(_dropped_ends),
}


def smallest_damage(name: str, kind: Callable[[float], Verbs]) -> str:
    """Return the smallest size that is caught, by halving; empty if not even the largest one is."""
    (question,) = (question for question in properties() if question.id == name)

    def catches(number: int) -> bool:
        def wrong(*, penalty: float) -> Changed:
            return Changed(wrap(penalty, CARRIERS[name], **kind(SIZES[number])), contact_points=None)

        return caught_at(question, Subject("wrong", wrong), None) > 0

    if not catches(0):
        return ""
    low, high = 0, len(SIZES)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if catches(middle) else (low, middle)
    return f"{SIZES[low]:.0e}"


def cells(name: str) -> list[str]:
    """Return the formulation that carries the damage, and the smallest size of each kind."""
    return [CARRIERS[name].__name__, *(smallest_damage(name, kind) for kind in DAMAGES.values())]


if __name__ == "__main__":
    fill(
        FILE, ["property", "carrier", *DAMAGES], CARRIERS, cells, processes=int(sys.argv[1]) if len(sys.argv) > 1 else 1
    )
