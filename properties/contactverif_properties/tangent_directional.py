"""Ask whether the tangent is the derivative of the residual, along some directions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations, permutations

import numpy as np
from scipy.sparse import csgraph, csr_array

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.interface import Surface
from contactverif.contract.measurement import Finding, Measurement, Quantity, check_all
from contactverif.contract.pairing import Pairing
from contactverif.contract.property import WITH_BARRIER, Property, Verdict, judge
from contactverif.contract.subject import Subject
from contactverif.strategies import smooth_cases
from contactverif.strategies.surfaces import smooth_surface_cases
from contactverif_properties.shared.any_state import freeze_state, random_directions
from contactverif_properties.shared.applicability import promise_exact_tangent
from contactverif_properties.shared.block_derivatives import differences_by_complex_step, groups_of
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.kinks import excuse_barrier, find_kink
from contactverif_properties.shared.roundoff import COORDINATE_ROUNDING

# Combinations of directions that are shorter than this share s of the longest are left out. A central difference is
# exact to u^(2/3), and its noise grows by 1/s as the combination is made as long as the others. Both are equal at
# s = u^(1/3): what is left out is no larger than the noise of what stays.
_SMALLEST_SHARE = UNIT_ROUNDOFF ** (1 / 3)
NOT_ANALYTIC = "real differences agree with the tangent: is a norm, abs, conj or real part in the residual?"
N_DIRECTIONS = 8
CENTRAL_STEPS = (8.0, 1.0, 0.125)  # Steps over the one at which truncation and roundoff are equal.
TAYLOR_STEPS = (2.0**-8, 2.0**-12)  # Steps over ℓ.
STEP_RATIO = 8.0  # A slope is taken between two steps only if one is so many times the other.
SHORTEST_BENDING = 2.0**-10  # Over less than this share of ℓ, differences decide nothing.
SLOPE = 1.9
CENTRAL = Quantity(
    "error against a central difference",
    "30 (uS/ℓ)^(2/3)",
    "Truncation (h/ℓ)² and roundoff uS/h are equal at h = ℓ (uS/ℓ)^(1/3). The factor 30 is for the third derivative.",
)
TAYLOR = Quantity(
    "slope of the Taylor remainder",
    "1.9",
    "The remainder |R(x+hd) − R − hKd| falls like h², less what is left of h³.",
    sense="at least",
)
COMPLEX = Quantity(
    "error against a complex step",
    "1e-11 + 64 uS/ℓ",
    "A complex step has no truncation. Rounding the ends of a segment turns it by uS/ℓ.",
)


@Property.define(
    id="tangent.directional",
    rank=0,
    family="tangent",
    quantities=(CENTRAL, TAYLOR, COMPLEX),
    cases=Cases.random(smooth_cases),
    cases_in_space=Cases.random(smooth_surface_cases),
    promise=promise_exact_tangent,
    needs=frozenset({"tangent"}),
    asks=WITH_BARRIER,
)
def tangent_directional(case: Case, subject: Subject) -> Measurement:
    """The tangent is the derivative of the residual on a frozen pairing.

    **Question.** Along some directions, does the tangent give the same change as differences of the residual?

    **Why it matters.** A wrong term in the tangent does not change the result, so no patch test finds it. It costs
    iterations, and makes an analysis diverge where the right tangent converges.

    **How it is judged.** The pairing stays frozen, so the residual is smooth. Eight directions move all unknowns at
    random, and others the nodes of one chain, or the multipliers. Two more follow from what was found: the defect of
    the worst direction, and the leading singular direction of the tangent minus its difference quotient on all
    directions before. Two conditions hold together, since the steps of the Taylor slope, ℓ/256 and ℓ/4096, are too long
    to show an error of 1e-4 in one entry, and a central difference has an error of its own:

    - The best central difference over three steps differs by at most 30 (uS/ℓ)^(2/3) at each node. That is relative to
      the largest derivative there, or its change over ℓ, or the largest block of the tangent in the columns that the
      node feels. No norm over the whole matrix hides a small row, unless it is below uS/ℓ of the largest derivative:
      so much roundoff leaves at a node that a cell reaches by a rounding.
    - The Taylor remainder |R(x+hd) − R − hKd| falls with a slope of at least 1.9. A remainder at roundoff is exact.

    Where the plugin takes complex positions, a complex step differs by at most 1e-11 + 64 uS/ℓ, likewise. Where the
    residual itself bends over a length λ < ℓ, as a segment seen nearly edge-on does, a failing case is judged again
    with λ in place of ℓ. Each block of the tangent by itself is the question of `tangent.sparsity`.

    Without a pairing, or where it has a handle, the residual decides anew at each state, and there is no complex step.

    **Undecided.** A failing case is undecided near a kink that the pairing does not freeze, or where the residual bends
    over less than ℓ/1024. A pairing that is another one wherever the nodes move holds numbers and not decisions; that
    fails, unless all of these pairings give the same forces to roundoff, in all states that differences are taken of.
    """
    state = freeze_state(case, subject)
    case, shortest = state.case, state.case.resolution
    directions = first_directions(case, N_DIRECTIONS)
    undecided, broken = _check_pairing(state, directions)

    def measure_over(length: float) -> tuple[Measurement, float]:
        comparison = compare(state, directions, length)
        more = defect_directions(directions, comparison.defects)
        if len(more):
            comparison = comparison.join(compare(state, more, length))
        conditioning = UNIT_ROUNDOFF * case.largest_coordinate / length
        tolerances = {CENTRAL: 30 * conditioning ** (2 / 3), TAYLOR: SLOPE, COMPLEX: 1e-11 + 64 * conditioning}
        values, finding = {CENTRAL: comparison.error}, comparison.finding
        if np.isfinite(comparison.slope):
            values[TAYLOR] = comparison.slope
        if subject.traits.abilities.takes_complex and not state.formulation.decides_anew(state.pairing):
            values[COMPLEX], complex_finding = compare_complex_step(
                state, np.vstack([directions, more]), comparison.turns
            )
            if values[COMPLEX] > tolerances[COMPLEX]:
                # Real differences would have seen an error of the tangent that is so large.
                real_agrees = values[CENTRAL] <= tolerances[CENTRAL] < values[COMPLEX] / 2
                finding = replace(complex_finding, remark=NOT_ANALYTIC if real_agrees else "")
        idle = comparison.bending == np.inf
        measurement = Measurement(
            check_all(values, tolerances), undecided, broken, {"length": length}, idle=idle, finding=finding
        )
        return measurement, comparison.bending

    first, bending = measure_over(shortest)
    if judge(tangent_directional, first)[0] is not Verdict.FAIL:
        return replace(first, finding=None)
    if first.finding is not None:
        longest, step, _ = _central_steps(case, shortest)
        error = abs(first.finding.found[0] - first.finding.right[0])
        if excuse := excuse_barrier(state, longest, step, error):
            return replace(first, undecided=excuse)
    if bending >= shortest / 2:
        return first
    second, _ = measure_over(max(bending, SHORTEST_BENDING * shortest))
    if bending < SHORTEST_BENDING * shortest and not undecided:
        return replace(second, undecided=f"roundoff: the residual bends over {bending:.2g}, too short for differences")
    return second


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """The results of differences along some directions."""

    error: float  # The largest error against the best central difference, over the size of the derivative at its node.
    # The least slope of the Taylor remainder; infinite where all remainders are roundoff, or the residual has none.
    slope: float
    bending: float  # The length over which the residual is seen to bend, see `compare`.
    defects: FloatArray  # (n_directions, n_unknowns) The tangent times each direction, minus the central difference.
    finding: Finding | None  # The row of the largest error.
    # (n_unknowns,) The change of the derivative in each row over a length ℓ, from the third derivative.
    turns: FloatArray

    def join(self, other: Comparison) -> Comparison:
        """Return the worse of both."""
        worse = self if self.error >= other.error else other
        turns = np.maximum(self.turns, other.turns)
        slope, bending = min(self.slope, other.slope), min(self.bending, other.bending)
        return replace(worse, slope=slope, bending=bending, turns=turns)


def compare(state: FrozenState, directions: FloatArray, length: float) -> Comparison:
    """Compare derivatives along directions (n, n_unknowns) with central differences and Taylor remainders, all at once.

    Steps are shares of the length over which the residual is taken to bend. The length over which it does bend is the
    root of its size over its third derivative, from the central differences of two steps. The tangent plays no part in
    it.
    """
    case, reach = state.case, state.case.largest_coordinate
    derivative = directions @ state.tangent.T  # (n_directions, n_unknowns)
    central, taylor = _central_steps(case, length), np.array(TAYLOR_STEPS) * length
    steps = np.concatenate([central, -central, taylor])
    batch = case.z + steps[:, None, None] * directions  # (n_steps, n_directions, n_unknowns)
    states = np.concatenate([batch.reshape(-1, case.z.size), case.z[None]])
    forces = state.residual_at(states)
    here, moved = forces[-1], forces[:-1].reshape(batch.shape)

    n = len(central)
    slopes = (moved[:n] - moved[n : 2 * n]) / (2 * central[:, None, None])
    size = max(np.abs(derivative).max(), np.abs(slopes).max())
    if size == 0:
        return Comparison(0.0, np.inf, np.inf, 0 * derivative, None, 0 * case.z)
    errors = np.abs(slopes - derivative)  # (n_steps, n_directions, n_unknowns)
    best = errors.max(axis=2).argmin(axis=0)
    closest = np.take_along_axis(slopes, best[None, :, None], axis=0)[0]
    third = np.abs(slopes[0] - slopes[1]).max(axis=0) / (central[0] ** 2 - central[1] ** 2)  # Third derivative / 6.
    turns = third * case.resolution**2
    sizes = _row_sizes(state, np.maximum(np.abs(derivative).max(axis=0), np.abs(slopes).max(axis=(0, 1))), turns)
    error, finding = _worst_row(case, errors.min(axis=0), sizes, derivative, closest)
    forward = np.r_[0, 2 * n : 2 * n + len(taylor)]  # The longest central step serves here too.
    remainders = np.abs(moved[forward] - here - steps[forward, None, None] * derivative).max(axis=2)
    floor = 1e3 * UNIT_ROUNDOFF * reach * size
    slope = taylor_slope(remainders, steps[forward], floor)
    if slope < SLOPE:  # If the best difference as derivative gives no better slope, the residual is not smooth.
        smooth = np.abs(moved[forward] - here - steps[forward, None, None] * closest).max(axis=2)
        if taylor_slope(smooth, steps[forward], floor) < SLOPE:
            slope = np.inf
    bending = float(np.sqrt(size / third.max())) if third.any() else np.inf
    return Comparison(error, slope, bending, derivative - closest, finding, turns)


def compare_complex_step(state: FrozenState, directions: FloatArray, turns: FloatArray) -> tuple[float, Finding]:
    """Return the largest difference of a complex step from the derivative, likewise, and its row."""
    derivative, exact = directions @ state.tangent.T, differences_by_complex_step(state, directions)
    sizes = _row_sizes(state, np.maximum(np.abs(exact).max(axis=0), np.abs(derivative).max(axis=0)), turns)
    return _worst_row(state.case, np.abs(exact - derivative), sizes, derivative, exact)


def _row_sizes(state: FrozenState, derivatives: FloatArray, turns: FloatArray) -> FloatArray:
    """Return the size (n_unknowns,) of the derivative at the node of each row.

    It is the largest of these derivatives (n_unknowns,) there, or their change over ℓ, `turns` (n_unknowns,), or
    the largest block of the tangent in a column that the node feels: what cancels in a row is rounded like that.
    """
    groups = groups_of(state.case)
    blocks = groups.largest(state.tangent)
    around = np.where(blocks > 0, groups.surroundings(blocks), 0.0).max(axis=1)
    at_nodes = np.zeros(groups.count)
    np.maximum.at(at_nodes, groups.of_unknowns, np.maximum(derivatives, turns))
    sizes: FloatArray = np.maximum(at_nodes, around)[groups.of_unknowns]
    return sizes


def _worst_row(
    case: Case, errors: FloatArray, sizes: FloatArray, derivative: FloatArray, difference: FloatArray
) -> tuple[float, Finding]:
    """Return the largest error over the size of its row, and that row.

    Rounding the positions moves the ends of what a point, a cell or an area reaches by uS. A node that is reached by no
    more than that has a derivative of uS/ℓ of the largest one, and whether it is 0 or as large is no error.
    """
    dust = UNIT_ROUNDOFF * case.largest_coordinate / case.resolution * np.abs(difference).max()
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(errors > dust, errors / sizes, 0.0)
    number, row = divmod(int(relative.argmax()), relative.shape[1])
    place = f"row {row} ({groups_of(case).describe(row)})"
    found, right = (derivative[number, row],), (difference[number, row],)
    return float(relative[number, row]), Finding(
        place, found, right, "N m-1", found_name="tangent times direction", right_name="derivative"
    )


def taylor_slope(remainders: FloatArray, steps: FloatArray, floor: float) -> float:
    """Return the slope of log |remainder| over log h: the best between two steps, the worst over the directions.

    Remainders are (n_steps, n_directions), the steps h (n_steps,) in any order. Two steps count only where one is
    `STEP_RATIO` times the other: between two that are nearly equal, the slope is noise. A remainder below the floor is
    roundoff, and a direction that has no slope because of that is exact.
    """
    best = np.full(remainders.shape[1], -np.inf)
    decided = np.zeros(remainders.shape[1], dtype=bool)
    for long, short in permutations(range(len(steps)), 2):
        if steps[long] < STEP_RATIO * steps[short]:
            continue
        above = remainders[short] > floor
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.log(remainders[long] / remainders[short]) / np.log(steps[long] / steps[short])
        best = np.where(above, np.maximum(best, slope), best)
        decided |= above
    return float(best[decided].min(initial=np.inf))


def _central_steps(case: Case, length: float) -> FloatArray:
    """Return the steps of central differences of a residual that bends over a length."""
    steps: FloatArray = np.array(CENTRAL_STEPS) * length * (UNIT_ROUNDOFF * case.largest_coordinate / length) ** (1 / 3)
    return steps


def _check_pairing(state: FrozenState, directions: FloatArray) -> tuple[str, str]:
    """Return why the pairing makes a failure undecided, and how it breaks the contract; both empty if it does neither.

    A pairing that is another one at every place, however near, holds numbers and not decisions, and on such a pairing
    no difference shows a missing term. A pairing that changes here and there, as ties by roundoff do, is no breach, nor
    is one whose changes do not count, as those of points that are not active.
    """
    case, direction = state.case, directions[0]
    step = _central_steps(case, case.resolution)[-1]

    def pair(shifts: Iterable[float]) -> list[Pairing | None]:
        return [state.formulation.pair(case.interface, case.z + shift * step * direction) for shift in shifts]

    if state.pairing is not None and pair((1, -1)) == [state.pairing] * 2:
        return "", ""
    if (kink := find_kink(state, 4 * step, direction)) or state.pairing is None:
        return kink, ""
    beside = [pair(sign * 2.0**-10 * np.arange(1, 4)) for sign in (1, -1)]
    if all(map(_all_agree, beside)):
        return "a kink: the pairing changes here, and is steady on either side", ""
    around = [pair(scale * np.arange(-2, 4)) for scale in (1, 2.0**-5, 2.0**-10)]
    if all(map(_all_differ, around)) and _change_forces(list(chain(*around)), state, directions):
        return "", "the pairing is another one wherever the nodes move: it holds numbers, not decisions"
    return "", ""


def _change_forces(pairings: Sequence[Pairing | None], state: FrozenState, directions: FloatArray) -> bool:
    """Return whether any pairing changes the residual by more than roundoff, where differences are taken of it."""
    case = state.case
    central = _central_steps(case, case.resolution)
    steps = np.concatenate([central, -central, np.array(TAYLOR_STEPS) * case.resolution])
    moves = (steps[:, None, None] * directions).reshape(-1, case.z.size)
    places = np.concatenate([case.z[None], case.z + moves])
    forces = state.residual_at(places)
    slope = (np.abs(forces[1:] - forces[0]).max(axis=1) / np.abs(moves).max(axis=1)).max()
    roundoff = COORDINATE_ROUNDING * case.largest_coordinate * slope
    others = (replace(state, pairing=pairing).residual_at(places) for pairing in pairings)
    return any(np.abs(other - forces).max() > roundoff for other in others)


def _all_agree(pairings: Sequence[Pairing | None]) -> bool:
    """Return whether all of some pairings are alike."""
    return all(pairing == pairings[0] for pairing in pairings)


def _all_differ(pairings: Sequence[Pairing | None]) -> bool:
    """Return whether no two of some pairings are alike."""
    return all(first != second for first, second in combinations(pairings, 2))


def first_directions(case: Case, n_random: int) -> FloatArray:
    """Return random directions (n, n_unknowns) that move all unknowns, one for each chain, and one for the multipliers.

    The largest entry of each is ±1.
    """
    regions = _regions(case)
    moves = random_directions(case.seed, n_random + len(regions), case.z.size)
    local = np.zeros((len(regions), case.z.size))
    for number, unknowns in enumerate(regions):
        part = moves[n_random + number, unknowns]
        local[number, unknowns] = part / np.abs(part).max()
    return np.vstack([moves[:n_random], local])


def defect_directions(directions: FloatArray, defects: FloatArray) -> FloatArray:
    """Return the largest defect, and the leading singular direction of what maps directions to defects, (2, n).

    Defects (n_directions, n) are the tangent times a direction, minus the difference quotient along it. The singular
    direction is the one in the span of the directions with the largest defect for its length. Where there is no defect,
    there are no directions, (0, n). The largest entry of each is ±1.
    """
    worst = defects[np.abs(defects).max(axis=1).argmax()]
    if not worst.any():
        return np.empty((0, directions.shape[1]))
    basis, sizes, weights = np.linalg.svd(directions.T, full_matrices=False)
    spanned = sizes > _SMALLEST_SHARE * sizes[0]  # There may be more directions than unknowns.
    on_basis = defects.T @ (weights[spanned].T / sizes[spanned])  # The map on the basis, (n, n_spanned).
    singular = basis[:, spanned] @ np.linalg.svd(on_basis, full_matrices=False)[2][0]
    both = np.array([worst, singular])
    scaled: FloatArray = both / np.abs(both).max(axis=1, keepdims=True)
    return scaled


def _regions(case: Case) -> list[IntArray]:
    """Return the unknowns of each chain, and those of all multipliers."""
    nodes = [chain for side in (case.interface.slave, case.interface.master) for chain in _chains(side)]
    dim = case.interface.dim
    regions = [(dim * np.sort(chain)[:, None] + np.arange(dim)).reshape(-1) for chain in nodes]
    if case.n_multipliers:
        regions.append(np.arange(case.interface.n_unknowns, case.z.size))
    return regions


def _chains(surface: Surface) -> list[IntArray]:
    """Return the nodes of each chain of a surface, or of each part of it that hangs together."""
    n_nodes, corners = int(surface.faces.max()) + 1, surface.faces.T
    edges = np.concatenate([corners[[k, k + 1]] for k in range(len(corners) - 1)], axis=1)
    links = csr_array((np.ones(edges.shape[1]), tuple(edges)), shape=(n_nodes, n_nodes))
    _, label = csgraph.connected_components(links, directed=False)
    nodes = surface.nodes
    return [nodes[label[nodes] == number] for number in np.unique(label[nodes])]
