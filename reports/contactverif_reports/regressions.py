"""The regressions from an old report to a new one, by rules with a formula: no clock and no noise decides.

A row (formulation × property) has regressed if one of these holds:

- It passed and does not any more, or it crashes and did not.
- A promise that was kept, or a property that was judged, is not any more (`unexpected`).
- On the same cases, one that passed fails.
- On the same cases, the median or the worst margin m = value/tolerance is above 1 and m_new > 2 m_old + 2. A tolerance
  is what roundoff may do to a number, and each of the two may be off by one. Far beyond it, where a solution fails,
  roundoff decides which of its iterates is judged, so a factor of two between them is no news.
- On the same cases, those that were judged and are undecided now outnumber those the other way round by more than
  max(1, 1 %). Roundoff may take a case across a limit of what can be decided, either way, but few lie at one.
- Likewise solutions that converged and do not any more, by more than 2 + 5 %. Whether an active set that wanders comes
  to rest is chaotic too: ±1 ulp in the residual was seen to cost 5 of 150.
- With the same seed and number of examples it has fewer cases, by more than max(1, 1 %), which no roundoff does.
- On different cases, which are two samples of one population, the new margins lie higher than chance allows. The
  empirical distributions F of max(m, 1) then satisfy max (F_old − F_new) > √(½ ln(1/α) (1/n_old + 1/n_new) / s), the
  one-sided test of Smirnov at the level α = 1e-6. The share s of a run's cases is independent: hypothesis varies what
  it drew before. Failures occur in both samples, so they do not bias the comparison. The test sees ranks, so that it
  takes a change of 1 % for news where all margins are alike: an old m > 1 enters as 2 m + 2 here too. Within the
  tolerance nothing is compared.

Worth a look, though nothing got worse by it, is a row on the same cases where

- Newton needs more than 2 n_old + 2 iterations in the median: an active set may take a few more or fewer.
- A median or worst margin within its tolerance is more than 100 times what it was and above 1/10. Margins below that
  may be one roundoff (0.05 where a tolerance is 20 of them), which comes and goes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, log, nan, sqrt
from textwrap import shorten
from typing import Self

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.property import Verdict
from contactverif.contract.result import Run
from contactverif_reports import tables
from contactverif_reports.comparisons import CONVERGED, END, Iterations, Pair, RowNumbers, count_iterations, name_column
from contactverif_reports.tables import Code, Column, ResultCell, Table, numbers

ALPHA = 1e-6  # The rate of false alarms per row on different cases.
# The share of the cases that is independent: runs of one code with other seeds lie so far apart, at 90 % and 99 % of
# 1100 pairs.
INDEPENDENT_SHARE = 0.5
REASON_LENGTH = 100  # The number of characters of a reason that are printed.
FACTOR, ROUNDOFFS = 2.0, 2.0  # A number m beyond its tolerance that becomes FACTOR · m + ROUNDOFFS at most is no news.
LEAP = 100.0  # The factor by which a margin within the tolerance must grow to be worth a look.
LEAST_MARGIN = 0.1  # A margin that stays below this is roundoff.


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """One formulation and property, before and after."""

    pair: Pair  # The new row beside the old one.
    same_cases: bool  # They are compared case by case; else as two samples.
    regressions: tuple[str, ...]  # The regressions, in words; empty if there is none.
    noteworthy: tuple[str, ...] = ()  # The changes that are worth a look and no regression, in words.

    @property
    def slower(self) -> float:
        """Median seconds of a case, new over old; NaN where nothing was judged. It decides nothing."""
        return self.pair.new.seconds / self.pair.old.seconds if self.pair.old.seconds > 0 else nan


@dataclass(frozen=True, slots=True, eq=False)
class NamedRun:
    """A run with the name of its report and its numbers by case."""

    path: str  # The report as the caller wrote it.
    run: Run  # The run that it stores.
    cells: Mapping[tuple[str, str], RowNumbers]  # {(formulation, property): numbers}.

    @classmethod
    def from_run(cls, path: str, run: Run) -> Self:
        """Collect the numbers of a run."""
        return cls(path, run, {key: RowNumbers.from_row(row) for key, row in run.row_of.items()})


@dataclass(frozen=True, slots=True, eq=False)
class Changes:
    """An old report and a new one."""

    old: NamedRun  # The runs.
    new: NamedRun
    changes: tuple[Change, ...]  # The rows that both have.
    # The entries of the old report only, and of the new report only: names of formulations, ids of properties, or
    # rows.
    removed: tuple[str, ...]
    added: tuple[str, ...]
    # {name: reason} of the plugins that the old report has and the new run could not load.
    no_longer_loaded: Mapping[str, str]

    @property
    def regressions(self) -> tuple[str, ...]:
        """The regressions: a line for each row, and for each plugin that does not load any more."""
        plugins = (f"{name}: not loaded any more: {reason}" for name, reason in self.no_longer_loaded.items())
        return (*self._lines("regressions"), *plugins)

    @property
    def noteworthy(self) -> tuple[str, ...]:
        """The changes that are worth a look and no regression: a line for each row."""
        return self._lines("noteworthy")

    def _lines(self, kind: str) -> tuple[str, ...]:
        rows = ((change.pair.new.row, getattr(change, kind)) for change in self.changes)
        return tuple(f"{row.formulation}, {row.property_id}: {'; '.join(words)}" for row, words in rows if words)

    @property
    def iterations(self) -> tuple[tuple[Iterations, Iterations], ...]:
        """Newton iterations (old, new) that changed, on the same cases."""
        return tuple(
            lines
            for change in self.changes
            for lines in (_paired_iterations(change.pair) if change.same_cases else ())
            if lines[1].fewer or lines[1].more or lines[0].converged != lines[1].converged
        )

    @classmethod
    def between(cls, old: NamedRun, new: NamedRun) -> Self:
        """Compare the rows that both runs have; none if they have nothing in common."""
        same = {key: old.run.provenance.get(key) == new.run.provenance.get(key) for key in ("seed", "examples")}
        names = (*old.run.formulations, *old.run.properties)
        lost_before = {item.formulation for item in old.run.not_loaded}
        return cls(
            old=old,
            new=new,
            changes=tuple(
                compare_rows(cell, new.cells[key], same_seed=same["seed"], same_examples=same["examples"])
                for key, cell in old.cells.items()
                if key in new.cells
            ),
            removed=_only(old, new),
            added=_only(new, old),
            no_longer_loaded={
                item.formulation: item.reason
                for item in new.run.not_loaded
                if item.formulation in names and item.formulation not in lost_before
            },
        )


def compare_rows(old: RowNumbers, new: RowNumbers, *, same_seed: bool, same_examples: bool = True) -> Change:
    """Compare one row, before and after."""
    pair = Pair.from_cells(new, old)
    n = len(pair.decades)  # The cases of the shorter row may be the first of the longer one, by their summaries.
    same_cases = same_seed and np.array_equal(old.kinds[:n], new.kinds[:n], equal_nan=True)
    n_old, n_new = len(old.verdicts), len(new.verdicts)
    lines = _verdicts(pair)
    if same_seed and same_examples and n_old - n_new > few(n_old):
        lines.append(f"{n_new} cases, {n_old} before, at the same seed and number of examples")
    lines += [*_on_the_same(pair), *_fewer(pair)] if same_cases else _on_others(pair)
    return Change(pair, same_cases, tuple(lines), tuple(_noteworthy(pair)) if same_cases else ())


def few(n_cases: int) -> float:
    """Return the number of cases that roundoff may leave undecided."""
    return max(1.0, 0.01 * n_cases)


def wandering(n_cases: int) -> float:
    """Return the number of solutions that roundoff may keep from converging."""
    return 2 + 0.05 * n_cases


def _verdicts(pair: Pair) -> list[str]:
    old, new = pair.old.row, pair.new.row
    if new.verdict is not old.verdict and (old.verdict is Verdict.PASS or new.verdict is Verdict.CRASHED):
        detail = f" ({shorten(new.reason, REASON_LENGTH, placeholder=' …')})" if new.reason else ""
        return [f"{old.verdict} → {new.verdict}{detail}"]
    return [f"promises kept → {new.unexpected}"] if new.unexpected and not old.unexpected else []


def _on_the_same(pair: Pair) -> list[str]:
    fails_now = pair.apart & (pair.new.standing[: len(pair.apart)] > 1)
    lines = []
    if fails_now.any() and pair.old.row.verdict is not Verdict.PASS:
        first = int(np.flatnonzero(fails_now)[0])
        lines.append(f"{int(fails_now.sum())} of {pair.n} cases passed and fail now, the first is case {first}")
    grew = [
        f"{name} {m_old:.3g} → {m_new:.3g}"
        for name, m_old, m_new in pair.statistics()
        if m_new > 1 and m_new > FACTOR * m_old + ROUNDOFFS
    ]
    if grew:
        lines.append(f"error grew, in tolerances, on the same {pair.n} cases: {', '.join(grew)}")
    return lines


def _fewer(pair: Pair) -> list[str]:
    n, old, new = len(pair.decades), pair.old, pair.new
    comparisons = [(old.decided[:n], new.decided[:n], few(n), f"{n} cases were judged and are undecided now")]
    for name in old.details:
        if name in new.details and name.partition(", ")[0] == END:
            before, after = old.details[name][:n], new.details[name][:n]
            both, solution = ~(np.isnan(before) | np.isnan(after)), name.partition(", ")[2]
            n_both = int(both.sum())
            words = f"{n_both} solutions{f' ({solution})' if solution else ''} converged and do not any more"
            converged = (both & (ends == CONVERGED) for ends in (before, after))
            comparisons.append((*converged, wandering(n_both), words))
    lines = []
    for old_mask, new_mask, allowed, words in comparisons:
        worse, better = int((old_mask & ~new_mask).sum()), int((~old_mask & new_mask).sum())
        if worse - better > allowed:
            lines.append(f"{worse} of the same {words}{f', {better} the other way round' if better else ''}")
    return lines


def _on_others(pair: Pair) -> list[str]:
    before, after = (np.maximum(cell.standing[~np.isnan(cell.standing)], 1.0) for cell in (pair.old, pair.new))
    if not (len(before) and len(after)):
        return []
    higher = shift(np.where(before > 1, FACTOR * before + ROUNDOFFS, 1.0), after)
    by_chance = sqrt(0.5 * log(1 / ALPHA) * (1 / len(before) + 1 / len(after)) / INDEPENDENT_SHARE)
    words = f"errors grew on other cases: distributions {higher:.2f} apart, chance allows {by_chance:.2f}"
    return [words] if higher > by_chance else []


def shift(before: FloatArray, after: FloatArray) -> float:
    """Return Smirnov's one-sided distance max (F_before − F_after) of two samples (n,): how much higher `after` is."""
    places = np.unique(np.concatenate([before, after]))
    counts = [np.searchsorted(np.sort(sample), places, side="right") / len(sample) for sample in (before, after)]
    return float(np.max(counts[0] - counts[1], initial=0.0))


