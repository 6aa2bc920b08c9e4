"""Conclusions from a bench: the cost of an error, ratios with intervals, tables, sentences, changes.

An instance that no mesh brings below the error counts as never, as COCO counts it; it is never left out. A ratio is
that of a formulation to `REFERENCE` on the instances that both bring there. A sentence has only ratios whose interval
excludes 1, and says of which formulations nothing is known.

References
----------
Hansen et al., Optim. Methods Softw. 36 (2021) 114–144 (COCO: instances, targets, runtime distributions).
Efron & Tibshirani, An Introduction to the Bootstrap (1993), Chapter 13 (percentile intervals).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isinf, isnan, nan
from operator import attrgetter

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif_reports.bench_results import BEST, COUNTS, RULE, VARIANTS, WORK, BenchResults
from contactverif_reports.tables import Column, Table, numbers

REFERENCE = "vts-ppt"
NUMBERS = {
    "evaluation": "seconds of one evaluation",
    "systems": "linear systems",
    "factorisation": "seconds of one factorisation",
}
# What one linear system costs the reader over one evaluation of the reference, and what such bodies are called.
BODIES: Mapping[str, float] = {"cheap bodies": 0.1, "even bodies": 1.0, "dear bodies": 10.0}
ROUNDOFF = 1e-12  # Smaller errors are roundoff.
ALIKE = 0.05  # Two formulations are as fast if the whole interval of their ratio is this near to 1.
MOST_CURVES = 6  # More curves in one panel cannot be told apart.
_MOST_NAMES = 4  # A sentence names no more formulations of a kind than these; the table has all.
_RESAMPLES = 2000
_LEAST = 5  # Fewer instances give no interval.
_SEED = 27


@dataclass(frozen=True, slots=True)
class Ratio:
    """A ratio with its interval of 95 %."""

    middle: float  # Infinite if the formulation does not get there; NaN if the reference does not.
    low: float = nan  # NaN where there is no interval.
    high: float = nan

    @property
    def word(self) -> str:
        """The conclusion: as fast, faster, slower, or not told apart; "never" and nothing where there is no ratio."""
        if isnan(self.middle):
            return ""
        if isinf(self.middle):
            return "never"
        if self.low >= 1 / (1 + ALIKE) and self.high <= 1 + ALIKE:
            return "as fast"
        return "slower" if self.low > 1 else "faster" if self.high < 1 else "not told apart"

    @property
    def text(self) -> str:
        """The ratio with its interval, as "1.10 [1.08, 1.11]"; ∞ or a dash where there is none."""
        if isnan(self.middle) or isinf(self.middle):
            return "–" if isnan(self.middle) else "∞"
        digits = 0 if self.middle >= 100 else 1 if self.middle >= 10 else 2
        interval = "" if isnan(self.low) else f" [{self.low:.{digits}f}, {self.high:.{digits}f}]"
        return f"{self.middle:.{digits}f}{interval}"


def ratio_of(values: FloatArray, others: FloatArray) -> Ratio:
    """Return the ratio of positive values (n_instances, n_processes) to those of another on the same instances.

    It is a geometric mean over both, and the interval resamples both: within one process of a plugin intervals are too
    narrow, and those of two processes may exclude one another. Entries that are not finite are left out with their
    whole instance.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        logarithms = np.log(values) - np.log(others)
    logarithms = logarithms[np.isfinite(logarithms).all(axis=1)]
    n_instances, n_processes = logarithms.shape
    if not n_instances:
        return Ratio(nan)
    middle = float(np.exp(logarithms.mean()))
    if n_instances < _LEAST:
        return Ratio(middle)
    dice = np.random.default_rng(_SEED)
    shares = [dice.multinomial(n, np.full(n, 1 / n), _RESAMPLES) / n for n in (n_instances, n_processes)]
    means = np.einsum("bi,ip,bp->b", shares[0], logarithms, shares[1])
    low, high = np.exp(np.quantile(means, [0.025, 0.975]))
    return Ratio(middle, float(low), float(high))


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


def cost_of(results: BenchResults, formulation: str, scene: str, target: float, variants: Sequence[int] = (0,)) -> Cost:
    """Return what an error of the forces costs, at the penalty of the rule or at the best of some variants.

    The coarsest mesh that gets there counts, and of its variants the one with the fewest linear systems.
    """
    row, ladders = results.formulations.index(formulation), results.ladders(scene)  # (n_instances, n_meshes)
    errors = results.errors_of(formulation)[:, variants][ladders]  # (n_instances, n_meshes, n_variants)
    iterations = results.counts_of(formulation, "iterations")[:, variants][ladders].astype(np.float64)
    least = np.where(errors <= target, iterations, inf).min(axis=-1)  # (n_instances, n_meshes)
    mesh: IntArray = np.isfinite(least).argmax(axis=1)
    instances = np.arange(len(ladders))
    cells, systems = ladders[instances, mesh], least[instances, mesh]
    never = np.isinf(systems)[:, None]

    def pick(values: FloatArray) -> FloatArray:
        return np.where(never, nan, values.reshape(len(ladders), -1))

    return Cost(
        evaluation=pick(results.evaluation[row, cells]),
        systems=pick(systems),
        factorisation=pick(results.factorisation[row, cells]),
        factors=pick(results.work[row, cells, list(WORK).index("factor_nonzeros")].astype(np.float64)),
        segments=pick(results.segments[cells].astype(np.float64)),
    )


