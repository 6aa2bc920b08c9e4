"""Conclusions from a bench: Pareto fronts, the time to reach an error, and performance profiles.

A run that fails counts with an infinite time and an infinite error, as COCO counts it; it is never left out.

References
----------
Dolan & Moré, Math. Program. 91 (2002) 201–213 (performance profiles); Gould & Scott, ACM Trans. Math. Software 43
(2016) 15 (why profiles are read in pairs); Hansen et al., Optim. Methods Softw. 36 (2021) 114–144 (COCO).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif_reports.bench.results import RANDOM, BenchResults, Outcome

REFERENCE = "vts-ppt"
TARGETS = (1e-1, 1e-2, 1e-3)
MOST_NAMES = 6  # A sentence names no more formulations than these; the table has all.
SENTENCE_TARGET = 1e-2  # The error of the sentence that says who costs how much.
ROUNDOFF = 1e-12  # Smaller errors are roundoff.
ACCURATE = 1e-2  # A random scene is solved if the error of the forces is at most this.


def pareto_front(times: FloatArray, errors: FloatArray) -> BoolArray:
    """Return which runs (n,) no other run beats in time and error at once; both are finite on the front."""
    finite = np.isfinite(times) & np.isfinite(errors)
    front = np.zeros(len(times), dtype=np.bool_)
    least = inf
    for index in np.lexsort((errors, times)):
        if finite[index] and errors[index] < least:
            front[index], least = True, float(errors[index])
    return front


def time_to_reach(
    results: BenchResults, formulation: str, scene: str, target: float, kind: str = "forces", part: str = "total"
) -> float:
    """Return the time of the cheapest run on a scene, over meshes and penalties, whose error is at most the target."""
    reached = results.cells_of(scene) & (results.errors_of(formulation, kind) <= target)
    return float(results.times(formulation, part)[reached].min(initial=inf))


def cost_ratio(results: BenchResults, formulation: str, scene: str, reference: str = REFERENCE) -> float:
    """Return the time to an error of 1 % in the forces over that of the reference.

    It is infinite if the formulation never reaches the error, NaN if the reference does not, or is not there.
    """
    if reference not in results.formulations:
        return np.nan
    time, other = (time_to_reach(results, name, scene, SENTENCE_TARGET) for name in (formulation, reference))
    return time / other if isfinite(other) else np.nan


@dataclass(frozen=True, slots=True, eq=False)
class PairProfile:
    """The performance profile of a formulation and the reference, the two alone."""

    formulation: str  # The two.
    reference: str
    # (n_scenes,) The time of the formulation over that of the faster one of both, on each random scene; infinite where
    # it fails.
    factors: FloatArray
    reference_factors: FloatArray  # (n_scenes,) The same of the reference.

    def share(self, factor: float) -> float:
        """Return the share of scenes that the formulation solves within a factor of the faster one of both."""
        return float((self.factors <= factor).mean())

    @property
    def share_solved(self) -> float:
        """The share of scenes that the formulation solves."""
        return float(np.isfinite(self.factors).mean())

    @property
    def median_ratio(self) -> float:
        """The median of the ratio of both times, over the scenes that both solve; NaN if there is none."""
        both = np.isfinite(self.factors) & np.isfinite(self.reference_factors)
        return float(np.median((self.factors / self.reference_factors)[both])) if both.any() else np.nan


def pair_profiles(results: BenchResults, reference: str = REFERENCE) -> tuple[PairProfile, ...]:
    """Return the profile of each formulation beside the reference, over the random scenes that have a solution.

    A scene counts as solved if the forces are exact up to `ACCURATE`.
    """
    selection = results.cells_of(RANDOM)
    if reference not in results.formulations or not selection.any():
        return ()
    times = {name: _times_of_accurate(results, name)[selection] for name in results.formulations}
    profiles = []
    for name in results.formulations:
        if name != reference:
            best = np.minimum(times[name], times[reference])
            factors = [_over(values, best) for values in (times[name], times[reference])]
            profiles.append(PairProfile(name, reference, *factors))
    return tuple(profiles)


def _times_of_accurate(results: BenchResults, formulation: str) -> FloatArray:
    accurate = results.errors_of(formulation) <= ACCURATE
    return np.where(accurate, results.times(formulation), np.inf)


def _over(values: FloatArray, best: FloatArray) -> FloatArray:
    """Return values over the best; infinite where there is no best."""
    ratios: FloatArray = np.divide(values, best, where=np.isfinite(values), out=np.full(len(values), np.inf))
    return ratios


def cost_sentence(results: BenchResults, scene: str, names: Sequence[str] | None = None) -> str:
    """Return one sentence: at an error of 1 %, what others cost beside the reference."""
    others = [name for name in (names or results.formulations) if name != REFERENCE]
    if REFERENCE not in results.formulations or not others:
        return ""
    ratios = {name: cost_ratio(results, name, scene) for name in others}
    if all(np.isnan(ratio) for ratio in ratios.values()):
        return f"On {scene}, {REFERENCE} does not reach an error of 1 % in the forces."
    return _put_in_words(scene, ratios)


def harness_share(results: BenchResults, formulation: str) -> float:
    """Return the share of the time of all solutions in which neither plugin nor linear solver works; NaN for none."""
    row = results.formulations.index(formulation)
    *parts, total = results.fastest[row, results.outcomes[row] == Outcome.SOLVED].sum(axis=0)  # As in PARTS.
    return float(1 - sum(parts) / total) if total > 0 else np.nan


def harness_sentence(results: BenchResults) -> str:
    """Return one sentence on how much of a time is not the formulation's; empty without the reference."""
    if REFERENCE not in results.formulations or np.isnan(share := harness_share(results, REFERENCE)):
        return ""
    return (
        f"Of the time of {REFERENCE}, {100 * (1 - share):.0f} % goes into its own calls and the linear "
        "systems, and the rest into the harness. So these ratios are nearer to 1 than those of the formulations alone."
    )