def _noteworthy(pair: Pair) -> list[str]:
    """Return what is worth a look, in words; both rows are over the same cases."""
    lines = [
        f"{name} error grew within its tolerance, {m_old:.2g} → {m_new:.2g} of it"
        for name, m_old, m_new in pair.statistics()
        if LEAST_MARGIN < m_new <= 1 and m_new > LEAP * m_old
    ]
    for before, after in _paired_iterations(pair):
        if after.median > FACTOR * before.median + ROUNDOFFS:
            solution = f" ({after.solution})" if after.solution else ""
            lines.append(f"Newton iterations{solution}, median {before.median:g} → {after.median:g}")
    return lines


def _paired_iterations(pair: Pair) -> list[tuple[Iterations, Iterations]]:
    """Return the Newton iterations (before, after) of each solution that both kept."""
    by_title: dict[str, list[Iterations]] = {}
    for line in count_iterations([pair.old, pair.new]):
        by_title.setdefault(line.title, []).append(line)
    return [(lines[0], lines[1]) for lines in by_title.values() if len(lines) == 2]


def _only(first: NamedRun, second: NamedRun) -> tuple[str, ...]:
    """Return what only the first has; a formulation or property that the second does not have is named once."""
    formulations = [name for name in first.run.formulations if name not in second.run.formulations]
    properties = [name for name in first.run.properties if name not in second.run.properties]
    rows = [key for key in first.cells if key not in second.cells]
    others = [f"{name}, {id_}" for name, id_ in rows if name not in formulations and id_ not in properties]
    return (*formulations, *properties, *others)


