"""The data of a kind of query: how its surfaces and points are drawn, and what must be so of each of them.

Rule for the next editor: what holds is decided by the exact answer alone. A point for which it does not hold is drawn
again, so that a query is of the kind whose name it bears.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from contactverif.oracle.exact_nearest import Nearest
from contactverif.studies.queries.query_dice import Dice, Vector
from contactverif.studies.queries.query_shapes import Shape

Draw = Callable[[Dice], tuple[Shape, list[Vector]]]
Condition = Callable[[Shape, Vector, Nearest], bool]


def always(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return True: the way of drawing says it all."""
    return True


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of query."""

    name: str  # One word, as it stands in the file.
    meaning: str  # The situation, in a few words.
    draw: Draw  # The function that draws a surface and some points for it.
    holds: Condition = always  # The function that decides by the exact answer whether a point is of this kind.


def has_inner_foot(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether one segment is nearest, and the foot is between its nodes."""
    return len(nearest.segments) == 1 and 0 < nearest.segments[0].xi < 1


def is_tie(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether no rule but the number of the segment decides."""
    return nearest.n_undecided > 1


def lies_off_a_vertex(sign: int) -> Condition:
    """Return the condition that a node of two segments is nearest, and the point is outside (+1) or inside (−1)."""

    def condition(shape: Shape, point: Vector, nearest: Nearest) -> bool:
        gap = nearest.segments[0].signed_squared_gap
        return len(nearest.segments) == 2 and nearest.n_undecided == 1 and gap * sign > 0

    return condition