def costs_at(results: BenchResults, scene: str, target: float) -> dict[str, Cost]:
    """Return {formulation: what an error costs it}."""
    return {name: cost_of(results, name, scene, target) for name in results.formulations}


def cost_ratio(cost: Cost, reference: Cost, number: str | Callable[[Cost], FloatArray]) -> Ratio:
    """Return the ratio of a number, or of a function of costs, to that of the reference.

    It is infinite if the formulation does not bring half of the instances there, and NaN if the reference does not.
    """
    value = attrgetter(number) if isinstance(number, str) else number
    if not reference.is_usual:
        return Ratio(nan)
    return ratio_of(value(cost), value(reference)) if cost.is_usual else Ratio(inf)


def ratios_at(results: BenchResults, scene: str, target: float, number: str) -> dict[str, Ratio]:
    """Return {formulation: ratio of a number to that of the reference} of all others; empty without the reference."""
    costs = costs_at(results, scene, target)
    if REFERENCE not in costs:
        return {}
    return {name: cost_ratio(cost, costs[REFERENCE], number) for name, cost in costs.items() if name != REFERENCE}


def total_ratio(cost: Cost, reference: Cost, share: float) -> Ratio:
    """Return the ratio of whole solutions for a reader whose linear systems cost `share` evaluations of the reference.

    A solution is linear systems × (evaluation + system). Systems cost as much as their factorisations do here.
    """
    unit = share * reference.evaluation.mean(axis=1, keepdims=True) / reference.factorisation
    return cost_ratio(cost, reference, lambda each: each.systems * (each.evaluation + unit * each.factorisation))


def runtimes(results: BenchResults, formulation: str, scene: str, number: str) -> FloatArray:
    """Return the seconds (n,) of evaluations or factorisations to each target on each instance, infinite if missed."""
    parts = []
    for target in results.targets[scene]:
        cost = cost_of(results, formulation, scene, target)
        seconds = (cost.systems * getattr(cost, number)).mean(axis=1)
        parts.append(np.where(cost.reached, seconds, inf))
    return np.concatenate(parts)


