"""What got worse from an old report to a new one, by rules with a formula: no clock and no noise has a say in it.

A row (formulation × property) has regressed where

- it passed and does not any more, or it crashes and did not;
- a promise that was kept, or a property that was judged, is not any more (`unexpected`);
- on the same cases, one that passed fails;
- on the same cases, the median or the worst margin m = value/tolerance is above 1 and m_new > 2 m_old + 2: a tolerance
  is what roundoff may do to a number, and each of the two may be off by one. Far beyond it, where a solution fails,
  roundoff decides which of its iterates is judged: a factor of two between them is no news;
- on the same cases, those that were judged and are undecided now outnumber those the other way round by more than
  max(1, 1 %): roundoff may take a case across a limit of what can be decided, either way, but few lie at one;
- likewise solutions that converged and do not any more, by more than 2 + 5 %: whether an active set that wanders comes
  to rest is chaotic too. ±1 ulp in the residual was seen to cost 5 of 150;
- with the same seed and number of examples it has fewer cases, by more than max(1, 1 %), which no roundoff does;
- on different cases, which are two samples of one population, the new margins lie higher than chance allows: of
  max(m, 1) the empirical distributions F satisfy max (F_old − F_new) > √(½ ln(1/α) (1/n_old + 1/n_new) / s), the
  one-sided test of Smirnov at the level α = 1e-6, s the share of a run's cases that are independent: hypothesis varies
  what it drew before. Noise of failures is in both samples and shifts neither. But the test sees ranks, so that it
  takes a change of 1 % for news where all margins are alike: an old m > 1 enters as 2 m + 2 here too. Within the
  tolerance nothing is compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log, nan, sqrt
from textwrap import shorten

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.property import Verdict
from contactverif_reports.compare.cells import Cell, Paired, statistics
from contactverif_reports.compare.comparison import CONVERGED, END, Iterations
from contactverif_reports.compare.noteworthy import noteworthy, solves
from contactverif_reports.netcdf.stored_cells import StoredCells

ALPHA = 1e-6  # false alarms per row on different cases
INDEPENDENT = 0.5  # of the cases: so far apart do runs of one code lie at other seeds, at 90 % and 99 % of 1100 pairs
REASON = 100  # characters of a reason
FACTOR = 2.0  # between two margins beyond the tolerance that is no news
ROUNDOFFS = 2.0  # tolerances by which two right margins may differ


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """One formulation and property, before and after.

    Attributes
    ----------
    old, new : Cell
        What was found.
    paired : Paired | None
        The new beside the old, case by case; None where the cases are not the same.
    regressions : tuple[str, ...]
        In words; empty where nothing got worse.
    noteworthy : tuple[str, ...]
        In words, what is worth a look and no regression.
    """

    old: Cell
    new: Cell
    paired: Paired | None
    regressions: tuple[str, ...]
    noteworthy: tuple[str, ...] = ()

    @property
    def better(self) -> bool:
        """Whether it passes now, and did not."""
        return self.new.verdict is Verdict.PASS and self.old.verdict is not Verdict.PASS

    @property
    def slower(self) -> float:
        """Median seconds of a case, new over old; NaN where nothing was judged. Of a clock, so judged by nobody."""
        return self.new.seconds / self.old.seconds if self.old.seconds > 0 else nan


@dataclass(frozen=True, slots=True, eq=False)
class Changes:
    """An old report and a new one.

    Attributes
    ----------
    changes : tuple[Change, ...]
        Rows that both have.
    gone, added : tuple[str, ...]
        What only the old, only the new report asked: names of formulations, ids of properties, or rows.
    lost : Mapping[str, str]
        {name: reason} of what the old report asked, and the new one could not load.
    """

    old: StoredCells
    new: StoredCells
    changes: tuple[Change, ...]
    gone: tuple[str, ...]
    added: tuple[str, ...]
    lost: Mapping[str, str]

    @property
    def regressions(self) -> tuple[str, ...]:
        """All that got worse: a line for each row, and for what was lost."""
        found = [_line(change, change.regressions) for change in self.changes if change.regressions]
        return (*found, *(f"{name}: not loaded any more: {reason}" for name, reason in self.lost.items()))

    @property
    def noteworthy(self) -> tuple[str, ...]:
        """What is worth a look though it did not get worse: a line for each row."""
        return tuple(_line(change, change.noteworthy) for change in self.changes if change.noteworthy)

    @property
    def iterations(self) -> tuple[tuple[Iterations, Iterations], ...]:
        """Newton iterations, (old, new), on the same cases and not as they were."""
        paired = [change for change in self.changes if change.paired is not None]
        return tuple(lines for change in paired for lines in solves(change.old, change.new) if _moved(*lines))

    @classmethod
    def of(cls, old: StoredCells, new: StoredCells) -> Changes:
        """The rows that both reports have; none, if they have nothing in common."""
        same_seed, same_examples = (
            old.provenance.get(name) == new.provenance.get(name) for name in ("seed", "examples")
        )
        return cls(
            old=old,
            new=new,
            changes=tuple(
                change(cell, new.cells[key], same_seed=same_seed, same_examples=same_examples)
                for key, cell in old.cells.items()
                if key in new.cells
            ),
            gone=_only(old, new),
            added=_only(new, old),
            lost={
                name: reason
                for name, reason in new.not_loaded.items()
                if name in (*old.formulations, *old.properties) and name not in old.not_loaded
            },
        )


def change(old: Cell, new: Cell, *, same_seed: bool, same_examples: bool = True) -> Change:
    """One row, before and after, with all that got worse."""
    paired = Paired.of(new, old) if same_seed and same_cases(old, new) else None
    found = [*_verdicts(old, new)]
    n_old, n_new = len(old.verdicts), len(new.verdicts)
    if same_seed and same_examples and n_old - n_new > few(n_old):
        found.append(f"{n_new} cases, {n_old} before, at the same seed and number of examples")
    if paired is None:
        return Change(old, new, None, (*found, *_on_others(old, new)))
    found += [*_on_the_same(old, new, paired), *_fewer(old, new)]
    return Change(old, new, paired, tuple(found), tuple(noteworthy(old, new)))


def few(n_cases: int) -> float:
    """Cases that roundoff may leave undecided."""
    return max(1.0, 0.01 * n_cases)


def wandering(n_cases: int) -> float:
    """Solutions that roundoff may keep from converging."""
    return 2 + 0.05 * n_cases


def same_cases(old: Cell, new: Cell) -> bool:
    """Whether the cases of the shorter row are the first ones of the longer row, told by what is stored of each."""
    n = min(len(old.kinds), len(new.kinds))
    return bool(np.array_equal(old.kinds[:n], new.kinds[:n], equal_nan=True))


def _verdicts(old: Cell, new: Cell) -> Sequence[str]:
    found = []
    passed, crashes = Verdict.PASS, Verdict.CRASHED
    if new.verdict is not old.verdict and (old.verdict is passed or new.verdict is crashes):
        why = f" ({shorten(new.reason, REASON, placeholder=' …')})" if new.reason else ""
        found.append(f"{old.verdict} → {new.verdict}{why}")
    elif new.unexpected and not old.unexpected:
        found.append(f"as promised → {new.unexpected}")
    return found


def _on_the_same(old: Cell, new: Cell, paired: Paired) -> Sequence[str]:
    n = len(paired.decades)
    fails_now = paired.apart & (new.standing[:n] > 1)
    found = []
    if fails_now.any() and old.verdict is not Verdict.PASS:
        first = int(np.flatnonzero(fails_now)[0])
        found.append(f"{int(fails_now.sum())} of {paired.n} cases passed and fail now, the first is case {first}")
    grew = [
        f"{name} {m_old:.3g} → {m_new:.3g}"
        for name, m_old, m_new in statistics(old, new)
        if m_new > 1 and m_new > FACTOR * m_old + ROUNDOFFS
    ]
    if grew:
        found.append(f"error grew, in tolerances, on the same {paired.n} cases: {', '.join(grew)}")
    return found


def _fewer(old: Cell, new: Cell) -> Sequence[str]:
    """Cases that were judged, or converged, and are or do not any more."""
    n = min(len(old.verdicts), len(new.verdicts))
    found = []
    lost, back = _exchanged(old.decided[:n], new.decided[:n])
    if lost - back > few(n):
        found.append(f"{lost} of the same {n} cases were judged and are undecided now{_back(back)}")
    for name in old.details.keys() & new.details.keys():
        kind, _, what = name.partition(", ")
        if kind != END:
            continue
        before, after = old.details[name][:n], new.details[name][:n]
        told = ~(np.isnan(before) | np.isnan(after))
        lost, back = _exchanged(told & (before == CONVERGED), told & (after == CONVERGED))
        n_told = int(told.sum())
        if lost - back > wandering(n_told):
            solutions = f"{n_told} solutions{f' ({what})' if what else ''}"
            found.append(f"{lost} of the same {solutions} converged and do not any more{_back(back)}")
    return found


def _exchanged(before: BoolArray, after: BoolArray) -> tuple[int, int]:
    return int((before & ~after).sum()), int((~before & after).sum())


def _back(n_cases: int) -> str:
    return f", {n_cases} the other way round" if n_cases else ""


def _on_others(old: Cell, new: Cell) -> Sequence[str]:
    before, after = (np.maximum(cell.standing[~np.isnan(cell.standing)], 1.0) for cell in (old, new))
    if not (len(before) and len(after)):
        return []
    higher = shift(np.where(before > 1, FACTOR * before + ROUNDOFFS, 1.0), after)
    by_chance = sqrt(0.5 * log(1 / ALPHA) * (1 / len(before) + 1 / len(after)) / INDEPENDENT)
    if higher <= by_chance:
        return []
    return [f"errors grew on other cases: distributions {higher:.2f} apart, chance allows {by_chance:.2f}"]


def shift(before: FloatArray, after: FloatArray) -> float:
    """Smirnov's one-sided distance max (F_before − F_after) of two samples (n,): how much higher `after` lies."""
    at = np.unique(np.concatenate([before, after]))
    counts = [np.searchsorted(np.sort(sample), at, side="right") / len(sample) for sample in (before, after)]
    return float(np.max(counts[0] - counts[1], initial=0.0))


def _line(change: Change, words: Sequence[str]) -> str:
    return f"{change.new.formulation}, {change.new.property_id}: {'; '.join(words)}"


def _moved(old: Iterations, new: Iterations) -> bool:
    return bool(new.fewer or new.more or old.converged != new.converged)


def _only(one: StoredCells, other: StoredCells) -> tuple[str, ...]:
    """What the other did not ask; a formulation or property that it does not have at all is named once."""
    formulations = [name for name in one.formulations if name not in other.formulations]
    properties = [name for name in one.properties if name not in other.properties]
    rows = [
        f"{formulation}, {id_}"
        for formulation, id_ in one.cells
        if formulation not in formulations and id_ not in properties and (formulation, id_) not in other.cells
    ]
    return (*formulations, *properties, *rows)
