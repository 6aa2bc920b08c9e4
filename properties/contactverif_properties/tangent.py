"""Is the tangent the derivative of the residual? Differences on a frozen pairing, where the residual is smooth.

Source: verification 13; the two conditions together, since an error of 1e-3 in one entry has a Taylor slope of 2, and a
central difference alone has an error of its own.
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
from contactverif_properties.anywhere import no_barrier, posed
from contactverif_properties.kinks import kink_within

N_DIRECTIONS = 8
CENTRAL_STEPS = (8.0, 1.0, 0.125)  # × the step at which truncation and roundoff of a central difference are equal
TAYLOR_STEPS = (2.0**-8, 2.0**-12)  # × ℓ
APART = 8.0  # how many times longer one step of a slope must be than the other
SHORTEST_BENDING = 2.0**-10  # × ℓ: over less than this, differences decide nothing
SLOPE = 1.9

CENTRAL = Quantity(
    "central difference",
    "1",
    "30 (uS/ℓ)^(2/3)",
    "truncation (h/ℓ)² and roundoff uS/h are equal at h = ℓ (uS/ℓ)^(1/3); 30 is for the third derivative",
)
TAYLOR = Quantity(
    "Taylor slope", "1", "1.9", "|R(x+hd) − R − hKd| falls like h²; 2 less what is left of h³", "at least"
)
COMPLEX = Quantity(
    "complex step",
    "1",
    "1e-11 + 64 uS/ℓ",
    "a complex step has no truncation; rounding the ends of a segment turns it by uS/ℓ",
)


def directional(case: Case, subject: Subject) -> Measurement:
    """Tangent times eight random directions against differences of the residual, all states in one batch.

    Steps are shares of ℓ, the shortest segment. Where the differences themselves show that the residual bends over a
    shorter length λ (a segment seen nearly edge-on is as short as it is seen), and only where they fail, a second look
    takes λ for ℓ in steps and tolerances.

    Returns
    -------
    Measurement
        Best central difference over the steps, worst direction, relative to the largest derivative; least slope of the
        Taylor remainder (none where all remainders are roundoff, or the residual itself has no
        such slope, as across a kink that no pairing freezes); the complex step where the plugin takes complex
        positions. Detail: the length that took the place of ℓ.
    """
    formulation, case = posed(case, subject)
    shortest = case.shortest_segment
    pairing = formulation.pair(case.interface, case.z)
    directions = random_directions(case)
    derivative = (formulation.tangent(case.interface, pairing, case.z) @ directions.T).T  # (n_directions, n_unknowns)
    undecided, broken = _why_undecided(case, formulation, pairing, directions[0])

    def look(length: float) -> tuple[Measurement, float]:
        values, bending = differences(formulation, case, pairing, directions, derivative, length)
        conditioning = UNIT_ROUNDOFF * case.largest_coordinate / length
        tolerances = {
            CENTRAL.name: 30 * conditioning ** (2 / 3),
            TAYLOR.name: SLOPE,
            COMPLEX.name: 1e-11 + 64 * conditioning,
        }
        if subject.traits.takes_complex:
            values[COMPLEX.name] = complex_step(formulation, case, pairing, directions, derivative)
        measured = Measurement(values, tolerances, undecided, broken, {"length": length}, idle=bending == np.inf)
        return measured, bending

    first, bending = look(shortest)
    if bending >= shortest / 2 or judge(DIRECTIONAL, first)[0] is not Verdict.FAIL:
        return first
    second, _ = look(max(bending, SHORTEST_BENDING * shortest))
    if bending < SHORTEST_BENDING * shortest and not undecided:
        return replace(second, undecided=f"roundoff: the residual bends over {bending:.2g}, too short for differences")
    return second


def differences(
    formulation: CheckedFormulation,
    case: Case,
    pairing: Pairing | None,
    directions: FloatArray,
    derivative: Array,
    length: float,
) -> tuple[dict[str, float], float]:
    """Central differences and Taylor remainders with steps that suit a function that bends over `length`.

    Returns
    -------
    The values of CENTRAL and TAYLOR, and the length over which the residual is seen to bend: the root of its size over
    its third derivative, from the central differences of two steps, which the tangent has no part in.
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
    forward = np.r_[0, 2 * n : 2 * n + len(taylor)]  # the longest central step serves here too
    remainders = np.abs(moved[forward] - here - steps[forward, None, None] * derivative).max(axis=2)
    floor = 1e3 * UNIT_ROUNDOFF * reach * size
    slope = taylor_slope(remainders, steps[forward], floor)
    if slope < SLOPE:  # against the residual's own derivative: where that is no better, the residual is not smooth
        own = np.take_along_axis(slopes, errors.argmin(axis=0)[None, :, None], axis=0)[0]
        smooth = np.abs(moved[forward] - here - steps[forward, None, None] * own).max(axis=2)
        if taylor_slope(smooth, steps[forward], floor) < SLOPE:
            slope = np.inf
    if np.isfinite(slope):
        values[TAYLOR.name] = slope
    third = np.abs(slopes[0] - slopes[1]).max() / (central[0] ** 2 - central[1] ** 2)  # third derivative / 6
    return values, float(np.sqrt(size / third)) if third > 0 else np.inf


