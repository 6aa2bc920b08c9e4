"""Ask whether the tangent is the derivative of the residual on a frozen pairing.

**Question.** Along eight random directions, does the tangent give the same change as differences of the residual?

**Why it matters.** A wrong term in the tangent does not change the result, so no patch test finds it. It costs
iterations, and makes an analysis diverge where the right tangent converges.

**How it is judged.** The pairing stays frozen, so the residual is smooth. Two conditions hold together, since an
error of 1e-3 in one entry still has a Taylor slope of 2, and a central difference has an error of its own:

- The best central difference over three steps differs by at most 30 (uS/ℓ)^(2/3), relative to the largest derivative.
- The Taylor remainder |R(x+hd) − R − hKd| falls with a slope of at least 1.9. A remainder at roundoff is exact.

Where the plugin takes complex positions, a complex step differs by at most 1e-11 + 64 uS/ℓ. Where the residual itself
bends over a length λ < ℓ, as a segment seen nearly edge-on does, a failing case is judged again with λ in place of ℓ.

**Undecided.** A failing case is undecided near a kink that the pairing does not freeze, or where the residual bends
over less than ℓ/1024. A pairing that is another one wherever the nodes move holds numbers and not decisions; that
fails.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, permutations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import Pairing
from contactverif.contract.property import Measurement, Property, Quantity, Verdict, judge
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.strategies import smooth_cases
from contactverif_properties.shared.any_state import prepare_state
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.directions import random_directions
from contactverif_properties.shared.kinks import find_kink

N_DIRECTIONS = 8
CENTRAL_STEPS = (8.0, 1.0, 0.125)  # Steps over the one at which truncation and roundoff are equal.
TAYLOR_STEPS = (2.0**-8, 2.0**-12)  # Steps over ℓ.
STEP_RATIO = 8.0  # A slope is taken between two steps only if one is so many times the other.
SHORTEST_BENDING = 2.0**-10  # Over less than this share of ℓ, differences decide nothing.
SLOPE = 1.9

CENTRAL = Quantity(
    "error against a central difference",
    "1",
    "30 (uS/ℓ)^(2/3)",
    "Truncation (h/ℓ)² and roundoff uS/h are equal at h = ℓ (uS/ℓ)^(1/3). The factor 30 is for the third derivative.",
)
TAYLOR = Quantity(
    "slope of the Taylor remainder",
    "1",
    "1.9",
    "The remainder |R(x+hd) − R − hKd| falls like h², less what is left of h³.",
    "at least",
)
COMPLEX = Quantity(
    "error against a complex step",
    "1",
    "1e-11 + 64 uS/ℓ",
    "A complex step has no truncation. Rounding the ends of a segment turns it by uS/ℓ.",
)


def measure_directional(case: Case, subject: Subject) -> Measurement:
    """Compare the tangent along eight random directions with differences of the residual, all states in one batch.

    Parameters
    ----------
    case : Case
        A random state that is not made to lie at a kink.
    subject : Subject
        A formulation with a tangent.

    Returns
    -------
    Measurement
        The best central difference over the steps in the worst direction, relative to the largest derivative. The least
        slope of the Taylor remainder; missing where all remainders are roundoff, or the residual itself has no such
        slope, as across a kink that no pairing freezes. The complex step where the plugin takes complex positions.
        Detail: the length that served as ℓ.
    """
    formulation, case = prepare_state(case, subject)
    shortest = case.shortest_segment
    pairing = formulation.pair(case.interface, case.z)
    directions = random_directions(case.seed, N_DIRECTIONS, case.z.size)
    derivative = (formulation.tangent(case.interface, pairing, case.z) @ directions.T).T  # (n_directions, n_unknowns)
    undecided, broken = _check_pairing(case, formulation, pairing, directions[0])

    def measure_over(length: float) -> tuple[Measurement, float]:
        values, bending = compare_differences(formulation, case, pairing, directions, derivative, length)
        conditioning = UNIT_ROUNDOFF * case.largest_coordinate / length
        tolerances = {
            CENTRAL.name: 30 * conditioning ** (2 / 3),
            TAYLOR.name: SLOPE,
            COMPLEX.name: 1e-11 + 64 * conditioning,
        }
        if subject.traits.takes_complex:
            values[COMPLEX.name] = complex_step_error(formulation, case, pairing, directions, derivative)
        measurement = Measurement(values, tolerances, undecided, broken, {"length": length}, idle=bending == np.inf)
        return measurement, bending

    first, bending = measure_over(shortest)
    if bending >= shortest / 2 or judge(TANGENT_DIRECTIONAL, first)[0] is not Verdict.FAIL:
        return first
    second, _ = measure_over(max(bending, SHORTEST_BENDING * shortest))
    if bending < SHORTEST_BENDING * shortest and not undecided:
        return replace(second, undecided=f"roundoff: the residual bends over {bending:.2g}, too short for differences")
    return second


def compare_differences(
    formulation: CheckedFormulation,
    case: Case,
    pairing: Pairing | None,
    directions: FloatArray,
    derivative: Array,
    length: float,
) -> tuple[dict[str, float], float]:
    """Compare derivatives with central differences and Taylor remainders.

    Parameters
    ----------
    formulation : CheckedFormulation
        The formulation that is judged.
    case : Case
        The state x.
    pairing : Pairing | None
        The frozen pairing.
    directions : FloatArray, shape (n_directions, n_unknowns)
        The directions d.
    derivative : Array, shape (n_directions, n_unknowns)
        The tangent times each direction.
    length : float
        The length over which the residual is taken to bend; steps are shares of it.

    Returns
    -------
    values : dict[str, float]
        The values of CENTRAL and TAYLOR.
    bending : float
        The length over which the residual is seen to bend: the root of its size over its third derivative, from the
        central differences of two steps. The tangent plays no part in it.
    """
    reach = case.largest_coordinate
    central = np.array(CENTRAL_STEPS) * length * (UNIT_ROUNDOFF * reach / length) ** (1 / 3)
    taylor = np.array(TAYLOR_STEPS) * length
    steps = np.concatenate([central, -central, taylor])
    batch = case.z + steps[:, None, None] * directions  # (n_steps, n_directions, n_unknowns)
    states = np.concatenate([batch.reshape(-1, case.z.size), case.z[None]])
    forces = formulation.residual(case.interface, pairing, states)
    here, moved = forces[-1], forces[:-1].reshape(batch.shape)

    n = len(central)
    slopes = (moved[:n] - moved[n : 2 * n]) / (2 * central[:, None, None])
    size = max(np.abs(derivative).max(), np.abs(slopes).max())
    if size == 0:
        return {CENTRAL.name: 0.0}, np.inf
    errors = np.abs(slopes - derivative).max(axis=2)  # (n_steps, n_directions)
    values = {CENTRAL.name: float(errors.min(axis=0).max() / size)}
    forward = np.r_[0, 2 * n : 2 * n + len(taylor)]  # The longest central step serves here too.
    remainders = np.abs(moved[forward] - here - steps[forward, None, None] * derivative).max(axis=2)
    floor = 1e3 * UNIT_ROUNDOFF * reach * size
    slope = taylor_slope(remainders, steps[forward], floor)
    if slope < SLOPE:  # If the best difference as derivative gives no better slope, the residual is not smooth.
        best = np.take_along_axis(slopes, errors.argmin(axis=0)[None, :, None], axis=0)[0]
        smooth = np.abs(moved[forward] - here - steps[forward, None, None] * best).max(axis=2)
        if taylor_slope(smooth, steps[forward], floor) < SLOPE:
            slope = np.inf
    if np.isfinite(slope):
        values[TAYLOR.name] = slope
    third = np.abs(slopes[0] - slopes[1]).max() / (central[0] ** 2 - central[1] ** 2)  # The third derivative over 6.
    return values, float(np.sqrt(size / third)) if third > 0 else np.inf


def taylor_slope(remainders: FloatArray, steps: FloatArray, floor: float) -> float:
    """Return the slope of log |remainder| over log h: the best between two steps, the worst over the directions.

    Two steps count only where one is `STEP_RATIO` times the other: between two that are nearly equal, the slope is
    noise.

    Parameters
    ----------
    remainders : FloatArray, shape (n_steps, n_directions)
        Taylor remainders.
    steps : FloatArray, shape (n_steps,)
        Their steps h, in any order.
    floor : float
        A remainder below it is roundoff. A direction that has no slope because of that is exact.

    Returns
    -------
    float
        The slope, infinite where all directions are exact.
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


