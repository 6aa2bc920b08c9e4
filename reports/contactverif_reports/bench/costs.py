"""The cost of an error: the three numbers on the coarsest mesh that reaches it, for each instance of a scene.

An instance that no mesh brings below the error counts as never, as COCO counts it; it is never left out. A ratio is
that of a formulation to `REFERENCE` on the instances that both bring there.

References
----------
Hansen et al., Optim. Methods Softw. 36 (2021) 114–144 (COCO: instances, targets, runtime distributions).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif_reports.bench.intervals import Ratio, ratio_of
from contactverif_reports.bench.results import BEST, VARIANTS, WORK, BenchResults

REFERENCE = "vts-ppt"
NUMBERS = {
    "evaluation": "seconds of one evaluation",
    "systems": "linear systems",
    "factorisation": "seconds of one factorisation",
}
# What one linear system costs the reader over one evaluation of the reference, and what such bodies are called.
BODIES: Mapping[str, float] = {"cheap bodies": 0.1, "even bodies": 1.0, "dear bodies": 10.0}
ROUNDOFF = 1e-12  # Smaller errors are roundoff.
_RULE = (0,)  # The place of `RULE` in `VARIANTS`


@dataclass(frozen=True, slots=True, eq=False)
class Cost:
    """The cost of an error on the instances of a scene; NaN on an instance that does not get there."""

    evaluation: FloatArray  # (n_instances, n_processes) seconds of one evaluation
    systems: FloatArray  # (n_instances, 1) the number of linear systems
    factorisation: FloatArray  # (n_instances, 1) seconds of one factorisation
    factors: FloatArray  # (n_instances, 1) nonzeros of the factors
    segments: FloatArray  # (n_instances, 1) slave segments of the mesh

    @property
    def reached(self) -> BoolArray:
        """True (n_instances,) for an instance that gets there."""
        return ~np.isnan(self.segments[:, 0])

    @property
    def is_usual(self) -> bool:
        """True if at least half of the instances get there."""
        return bool(self.reached.mean() >= 0.5)

    def middle(self, number: str) -> float:
        """Return the median of a number over the instances that get there; infinite if fewer than half do."""
        return float(np.nanmedian(getattr(self, number))) if self.is_usual else inf


def cost_of(
    results: BenchResults,
    formulation: str,
    scene: str,
    target: float,
    *,
    kind: str = "forces",
    variants: Sequence[int] = _RULE,
) -> Cost:
    """Return what an error costs a formulation, at the penalty of the rule or at the best of some variants.

    The coarsest mesh that gets there counts, and of its variants the one with the fewest linear systems.
    """
    row, ladders = results.formulations.index(formulation), results.ladders(scene)  # (n_instances, n_meshes)
    errors = results.errors_of(formulation, kind)[:, variants][ladders]  # (n_instances, n_meshes, n_variants)
    iterations = results.counts_of(formulation, "iterations")[:, variants][ladders].astype(np.float64)
    least = np.where(errors <= target, iterations, inf).min(axis=-1)  # (n_instances, n_meshes)
    mesh: IntArray = np.isfinite(least).argmax(axis=1)
    numbers = np.arange(len(ladders))
    cells, systems = ladders[numbers, mesh], least[numbers, mesh]
    never = np.isinf(systems)[:, None]

    def pick(values: FloatArray) -> FloatArray:
        return np.where(never, nan, values.reshape(len(ladders), -1))

    factors = results.work[row, cells, list(WORK).index("factor_nonzeros")].astype(np.float64)
    return Cost(
        evaluation=pick(results.evaluation[row, cells]),
        systems=pick(systems),
        factorisation=pick(results.factorisation[row, cells]),
        factors=pick(factors),
        segments=pick(results.segments[cells].astype(np.float64)),
    )


def best_of(results: BenchResults, formulation: str, scene: str, target: float) -> Cost:
    """Return what an error costs at the penalty that is the best afterwards."""
    return cost_of(results, formulation, scene, target, variants=BEST)


def cost_ratio(cost: Cost, reference: Cost, number: str) -> Ratio:
    """Return the ratio of a number to that of the reference.

    It is infinite if the formulation does not bring half of the instances there, NaN if the reference does not.
    """
    if not reference.is_usual:
        return Ratio(nan)
    return ratio_of(getattr(cost, number), getattr(reference, number)) if cost.is_usual else Ratio(inf)


def total_ratio(cost: Cost, reference: Cost, share: float) -> Ratio:
    """Return the ratio of whole solutions for a reader whose linear systems cost `share` evaluations of the reference.

    A solution is linear systems × (evaluation + system). Systems cost as much as their factorisations do here.
    """
    if not reference.is_usual:
        return Ratio(nan)
    if not cost.is_usual:
        return Ratio(inf)
    unit = share * reference.evaluation.mean(axis=1, keepdims=True) / reference.factorisation
    totals = [each.systems * (each.evaluation + unit * each.factorisation) for each in (cost, reference)]
    return ratio_of(*totals)


def runtimes(results: BenchResults, formulation: str, scene: str, number: str) -> FloatArray:
    """Return the seconds (n,) of all evaluations, or of all factorisations, to each target on each instance.

    They are infinite where a target is not reached.
    """
    parts = []
    for target in results.targets[scene]:
        cost = cost_of(results, formulation, scene, target)
        seconds = (cost.systems * getattr(cost, number)).mean(axis=1)
        parts.append(np.where(cost.reached, seconds, inf))
    return np.concatenate(parts)


def curve(
    results: BenchResults, formulation: str, scene: str, kind: str, number: str, variants: Sequence[int] = _RULE
) -> tuple[FloatArray, FloatArray]:
    """Return a number and the least error over variants, both medians over instances, on each mesh (n_meshes,).

    The error is infinite where fewer than half of the instances have a solution. The number is that of those that have
    one: an instance without a solution has no factorisation.
    """
    row, ladders = results.formulations.index(formulation), results.ladders(scene)
    errors = results.errors_of(formulation, kind)[:, variants].min(axis=1)[ladders]
    values = results.evaluation[row].mean(axis=1) if number == "evaluation" else results.factorisation[row]
    with np.errstate(invalid="ignore"):
        errors = np.maximum(np.median(errors, axis=0), ROUNDOFF)
    solved = [column[np.isfinite(column)] for column in values[ladders].T]
    return np.array([np.median(column) if column.size else nan for column in solved]), errors


def rank(results: BenchResults, scene: str) -> list[str]:
    """Return the formulations: those that reach the smallest targets first, and of those the ones with few seconds."""
    targets = results.targets[scene]

    def key(name: str) -> tuple[int, float]:
        costs = [cost_of(results, name, scene, target) for target in targets]
        reached = [place for place, cost in enumerate(costs) if cost.is_usual]
        return (-max(reached), costs[max(reached)].middle("evaluation")) if reached else (1, inf)

    return sorted(results.formulations, key=key)


def iterations_by_start(results: BenchResults, formulation: str, scene: str, variant: int) -> list[str]:
    """Return the range of linear systems on each mesh of a scene, as "5–7"; "2 fail" stands behind it."""
    row, texts = results.formulations.index(formulation), []
    for cells in results.ladders(scene).T:
        failed = results.outcomes[row, cells, variant] != 0
        solved = results.counts_of(formulation, "iterations")[cells, variant][~failed]
        low, high = (int(solved.min()), int(solved.max())) if len(solved) else (0, 0)
        text = (f"{low}" if low == high else f"{low}–{high}") if len(solved) else ""
        texts.append(f"{text} {failed.sum()} fail".strip() if failed.any() else text)
    return texts


def start_names() -> dict[str, int]:
    """Return {start: number of the variant} at the penalty of the rule."""
    penalty = VARIANTS[0].penalty
    return {variant.start: number for number, variant in enumerate(VARIANTS) if variant.penalty == penalty}