def _why_undecided(
    case: Case, formulation: CheckedFormulation, pairing: Pairing | None, direction: FloatArray
) -> tuple[str, str]:
    """Whether the frozen pairing is that of the states around: (why undecided, what is broken), empty if it is.

    A pairing that is another at every place, however near, holds numbers and not decisions, and on such a one no
    difference shows what is missing. One that changes its mind here and there, as ties by roundoff do, is no breach.
    """
    shortest = case.shortest_segment
    step = CENTRAL_STEPS[-1] * shortest * (UNIT_ROUNDOFF * case.largest_coordinate / shortest) ** (1 / 3)
    if pairing is not None and _same_around(formulation, case, pairing, step * direction):
        return "", ""
    undecided = kink_within(case, formulation, pairing, 4 * step, direction)
    if undecided or pairing is None:
        return undecided, ""
    if all(_steady(formulation, case, way * 2.0**-10 * step * direction) for way in (1, -1)):
        return "a kink: the pairing changes here, and is steady on either side", ""
    if all(_restless(formulation, case, scale * step * direction) for scale in (1, 2.0**-5, 2.0**-10)):
        return "", "the pairing is another one wherever the nodes move: it holds numbers, not decisions"
    return "", ""


def random_directions(case: Case) -> FloatArray:
    """Eight directions (8, n_unknowns), entries in [−1, 1], the largest of each 1."""
    directions = np.random.default_rng(case.seed).uniform(-1, 1, (N_DIRECTIONS, case.z.size))
    scaled: FloatArray = directions / np.abs(directions).max(axis=1, keepdims=True)
    return scaled


def taylor_slope(remainders: FloatArray, steps: FloatArray, floor: float) -> float:
    """Slope of log |remainder| against log h: the best between two steps, the worst over the directions.

    `remainders` is (n_steps, n_directions), `steps` (n_steps,), in any order. A remainder below `floor` is roundoff: a
    direction of which that leaves no slope is exact, and infinity stands for all of them being so. Two steps count only
    where one is `APART` times the other: between two that are nearly equal, the slope is noise.
    """
    best = np.full(remainders.shape[1], -np.inf)
    decided = np.zeros(remainders.shape[1], dtype=bool)
    for long, short in permutations(range(len(steps)), 2):
        if steps[long] < APART * steps[short]:
            continue
        told = remainders[short] > floor
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.log(remainders[long] / remainders[short]) / np.log(steps[long] / steps[short])
        best = np.where(told, np.maximum(best, slope), best)
        decided |= told
    return float(best[decided].min(initial=np.inf))


def complex_step(
    formulation: CheckedFormulation, case: Case, pairing: Pairing | None, directions: FloatArray, derivative: Array
) -> float:
    """Largest difference of Im R(x + ihd)/h from the derivative, relative to it; h so small that h² vanishes."""
    h = case.shortest_segment * 2.0**-100
    forces = formulation.residual(case.interface, pairing, case.z + 1j * h * directions)
    exact = forces.imag / h
    size = float(max(np.abs(exact).max(), np.abs(derivative).max()))
    return float(np.abs(exact - derivative).max()) / size if size > 0 else 0.0


def _same_around(formulation: CheckedFormulation, case: Case, pairing: Pairing, shift: FloatArray) -> bool:
    return all(formulation.pair(case.interface, case.z + way * shift) == pairing for way in (1, -1))


def _steady(formulation: CheckedFormulation, case: Case, shift: FloatArray) -> bool:
    """Whether the pairing stays the same from one small shift to the next, as it does beside a kink."""
    beside = [formulation.pair(case.interface, case.z + times * shift) for times in (1, 2, 3)]
    return beside[0] == beside[1] == beside[2]


def _restless(formulation: CheckedFormulation, case: Case, shift: FloatArray) -> bool:
    """Whether no two of some neighbouring states, on either side, have the same pairing."""
    found = [formulation.pair(case.interface, case.z + times * shift) for times in range(-2, 4)]
    return all(one != other for one, other in combinations(found, 2))


DIRECTIONAL = Property(
    id="tangent.directional",
    family="tangent",
    summary="the tangent is the derivative of the residual on a frozen pairing",
    quantities=(CENTRAL, TAYLOR, COMPLEX),
    cases=smooth_cases,
    measure=directional,
    promise=lambda traits: None if traits.tangent is None else traits.tangent == "exact",
    needs=frozenset({"tangent"}),
    applicable=no_barrier,
)