def changes_table(changes: Sequence[Change]) -> Table:
    """Return results, errors and numbers of cases, old → new, and the time of a case: a line for each row."""
    title = "result, old → new; cases better, equal, worse; time of a case, new/old (decides nothing)"
    words = Column("result"), Column("median"), Column("worst")
    table = Table([name_column("formulation, property"), *words, *numbers("better", "equal", "worse", "time")], title)
    for change in changes:
        old, new, pair = change.pair.old, change.pair.new, change.pair
        better = new.row.verdict is Verdict.PASS and old.row.verdict is not Verdict.PASS
        style = "red" if change.regressions else "green" if better else ""
        results = ResultCell(old.row.result), ResultCell(new.row.result, "; ".join(change.regressions))
        table.add(
            Code(f"{new.row.property_id}{'' if change.same_cases else ' *'}"),
            tables.Change(*results, style),
            tables.Change(old.median, new.median),
            tables.Change(old.worst, new.worst),
            *([pair.better, pair.equal, pair.worse] if change.same_cases and pair.n else [None] * 3),
            f"{change.slower:.2f}" if isfinite(change.slower) else "–",
            group=new.row.formulation,
        )
    return table


def changed_iterations_table(changes: Changes) -> Table:
    """Return Newton's iterations that changed on the same cases."""
    words = Column("converged"), Column("median"), Column("most")
    title = "Newton iterations that changed, old → new, where it converged"
    table = Table([name_column("formulation, property"), *words, *numbers("fewer", "same", "more")], title)
    for old, new in changes.iterations:
        table.add(
            f"{new.formulation}, {new.title}",
            tables.Change(f"{old.converged}/{old.solved}", f"{new.converged}/{new.solved}"),
            tables.Change(old.median, new.median),
            tables.Change(old.most, new.most),
            *(new.fewer, new.same, new.more),
        )
    return table