def curve(
    results: BenchResults, formulation: str, scene: str, kind: str, number: str, variants: Sequence[int] = (0,)
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

    def key(name: str) -> tuple[int, float]:
        costs = [cost_of(results, name, scene, target) for target in results.targets[scene]]
        reached = [place for place, cost in enumerate(costs) if cost.is_usual]
        return (-max(reached), costs[max(reached)].middle("evaluation")) if reached else (1, inf)

    return sorted(results.formulations, key=key)


# Tables and sentences.


def format_share(target: float) -> str:
    """Return an error as a share, as "1 %"."""
    return f"{100 * target:g} %"


def format_seconds(seconds: float) -> str:
    """Return seconds with three digits and their unit; ∞ for never, a dash for no number."""
    if isnan(seconds) or isinf(seconds):
        return "–" if isnan(seconds) else "∞"
    unit, factor = ("µs", 1e6) if seconds < 1e-3 else ("ms", 1e3) if seconds < 1 else ("s", 1.0)
    return f"{factor * seconds:.3g} {unit}"


def _count(number: float) -> str:
    return "∞" if isinf(number) else f"{number:.0f}"


def cost_table(results: BenchResults, scene: str, target: float) -> Table:
    """Return the three numbers of each formulation at an error, with the ratios to the reference."""
    heads = ("reached", "segments", "best", "evaluation", "ratio", "systems", "factors", "factorisation", "ratio")
    table = Table([Column("formulation"), *numbers(*heads)])
    ratios = {number: ratios_at(results, scene, target, number) for number in ("evaluation", "factorisation")}
    for name, cost in costs_at(results, scene, target).items():
        share = f"{int(cost.reached.sum())}/{len(cost.reached)}"
        segments = [_count(each.middle("segments")) for each in (cost, cost_of(results, name, scene, target, BEST))]
        if not cost.is_usual:
            table.add(name, share, *segments, *["∞"] * 6)
            continue
        seconds = {number: format_seconds(cost.middle(number)) for number in ratios}
        texts = {number: ratio[name].text if name in ratio else "1" for number, ratio in ratios.items()}
        table.add(
            *(name, share, *segments, seconds["evaluation"], texts["evaluation"], _count(cost.middle("systems"))),
            *(_count(cost.middle("factors")), seconds["factorisation"], texts["factorisation"]),
        )
    return table


def overview_table(results: BenchResults, scene: str) -> Table:
    """Return what the largest target of a scene costs, and how many of all runs failed, in 80 columns."""
    target = results.targets[scene][0]
    title = f"{scene}: {results.label(scene)}\nto an error of {format_share(target)} in the forces, at {RULE.label}"
    heads = ("reached", "evaluation", f"over {REFERENCE}", "systems", "factor", "failed")
    table = Table([Column("formulation", wrap=True), *numbers(*heads)], title)
    ratios = ratios_at(results, scene, target, "evaluation")
    for name, cost in costs_at(results, scene, target).items():
        failed = results.failures(name, scene)
        table.add(
            f"{name}{'*' if results.uses_differences(name, scene) else ''}",
            f"{int(cost.reached.sum())}/{len(cost.reached)}",
            format_seconds(cost.middle("evaluation")),
            ratios[name].text if name in ratios else "",
            _count(cost.middle("systems")),
            format_seconds(cost.middle("factorisation")),
            f"{failed.sum()}/{failed.size}",
        )
    return table


def totals_table(results: BenchResults, scene: str) -> Table | None:
    """Return the ratios of whole solutions at the largest target, for cheap, even and dear bodies, if there are any."""
    costs = costs_at(results, scene, results.targets[scene][0])
    table = Table([Column("formulation"), *numbers(*BODIES)])
    for name, cost in costs.items():
        if name != REFERENCE and REFERENCE in costs:
            table.add(name, *(total_ratio(cost, costs[REFERENCE], share).text for share in BODIES.values()))
    return table if table.groups else None


def starts_table(results: BenchResults, scene: str) -> Table:
    """Return the ranges of linear systems from each start on each mesh, as "5–7"; "2 fail" stands behind it."""
    table = Table([Column("formulation"), *numbers(*map(str, results.meshes_of(scene)))])
    for row, name in enumerate(results.formulations):
        counts = results.counts_of(name, "iterations")
        for number, variant in enumerate(VARIANTS):
            if variant.penalty != RULE.penalty:
                continue
            texts = []
            for cells in results.ladders(scene).T:
                failed = results.outcomes[row, cells, number] != 0
                solved = counts[cells, number][~failed]
                low, high = (int(solved.min()), int(solved.max())) if len(solved) else (0, 0)
                text = (f"{low}" if low == high else f"{low}–{high}") if len(solved) else ""
                texts.append(f"{text} {failed.sum()} fail".strip() if failed.any() else text)
            table.add(f"{name}, {variant.start}", *texts)
    return table


def split_targets(results: BenchResults, scene: str) -> tuple[list[float], str]:
    """Return the errors that a formulation reaches, at the fixed penalty or the best, and a sentence of the rest."""
    ways = [(name, variants) for name in results.formulations for variants in ((0,), BEST)]
    targets = results.targets[scene]
    reached = [each for each in targets if any(cost_of(results, name, scene, each, at).is_usual for name, at in ways)]
    others = [target for target in targets if target not in reached]
    words = f"No formulation comes to an error of {' or '.join(map(format_share, others))} on the meshes of {scene}."
    return reached, words if others else ""


def cost_sentences(results: BenchResults, scene: str, target: float) -> list[str]:
    """Return what can be said of one evaluation and of linear systems at an error; nothing without the reference."""
    if REFERENCE not in results.formulations or len(results.formulations) < 2:
        return []
    start = f"On {scene}, at an error of {format_share(target)} in the forces"
    if not cost_of(results, REFERENCE, scene, target).is_usual:
        return [f"{start}, there is no ratio, since {REFERENCE} does not get there."]
    if len(results.ladders(scene)) < _LEAST:
        return [f"{start}, no ratio has an interval, so nobody is known to be faster: that takes {_LEAST} instances."]
    words = {number: _put_in_words(ratios_at(results, scene, target, number)) for number in ("evaluation", "systems")}
    return [f"{start}, {NUMBERS[number]} over those of {REFERENCE}: {text}." for number, text in words.items()]


def _put_in_words(ratios: dict[str, Ratio]) -> str:
    """Return who is faster and slower by how much, who is as fast, who is not told apart, and who never gets there."""
    order, texts = sorted(ratios.items(), key=lambda pair: pair[1].middle), []
    for title, word in (
        ("less", "faster"), ("more", "slower"), ("alike within 5 %", "as fast"),
        ("not told apart", "not told apart"), ("never there", "never"),
    ):  # fmt: skip
        names = [
            f"{name} {ratio.text}" if word in ("faster", "slower") else name
            for name, ratio in order
            if (ratio.word or "not told apart") == word
        ]
        more = [f"{len(names) - _MOST_NAMES} more"] if len(names) > _MOST_NAMES else []
        texts += [f"{title}: {', '.join([*names[:_MOST_NAMES], *more])}"] if names else []
    return "; ".join(texts)


# Changes since an earlier bench.


@dataclass(frozen=True, slots=True)
class BenchChange:
    """A formulation beside itself in an earlier bench: counts are compared exactly, and seconds by a ratio."""

    formulation: str
    n_cells: int  # The number of cells that both benches have
    counts: Mapping[str, tuple[int, int]]  # {count: (sum here, sum there)} of the counts that differ in some run
    evaluation: Ratio  # The seconds of one evaluation over those there

    @property
    def counts_text(self) -> str:
        """The counts that differ, in words."""
        texts = [f"{kind}: {new} instead of {old}" for kind, (new, old) in self.counts.items()]
        return "; ".join(texts) or "all counts are equal"

    @property
    def sentence(self) -> str:
        """The change in words."""
        return (
            f"{self.formulation}, {self.n_cells} cells: one evaluation takes {self.evaluation.text} times as long "
            f"({self.evaluation.word}); {self.counts_text}."
        )

    @property
    def worse(self) -> bool:
        """True if some count grew, or an evaluation takes longer."""
        return any(new > old for new, old in self.counts.values()) or self.evaluation.word == "slower"


def compare_benches(new: BenchResults, old: BenchResults) -> tuple[BenchChange, ...]:
    """Return the change of each formulation that both benches have.

    Seconds count in those of the factorisations, which are the same work where counts agree, so that another machine
    changes nothing.
    """
    common = [cell for cell in new.cells if cell in old.cells]
    benches = [(results, [results.cells.index(cell) for cell in common]) for results in (new, old)]
    names = [name for name in new.formulations if name in old.formulations] if common else []
    speeds = []  # The median of the seconds of a factorisation in each bench, 1 where there is none.
    for results, cells in benches:
        seconds = results.factorisation[np.ix_([results.formulations.index(name) for name in names], cells)]
        finite = seconds[np.isfinite(seconds)]
        speeds.append(float(np.median(finite)) if len(finite) else 1.0)
    changes = []
    for name in names:
        places = [(results, (results.formulations.index(name), cells)) for results, cells in benches]
        counts = {
            kind: [results.counts[*at, :, place] for results, at in places] for place, kind in enumerate(COUNTS)
        } | {
            kind.replace("_", " "): [results.work[*at, place] for results, at in places]
            for place, kind in enumerate(WORK)
        }
        differing = {
            kind: (int(here.sum()), int(there.sum())) for kind, (here, there) in counts.items() if (here != there).any()
        }
        n_processes = min(results.evaluation.shape[-1] for results, _ in benches)
        here, there = (results.evaluation[at][:, :n_processes] for results, at in places)
        changes.append(BenchChange(name, len(common), differing, ratio_of(here / (speeds[0] / speeds[1]), there)))
    return tuple(changes)


# The words of a page.

HOW_TO_READ = (
    f"The penalty is {RULE.penalty:g} E/h, fixed beforehand; the column “best”, and dashed lines where each "
    "formulation has a panel, have the best of three penalties, chosen afterwards. All start from the same guess. "
    "A point is the median over the instances of a mesh: the other body is the slave, the master is graded, the "
    "edge shifted, the size changed by up to a fifth. Contact no longer limits an error at its floor. Of "
    "pressures that is the L2 error of the best linear one on the slave's mesh (dotted, at the times of "
    f"{REFERENCE}); at reported points alone an error may be lower. Of forces and displacements it is the curve of "
    "sts, which integrates each overlap of two segments exactly where it is closed: with 12 points in place of 3 "
    "its errors are the same on wavy to 1e-10, and on hertz to 3 %."
)
THREE_NUMBERS = (
    "An error costs three numbers, and they are not added up, since what a linear system costs depends on the bodies. "
    "One evaluation is search, forces and tangent, timed by the plugin's process. Linear systems are counted. One "
    "factorisation is that of the whole system with all bodies, by SuperLU. The coarsest mesh that reaches the error "
    "counts. A ratio is a geometric mean over instances and processes, with an interval of 95 % that resamples both."
)
TOTALS = (
    "The ratio of whole solutions if one linear system costs the reader a tenth of an evaluation of "
    f"{REFERENCE} (cheap bodies), as much (even), or ten times as much (dear)."
)
DEEPEST_START = "The median number of linear systems from there, on all meshes, and the share that find no solution."
STARTS = (
    "Linear systems on each mesh from the guess (near), from ten times its depth (deep), and from a thousand times "
    "(deepest)."
)