def _put_in_words(scene: str, ratios: Mapping[str, float]) -> str:
    """Return the sentence of the ratios {formulation: time over that of the reference}."""
    costs = [f"{name} {ratio:.2g}" for name, ratio in sorted(ratios.items(), key=lambda pair: pair[1]) if ratio < inf]
    never = [name for name, ratio in ratios.items() if ratio == inf]
    text = f"On {scene}, at an error of 1 % in the forces"
    if len(costs) > MOST_NAMES:
        last = costs[-1].rpartition(" ")[2]
        costs[MOST_NAMES - 1 :] = [f"{len(costs) - MOST_NAMES + 1} more up to {last}"]
    if costs:
        text += f", the time over that of {REFERENCE} is: {', '.join(costs)}"
    if len(never) > MOST_NAMES:
        text += f"; {len(never)} of {len(ratios) + 1} formulations never get there"
    elif never:
        text += f"; {', '.join(never)} never get there" if len(never) > 1 else f"; {never[0]} never gets there"
    return f"{text}."


def figure_sentence(results: BenchResults, scene: str, kind: str = "forces") -> str:
    """Return one sentence on what a figure of error against time shows: who is exact, and who is quick."""
    cells = results.cells_of(scene)
    best = {name: float(np.fmin.reduce(results.errors_of(name, kind)[cells])) for name in results.formulations}
    best = {name: inf if np.isnan(error) else error for name, error in best.items()}
    exact = min(best, key=lambda name: best[name])
    if best[exact] == inf:
        return f"No formulation has an error of the {kind} on {scene}."
    text = f"The smallest error of the {kind} is {max(best[exact], ROUNDOFF):.1g}, by {exact}"
    times = {name: time_to_reach(results, name, scene, SENTENCE_TARGET, kind) for name in results.formulations}
    quick = min(times, key=lambda name: times[name])
    if times[quick] == inf:
        return f"{text}; no formulation reaches 1 %."
    n_reached = sum(time < inf for time in times.values())
    return f"{text}; {quick} is the first of {n_reached} to reach 1 %, after {1e3 * times[quick]:.3g} ms."
