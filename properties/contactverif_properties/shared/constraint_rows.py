"""The constraint rows of multipliers on a flat interface, held to what the contract states of them.

A row is −area · gap where the constraint is active and area · λ where it is not, and it is active where λ − c gap ≥ 0.
The two have opposite signs wherever λ − c gap is near 0, so a row shows which of them the formulation has chosen. The
area is what a unit of the multiplier pushes the slave by, and 1 for a nodal force.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError
from contactverif.contract.subject import CheckedFormulation
from contactverif.contract.traits import Rules
from contactverif_properties.shared.any_state import random_moves
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.roundoff import COORDINATE_ROUNDING
from contactverif_properties.shared.uniform_pressure import normal_of, unit_forces

NEAREST = 16.0  # λ − c gap is nearest to 0 at so many tolerances of a gap, so that its sign is no matter of roundoff.
FARTHEST = 0.25  # It is farthest at this share of c |gap|.
N_MOVES = 64  # The number of moves by roundoff that are tried where a point may hang at a free end.
MOVED = 32.0  # Such a move of both surfaces changes a gap by 181 uX, which is 23 tolerances.


@dataclass(frozen=True, eq=False)
class Constraints:
    """The multipliers of a formulation on a flat interface whose gap is the same everywhere."""

    rules: Rules
    scale: float  # The scale c of the decision λ − c gap ≥ 0.
    areas: FloatArray  # (n_multipliers,) The area of each, a length, or 1; 0 where it sees nothing.
    # (n_multipliers,) The lengths by which roundoff counts. Dual shapes on little of a segment are large and cancel.
    spreads: FloatArray
    tolerance: float  # The relative rounding of a gap or an area.

    @property
    def sees(self) -> BoolArray:
        """Return which multipliers (n_multipliers,) have something opposite."""
        return self.areas > 0

    def errors(self, rows: FloatArray, multipliers: FloatArray, gap: float) -> FloatArray:
        """Return the errors of constraint rows (n_multipliers,) over their tolerance; infinite for a wrong sign."""
        active = self.active(multipliers, gap)
        sizes = self.tolerance * self.spreads * np.where(active, abs(gap), np.abs(multipliers))
        # The area of an inactive constraint may be unknown: a second pass may be covered in part.
        known = active | (self.rules.penalty == "nodal") | (self.rules.area is not None) & self.sees
        signs = np.where(rows * multipliers > 0, 0.0, np.inf)  # The area of an inactive constraint is positive.
        errors: FloatArray = np.where(known, np.abs(rows - self.right(multipliers, gap)) / sizes, signs)
        return errors

    def active(self, multipliers: FloatArray, gap: float) -> BoolArray:
        """Return which constraints (n_multipliers,) are active."""
        return self.sees & (multipliers - self.scale * gap >= 0)

    def right(self, multipliers: FloatArray, gap: float) -> FloatArray:
        """Return the constraint rows (n_multipliers,) that the contract states."""
        areas = np.ones_like(self.areas) if self.rules.penalty == "nodal" else self.areas
        return np.where(self.active(multipliers, gap), -areas * gap, areas * multipliers)


def check_constraint_rows(
    formulation: CheckedFormulation, closed: Case, lifted: Case, rules: Rules, scale: float
) -> float:
    """Return the largest error of a constraint row of a flat interface over its tolerance u(8X/min(g, ℓ) + 4N).

    The gap is minus the parameter `penetration` everywhere if closed, and as wide if lifted. A point that faces a free
    end exactly may lose it by roundoff as the slave is lifted. Then the open gap is not judged. `scale` is the scale c
    of the multipliers. A row that is not what the contract states raises a `ContractError`, which names it beside the
    right one.
    """
    depth, count = closed.parameter("penetration"), formulation.n_multipliers(closed.interface)
    random = np.random.default_rng([closed.seed, 2])
    reach = min(depth, closed.shortest_segment)
    largest = max(closed.largest_coordinate, lifted.largest_coordinate)
    tolerance = UNIT_ROUNDOFF * (8 * largest / reach + 4 * closed.n_segments)
    pressing = scale * depth * random.uniform(0.5, 1.0, count)
    areas, spreads = _areas(FrozenState.at(formulation, closed.with_multipliers(pressing)), rules)
    constraints = Constraints(rules, scale, areas, spreads, tolerance)
    worst = 0.0
    for case, gap in ((closed, -depth), (lifted, depth)):
        for multipliers in _choose_multipliers(random, constraints, gap):
            rows = _rows(formulation, case, multipliers)
            errors = constraints.errors(rows, multipliers, gap)
            if not (errors <= 1).all():
                moves = (_rows(formulation, moved, multipliers) for moved in _move_by_roundoff(case))
                if any((constraints.errors(moved, multipliers, gap) <= MOVED).all() for moved in moves):
                    return worst
                raise ContractError(_describe(constraints, rows, multipliers, gap, int(errors.argmax())))
            worst = max(worst, float(errors.max(initial=0.0)))
    return worst


def _choose_multipliers(random: np.random.Generator, constraints: Constraints, gap: float) -> Iterator[FloatArray]:
    """Yield multipliers for a gap: such that λ − c gap > 0 everywhere, then twice with both signs just beside 0."""
    size, count = constraints.scale * abs(gap), len(constraints.areas)
    yield constraints.scale * gap + size * random.uniform(1.25, 2.0, count)
    nearest = NEAREST * constraints.tolerance
    if nearest < FARTHEST:
        distances = size * np.exp(random.uniform(np.log(nearest), np.log(FARTHEST), count))
        distances *= np.where(random.random(count) < 0.5, 1.0, -1.0)
        yield constraints.scale * gap + distances
        yield constraints.scale * gap - distances


def _rows(formulation: CheckedFormulation, case: Case, multipliers: FloatArray) -> FloatArray:
    """Return the constraint rows (n_multipliers,) of a case with multipliers, on its own pairing."""
    rows: FloatArray = FrozenState.at(formulation, case.with_multipliers(multipliers)).residual[
        case.interface.n_unknowns :
    ]
    return rows


def _areas(state: FrozenState, rules: Rules) -> tuple[FloatArray, FloatArray]:
    """Return what a unit of each multiplier pushes the slave by, and the sizes (n_multipliers,) of what it pushes.

    It is what pushes the master where it does not push the slave. No size is below the largest area.
    """
    case = state.case
    pushes = -unit_forces(state).T.reshape(case.n_multipliers, -1, 2) @ normal_of(case)  # (n_multipliers, n_nodes)
    slave, master = np.split(pushes, [case.interface.n_slave_nodes], axis=1)
    areas: FloatArray = np.maximum(slave.sum(axis=1), -master.sum(axis=1))
    if rules.penalty == "nodal":
        areas = (areas > 0).astype(np.float64)
        return areas, np.ones_like(areas)
    return areas, np.maximum(np.abs(pushes).sum(axis=1) / 2, areas.max(initial=0.0))


def _move_by_roundoff(case: Case) -> Iterator[Case]:
    """Yield the case with its nodes moved at random by what roundoff may do."""
    reach = COORDINATE_ROUNDING * case.largest_coordinate
    for direction in random_moves(case.seed, N_MOVES, case.z.size):
        yield replace(case, z=case.z + reach * direction)


def _describe(constraints: Constraints, rows: FloatArray, multipliers: FloatArray, gap: float, row: int) -> str:
    """Return in words which constraint row is wrong, beside what is right."""
    multiplier, scale = float(multipliers[row]), constraints.scale
    area = "1, since it is a nodal force" if constraints.rules.penalty == "nodal" else f"{constraints.areas[row]:.6g}"
    state = f"at a gap of {gap:.6g}, λ = {multiplier:.6g} and c = {scale:.6g}"
    answer = f"residual: constraint row {row} is {rows[row]:.6g} {state}"
    if not constraints.sees[row]:
        return f"{answer}, where its multiplier sees nothing; needed area · λ with an area > 0"
    difference = multiplier - scale * gap
    form = "−area · gap" if difference >= 0 else "area · λ"
    right = f"{form} = {constraints.right(multipliers, gap)[row]:.6g} with the area {area}"
    return f"{answer}; needed {right}, since λ − c gap is {difference:.3g}"
