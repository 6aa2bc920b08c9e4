"""What got worse from an old report to a new one, by rules with a formula: no clock and no noise has a say in it.

A row (formulation × property) has regressed where

- it passed and does not any more, or it crashes and did not;
- a promise that was kept, or a property that was judged, is not any more (`unexpected`);
- on the same cases, one that passed fails;
- on the same cases, the median or the worst margin m = value/tolerance is above 1 and m_new > m_old + 2: a tolerance is
  what roundoff may do to a number, and each of the two may be off by one;
- on different cases, which are two samples of one population, the new margins lie higher than chance allows: of
  max(m, 1), the empirical distributions F satisfy max (F_old − F_new) > √(½ ln(1/α) (1/n_old + 1/n_new)), the one-sided
  test of Smirnov at the level α = 1e-6. Within the tolerance nothing is compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log, nan, sqrt
from textwrap import shorten

import numpy as np

from contactverif.arrays import FloatArray
from contactverif.property import Verdict
from contactverif_reports.cells import Cell, Paired
from contactverif_reports.comparison import Iterations, iterations
from contactverif_reports.stored_cells import StoredCells

ALPHA = 1e-6  # false alarms per row on different cases
REASON = 100  # characters of a reason
ROUNDOFFS = 2.0  # tolerances by which two right margins may differ


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """One formulation and property, before and after.

    Attributes
    ----------
    old, new : what was found.
    paired : the new beside the old, case by case; None where the cases are not the same.
    regressions : in words; empty where nothing got worse.
    """

    old: Cell
    new: Cell
    paired: Paired | None
    regressions: tuple[str, ...]

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
    changes : rows that both have.
    same_seed : whether both say that they drew the same cases; each row has checked it.
    gone, added : what only the old, only the new report asked: names of formulations, ids of properties, or rows.
    lost : {name: reason} of what the old report asked, and the new one could not load.
    """

    old: StoredCells
    new: StoredCells
    changes: tuple[Change, ...]
    same_seed: bool
    gone: tuple[str, ...]
    added: tuple[str, ...]
    lost: Mapping[str, str]

    @property
    def regressions(self) -> tuple[str, ...]:
        """All that got worse, a line each."""
        found = [
            f"{change.new.formulation}, {change.new.property_id}: {words}"
            for change in self.changes
            for words in change.regressions
        ]
        return (*found, *(f"{name}: not loaded any more: {reason}" for name, reason in self.lost.items()))

    @property
    def iterations(self) -> tuple[tuple[Iterations, Iterations], ...]:
        """Newton iterations, (old, new), on the same cases and not as they were."""
        found = []
        for change in self.changes:
            by_title: dict[str, list[Iterations]] = {}
            for line in iterations([change.old, change.new]) if change.paired is not None else []:
                by_title.setdefault(line.title, []).append(line)
            found += [(lines[0], lines[1]) for lines in by_title.values() if len(lines) == 2 and _moved(*lines)]
        return tuple(found)

    @classmethod
    def of(cls, old: StoredCells, new: StoredCells) -> Changes:
        """The rows that both reports have; none, if they have nothing in common."""
        same_seed = old.provenance.get("seed") == new.provenance.get("seed")
        return cls(
            old=old,
            new=new,
            changes=tuple(
                change(cell, new.cells[key], same_seed=same_seed) for key, cell in old.cells.items() if key in new.cells
            ),
            same_seed=same_seed,
            gone=_only(old, new),
            added=_only(new, old),
            lost={
                name: reason
                for name, reason in new.not_loaded.items()
                if name in (*old.formulations, *old.properties) and name not in old.not_loaded
            },
        )


def change(old: Cell, new: Cell, *, same_seed: bool) -> Change:
    """One row, before and after, with all that got worse."""
    paired = Paired.of(new, old) if same_seed and same_cases(old, new) else None
    found = [*_verdicts(old, new)]
    found += _on_the_same(old, new, paired) if paired is not None else _on_others(old, new)
    return Change(old, new, paired, tuple(found))


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
    before, after = old.standing[:n], new.standing[:n]
    both = ~(np.isnan(before) | np.isnan(after))
    fails_now = paired.apart & (after > 1)
    found = []
    if fails_now.any() and old.verdict is not Verdict.PASS:
        first = int(np.flatnonzero(fails_now)[0])
        found.append(f"{int(fails_now.sum())} of {paired.n} cases passed and fail now, the first is case {first}")
    if not both.any():
        return found
    grew = []
    for name, statistic in (("median", np.median), ("worst", np.max)):
        m_old, m_new = float(statistic(before[both])), float(statistic(after[both]))
        if m_new > 1 and m_new > m_old + ROUNDOFFS:
            grew.append(f"{name} {m_old:.3g} → {m_new:.3g}")
    if grew:
        found.append(f"error grew, in tolerances, on the same {paired.n} cases: {', '.join(grew)}")
    return found


def _on_others(old: Cell, new: Cell) -> Sequence[str]:
    before, after = (np.maximum(cell.standing[~np.isnan(cell.standing)], 1.0) for cell in (old, new))
    if not (len(before) and len(after)):
        return []
    higher, allowed = shift(before, after), sqrt(0.5 * log(1 / ALPHA) * (1 / len(before) + 1 / len(after)))
    if higher <= allowed:
        return []
    return [f"errors grew on other cases: distributions {higher:.2f} apart, chance allows {allowed:.2f}"]


def shift(before: FloatArray, after: FloatArray) -> float:
    """Smirnov's one-sided distance max (F_before − F_after) of two samples (n,): how much higher `after` lies."""
    at = np.unique(np.concatenate([before, after]))
    counts = [np.searchsorted(np.sort(sample), at, side="right") / len(sample) for sample in (before, after)]
    return float(np.max(counts[0] - counts[1], initial=0.0))


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