def complex_step_error(
    formulation: CheckedFormulation, case: Case, pairing: Pairing | None, directions: FloatArray, derivative: Array
) -> float:
    """Return the largest difference of Im R(x + ihd)/h from the derivative, relative to the larger of the two.

    The step h is so small that h² vanishes. The parameters are those of `compare_differences`.
    """
    h = case.shortest_segment * 2.0**-100
    forces = formulation.residual(case.interface, pairing, case.z + 1j * h * directions)
    exact = forces.imag / h
    size = float(max(np.abs(exact).max(), np.abs(derivative).max()))
    return float(np.abs(exact - derivative).max()) / size if size > 0 else 0.0


def _check_pairing(
    case: Case, formulation: CheckedFormulation, pairing: Pairing | None, direction: FloatArray
) -> tuple[str, str]:
    """Return why the pairing makes a failure undecided, and how it breaks the contract; both empty if it does neither.

    A pairing that is another one at every place, however near, holds numbers and not decisions, and on such a pairing
    no difference shows a missing term. A pairing that changes here and there, as ties by roundoff do, is no breach.
    """
    shortest = case.shortest_segment
    step = CENTRAL_STEPS[-1] * shortest * (UNIT_ROUNDOFF * case.largest_coordinate / shortest) ** (1 / 3)
    if pairing is not None and _is_same_around(formulation, case, pairing, step * direction):
        return "", ""
    undecided = find_kink(case, formulation, pairing, 4 * step, direction)
    if undecided or pairing is None:
        return undecided, ""
    if all(_is_steady(formulation, case, sign * 2.0**-10 * step * direction) for sign in (1, -1)):
        return "a kink: the pairing changes here, and is steady on either side", ""
    if all(_is_restless(formulation, case, scale * step * direction) for scale in (1, 2.0**-5, 2.0**-10)):
        return "", "the pairing is another one wherever the nodes move: it holds numbers, not decisions"
    return "", ""


def _is_same_around(formulation: CheckedFormulation, case: Case, pairing: Pairing, shift: FloatArray) -> bool:
    """Return whether the states at both ends of the shift have this pairing."""
    return all(formulation.pair(case.interface, case.z + sign * shift) == pairing for sign in (1, -1))


def _is_steady(formulation: CheckedFormulation, case: Case, shift: FloatArray) -> bool:
    """Return whether the pairing stays the same from one small shift to the next, as it does beside a kink."""
    beside = [formulation.pair(case.interface, case.z + times * shift) for times in (1, 2, 3)]
    return beside[0] == beside[1] == beside[2]


def _is_restless(formulation: CheckedFormulation, case: Case, shift: FloatArray) -> bool:
    """Return whether no two of some neighbouring states, on either side, have the same pairing."""
    pairings = [formulation.pair(case.interface, case.z + times * shift) for times in range(-2, 4)]
    return all(first != second for first, second in combinations(pairings, 2))


TANGENT_DIRECTIONAL = Property(
    id="tangent.directional",
    family="tangent",
    summary="The tangent is the derivative of the residual on a frozen pairing.",
    quantities=(CENTRAL, TAYLOR, COMPLEX),
    cases=smooth_cases,
    measure=measure_directional,
    promise=lambda traits: None if traits.tangent is None else traits.tangent == "exact",
    needs=frozenset({"tangent"}),
    applicable=refuse_barrier,
)
