"""The model of what a run found: a `Row` for each formulation and property, all rows in a `Run`.

A `Coverage` says what the cases of a property were worth, all formulations together. The runner makes a `Run`, a report
stores it, and the reader makes it again from the file; a table, a page or a comparison never asks where it comes from.
What follows from other attributes is computed here and only here.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from itertools import chain
from math import exp, lgamma, log, log1p
from operator import add

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, freeze
from contactverif.contract.errors import LONGEST_FACT, clean, name_line, one_line
from contactverif.contract.property import (
    DECIDED,
    FAILED,
    FOREIGN,
    CheckedNumber,
    Outcome,
    PropertyInfo,
    Verdict,
    checked_numbers,
)

_NUMBER = re.compile(r"[-+]?\b\d+(\.\d+)?(e[-+]?\d+)?\b|\b(nan|inf)\b")
JUDGED_SHARE = 0.9  # A property counts as judged if at least this share of what right formulations decide was decided.
BROKEN_BY_FAILING = "promised to pass, but fails"
BREAKS_CONTRACT = "breaks the contract"
BREAKS_LAW = "against a basic law"  # One of every formulation, whatever its traits state.
BROKEN_BY_PASSING = "stated to fail, but passes"
NOT_JUDGED = "not judged"
OMITTED = "not asked: "  # The beginning of the reason of a row that another row made pointless.
WRONG_TRAITS = "wrong traits"
NOT_HERE = "needs "  # The beginning of the reason of a row without cases on the place of the run.
OF_TRAITS = "traits: "  # The beginning of the reason of a row whose traits name no witness that can be judged.
OF_TANGENT = "; and of the tangent: "  # Between the diagnosis of the forces and that of the tangent.
NOTHING_JUDGED = "Nothing was judged: no property applies."
OPPOSITE_SIGN = (
    "your forces have the opposite sign: contact must push the slave along the master's outward normal; "
    "see docs/concepts/signs.md"
)


class Result(StrEnum):
    """The word for a row in every table and page: the verdict, seen beside what the formulation states."""

    PASS = "pass"
    FAIL = "fail"
    FAILS_AS_STATED = "fails as stated"
    BROKEN_PROMISE = "BROKEN PROMISE"
    CRASHED = "crashed"
    WRONG_TRAITS = "wrong traits"
    UNDECIDED = "undecided"
    NOT_JUDGED = "not judged"
    OMITTED = "not asked"
    NOT_APPLICABLE = "not applicable"
    NOT_PROVIDED = "not provided"
    NOT_LOADED = "not loaded"


_WAYS_TO_FAIL = {
    Result.BROKEN_PROMISE: "against a promise",
    BREAKS_LAW: BREAKS_LAW,
    BREAKS_CONTRACT: "against the contract",
    Result.CRASHED: "by a crash",
    Result.WRONG_TRAITS: "by a mistake in the traits",
    Result.FAIL: "without a promise",
    Result.FAILS_AS_STATED: "as it states",
}
_MOST_NAMED = 3  # Formulations that a conclusion names.
# The probability below which a count is no chance. A run of a thousand rows accuses one by chance once in ten runs.
BY_CHANCE = 1e-4
CaseKey = tuple[str, Verdict, bool]  # All that counts depend on: kind, verdict, and whether the case was idle.


@dataclass(frozen=True, slots=True)
class CaseCounts:
    """Numbers of cases."""

    judged: int = 0  # The cases that were decided: they pass, fail or crash.
    failed: int = 0  # Those of the judged cases that fail or crash.
    undecided: int = 0  # The cases that were measured, but left open whether they pass.
    idle: int = 0  # Those of the judged cases in which nothing was in contact, so that a pass says little.

    def __add__(self, other: CaseCounts) -> CaseCounts:
        return CaseCounts(*map(add, astuple(self), astuple(other)))

    @property
    def cases(self) -> int:
        """The number of all cases."""
        return self.judged + self.undecided

    @property
    def undecided_share(self) -> float:
        """The share of undecided cases, 0 to 1."""
        return self.undecided / self.cases if self.cases else 0.0

    @property
    def contact_share(self) -> float:
        """The share of judged cases in which something was in contact, 0 to 1; 0 if none was judged."""
        return (self.judged - self.idle) / self.judged if self.judged else 0.0

    @property
    def idle_share(self) -> float:
        """The share of idle cases, 0 to 1."""
        return self.idle / self.cases if self.cases else 0.0


def total(counts: Iterable[CaseCounts]) -> CaseCounts:
    """Return the sum of counts."""
    return sum(counts, start=CaseCounts())


def add_by_kind(tables: Iterable[Mapping[str, CaseCounts]]) -> dict[str, CaseCounts]:
    """Return the sums of tables {kind: counts}, the kinds in the order of the tables."""
    sums: dict[str, CaseCounts] = {}
    for table in tables:
        for kind, counts in table.items():
            sums[kind] = sums.get(kind, CaseCounts()) + counts
    return sums


def percent(share: float) -> str:
    """Return a share in percent; one that is not 0 never looks like 0, and one that is not 1 never like 100 %."""
    if share in (0.0, 1.0):
        return f"{share:.0%}".replace("%", " %")
    return f"{min(max(100 * share, 0.1), 99.9):.1f} %"


def whole_percent(share: float) -> str:
    """Return a share in whole percent, in four characters at most; only 1 looks like 100 %, and only 0 like 0."""
    return f"{share:.0%}" if share in (0.0, 1.0) else f"{min(max(round(100 * share), 1), 99)}%"


def exceeds(count: int, number: int, share: float) -> bool:
    """Return whether `count` or more of `number` cases, each of probability `share`, are rarer than `BY_CHANCE`.

    The binomial term of n + 1 is ratio × the term of n, with ratio = (N − n) p / ((n + 1) (1 − p)). It is below 1 for n
    above N p, and falls with n. So all terms behind n add up to at most term × ratio / (1 − ratio). They are left out
    as soon as this is below the roundoff of the sum.
    """
    if count <= number * share or not 0 < share < 1:
        return count > number * share
    total = 0.0
    for n in range(count, number + 1):
        exponent = n * log(share) + (number - n) * log1p(-share)
        term = exp(exponent + lgamma(number + 1) - lgamma(n + 1) - lgamma(number - n + 1))
        total += term
        ratio = (number - n) * share / ((n + 1) * (1 - share))
        if term * ratio <= UNIT_ROUNDOFF * total * (1 - ratio):
            break
    return total < BY_CHANCE


@dataclass(frozen=True, slots=True)
class ClosestNumber:
    """The number of a row that came closest to its tolerance, or went furthest beyond it."""

    number: CheckedNumber
    case: int | None  # The number of the random case; None for the witness.


@dataclass(frozen=True, slots=True)
class Tally:
    """The counts over all outcomes of a row."""

    verdicts: Mapping[Verdict, int]  # Numbers of random cases with each verdict.
    # {reason: number of random cases} of the cases that were not decided, the most frequent first.
    reasons: Mapping[str, int]
    counts: CaseCounts  # The numbers of planned cases that were judged, failed, undecided and idle.
    kinds: Mapping[str, CaseCounts]  # {kind of situation: the same numbers}; empty if the cases are of no kind.
    breach: bool  # The plugin broke the contract in some case, the witness included.
    # The closest number of all decided cases, the witness included; None if nothing was measured.
    closest: ClosestNumber | None

    @classmethod
    def from_outcomes(cls, info: PropertyInfo, outcomes: Sequence[Outcome], witness: Outcome | None) -> Tally:
        """Count in one pass; the first of equally close numbers is the closest."""
        verdicts: Counter[Verdict] = Counter()
        reasons: Counter[str] = Counter()
        keys: Counter[CaseKey] = Counter()
        breach = False
        closest: ClosestNumber | None = None
        cases: Iterable[tuple[int | None, Outcome]] = enumerate(outcomes)
        for case, outcome in cases if witness is None else chain(cases, [(None, witness)]):
            breach = breach or outcome.breach
            if case is not None:
                verdicts[outcome.verdict] += 1
                idle = outcome.measurement is not None and outcome.measurement.idle
                keys[outcome.case_or_summary.kind, outcome.verdict, idle] += 1
                if not outcome.decided:
                    reasons[outcome.reason] += 1
            for number in checked_numbers(info, outcome.measurement) if outcome.decided else ():
                if closest is None or number.ratio > closest.number.ratio:
                    closest = ClosestNumber(number, case)
        kinds = dict.fromkeys(info.kinds, CaseCounts())
        # The kinds of the property first; cases of no kind are under the empty word, at the end.
        for (kind, verdict, idle), n in sorted(keys.items(), key=lambda entry: (not entry[0][0], entry[0])):
            is_open, failed = verdict is Verdict.UNDECIDED, n * (verdict in FAILED)
            counts = CaseCounts(undecided=n) if is_open else CaseCounts(judged=n, failed=failed, idle=n * idle)
            kinds[kind] = kinds.get(kind, CaseCounts()) + counts
        counts, reasons_in_order = total(kinds.values()), dict(reasons.most_common())
        return cls(verdicts, reasons_in_order, counts, kinds if any(kinds) else {}, breach, closest)


@dataclass(frozen=True, slots=True, eq=False)
class NodalForces:
    """The forces (n_nodes, dim) that push the nodes of a case: a formulation's, and the exact ones where known."""

    of_formulation: FloatArray
    exact: FloatArray | None = None

    def __post_init__(self) -> None:
        for name in ("of_formulation", "exact"):
            if (forces := getattr(self, name)) is not None:
                object.__setattr__(self, name, freeze(forces, np.float64))


@dataclass(frozen=True, eq=False)
class Row:
    """The result of one formulation on one property.

    Attributes
    ----------
    formulation : str
        The name on the command line, with options.
    info : PropertyInfo
        The property.
    verdict : Verdict
        The verdict over all cases: crashed and fail first, then not judged, then pass.
    promise : bool | None
        True if the formulation promises to pass, False if it states that it fails, None if it states nothing.
    promised_by : str
        The traits from which the promise follows, empty if it is one of every formulation or there is none.
    known : str
        The reason why a failure is known to the caller, empty if it is not.
    reason : str
        The reason why the verdict is no pass, from the worst case.
    planned : int
        The number of cases that were planned: random ones, or those of a finite list.
    outcomes : Sequence[Outcome]
        The outcomes of the planned cases, in order.
    witness : Outcome | None
        The outcome of the named case with which a formulation proves that it fails.
    shrunk : Outcome | None
        The smallest case found that fails; None if no planned case failed, or nothing was shrunk.
    first : Outcome | None
        The first planned case that clearly fails, where nothing was shrunk and no witness shows the failure.
    seconds : float
        Time spent judging, shrinking excluded.
    forces : NodalForces | None
        The nodal forces on the counterexample, if that has no bodies.
    """

    formulation: str
    info: PropertyInfo
    verdict: Verdict
    promise: bool | None
    promised_by: str = ""
    known: str = ""
    reason: str = ""
    planned: int = 0
    outcomes: Sequence[Outcome] = ()
    witness: Outcome | None = None
    shrunk: Outcome | None = None
    first: Outcome | None = None
    seconds: float = 0.0
    forces: NodalForces | None = None

    def __post_init__(self) -> None:
        clean(self, names=("formulation",), lines=("promised_by", "known", "reason"))

    @property
    def property_id(self) -> str:
        """The id of the property."""
        return self.info.id

    @cached_property
    def tally(self) -> Tally:
        """The counts over all outcomes, computed at the first use."""
        return Tally.from_outcomes(self.info, self.outcomes, self.witness)

    @property
    def judged(self) -> int:
        """The number of random cases that were decided."""
        return sum(self.tally.verdicts.get(verdict, 0) for verdict in DECIDED)

    @property
    def undecided(self) -> int:
        """The number of random cases that were measured, but left open whether they pass."""
        return self.tally.verdicts.get(Verdict.UNDECIDED, 0)

    @property
    def foreign(self) -> int:
        """The number of random cases that the formulation does not take, which count as undecided too."""
        return sum(self.tally.reasons.get(reason, 0) for reason in FOREIGN)

    @property
    def idle(self) -> int:
        """The number of judged random cases in which nothing was in contact."""
        return self.tally.counts.idle

    @property
    def contact_share(self) -> float | None:
        """The share of judged random cases in which something was in contact, 0 to 1; None if none was judged."""
        counts = self.tally.counts
        return counts.contact_share if counts.judged else None

    @property
    def suspicion(self) -> str:
        """The remark that more cases are undecided than those of right formulations; empty if they are not.

        More than twice the usual share counts, and only if a binomial distribution makes that no chance.
        """
        counts, usual = self.tally.counts, self.info.usual_undecided
        if not exceeds(counts.undecided - self.foreign, counts.cases - self.foreign, min(2 * usual, 1.0)):
            return ""
        share = f"{percent(counts.undecided_share)} of the cases are undecided"
        return f"{share}, of right formulations {percent(usual)}: what is undecided may hide what is wrong"

    def _names_of(self, *verdicts: Verdict) -> tuple[str, ...]:
        if not any(self.tally.verdicts.get(verdict, 0) for verdict in verdicts):
            return ()
        cases = (outcome.case_or_summary for outcome in self.outcomes if outcome.verdict in verdicts)
        return tuple(case.name for case in cases if case.name)

    @property
    def failing_names(self) -> tuple[str, ...]:
        """The names of the cases that fail or crash, where cases have names, in their order."""
        return self._names_of(*FAILED)

    @property
    def undecided_names(self) -> tuple[str, ...]:
        """The names of the cases that are undecided, where cases have names."""
        return self._names_of(Verdict.UNDECIDED)

    @property
    def breach(self) -> bool:
        """Return whether the plugin broke the contract somewhere, which fails a run whatever the formulation states."""
        return self.tally.breach

    @property
    def closest(self) -> ClosestNumber | None:
        """The number that came closest to its tolerance, or went furthest beyond it, the witness included."""
        return self.tally.closest

    @property
    def fails_in_words(self) -> bool:
        """True if the row fails although every number keeps its tolerance: its reason says what is wrong."""
        return self.verdict is Verdict.FAIL and (self.closest is None or self.closest.number.ratio <= 1)

    @property
    def closest_name(self) -> str:
        """The name of the planned case with the closest number; empty if the case has none, or is the witness."""
        if self.closest is None or self.closest.case is None:
            return ""
        return self.outcomes[self.closest.case].case_or_summary.name

    @property
    def traits_are_wrong(self) -> bool:
        """Return whether nothing was judged, since the traits state a failure and name no case that shows it."""
        return self.verdict is Verdict.CRASHED and self.reason.startswith(OF_TRAITS)

    @property
    def omitted(self) -> bool:
        """Return whether the row was left out, since an earlier one had shown a mistake that explains all others."""
        return self.verdict is Verdict.NOT_JUDGED and self.reason.startswith(OMITTED)

    @property
    def is_trait(self) -> bool:
        """Return whether the row fails by what method it is, which is no mistake, and breaks no promise."""
        return self.info.role == "trait" and self.verdict is Verdict.FAIL and not self.unexpected

    @property
    def unexpected(self) -> str:
        """The reason why this row makes the run fail; empty if it does not."""
        match self.verdict:
            case Verdict.CRASHED:
                return "" if self.known else WRONG_TRAITS if self.traits_are_wrong else "crashed"
            case Verdict.NOT_JUDGED:
                return NOT_JUDGED
            case Verdict.FAIL if not self.known:
                broken = BROKEN_BY_FAILING if self.promised_by else BREAKS_LAW
                return BREAKS_CONTRACT if self.breach else broken if self.promise else ""
            case Verdict.NOT_PROVIDED if self.promise and not self.known:
                return "promised to pass, but a part that it needs is not provided"
            case Verdict.PASS if self.promise is False:
                return BROKEN_BY_PASSING
            case Verdict.PASS if self.known:
                return "listed as a known failure, but passes"
        return ""

    @property
    def result(self) -> Result:
        """The word for the row in tables and pages."""
        if self.unexpected and self.verdict not in (Verdict.CRASHED, Verdict.NOT_JUDGED):
            return Result.BROKEN_PROMISE
        if self.verdict in FAILED and not self.unexpected and (self.promise is False or self.known):
            return Result.FAILS_AS_STATED
        if self.omitted:
            return Result.OMITTED
        return Result.WRONG_TRAITS if self.traits_are_wrong else Result[self.verdict.name]


def overall(rows: Iterable[Row]) -> Result:
    """Return the worst result of some rows, without traits of the method; a pass only if a promise to pass is kept."""
    rows = [row for row in rows if not row.is_trait]
    if any(row.unexpected and row.verdict is not Verdict.NOT_JUDGED for row in rows):
        return Result.BROKEN_PROMISE
    results = {row.result for row in rows}
    kept = any(row.promise and row.verdict is Verdict.PASS for row in rows)
    in_order = Result.FAIL, Result.NOT_JUDGED, Result.FAILS_AS_STATED, Result.UNDECIDED
    return next((each for each in in_order if each in results), Result.PASS if kept else Result.NOT_APPLICABLE)


def describe_failures(rows: Iterable[Row]) -> str:
    """Return how many rows of a formulation fail, traits of the method left out, and in which way; empty for none."""
    rows = [row for row in rows if not row.is_trait]
    failing = [row for row in rows if row.verdict in FAILED]
    if not failing:
        return ""
    tested = any(row.info.role == "exact" and row.info.family == "patch" for row in failing)
    patch = ", the patch test among them" if tested else ""
    words = f"fails {len(failing)} of {sum(row.verdict in DECIDED for row in rows)}{patch}"
    counts = Counter(row.unexpected if row.unexpected in _WAYS_TO_FAIL else row.result for row in failing)
    if len(counts) > 1:
        return f"{words}: {', '.join(f'{counts[each]} {way}' for each, way in _WAYS_TO_FAIL.items() if counts[each])}"
    return f"{words}, {'and promises none of these' if counts[Result.FAIL] else _WAYS_TO_FAIL[next(iter(counts))]}"


def describe(rows: Sequence[Row]) -> str:
    """Return what became of the rows of a formulation: what fails comes first, and what passes where nothing does."""
    failures, counts = describe_failures(rows), Counter(row.result for row in rows if row.verdict not in FAILED)
    others = (f"{counts[each]} {each}" for each in Result if counts[each] and not (failures and each is Result.PASS))
    mark = "✗ " if overall(rows) in (Result.BROKEN_PROMISE, Result.FAIL) else ""
    return f"{mark}{'; '.join(filter(None, (failures, ', '.join(others))))}" or "nothing was checked"


@dataclass(frozen=True, slots=True, eq=False)
class NotLoaded:
    """A formulation (or a property, under its id) that could not be loaded, so that nothing was checked."""

    formulation: str
    reason: str

    def __post_init__(self) -> None:
        clean(self, names=("formulation",), lines=("reason",))


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """The results of one run.

    Attributes
    ----------
    rows : tuple[Row, ...]
        The results, formulation by formulation, property by property.
    not_loaded : tuple[NotLoaded, ...]
        The plugins that did not load.
    provided : Mapping[str, Mapping[str, bool]]
        {formulation: {part of the contract: provided}}.
    provenance : Mapping[str, str]
        Where the run comes from: versions, seed, profile, command, ….
    opposite_signs : tuple[str, ...]
        The formulations whose forces have the opposite sign, as `OPPOSITE_SIGN` says. Each makes the run fail.
    diagnoses : Mapping[str, str]
        {formulation that fails: what kind of mistake it makes}, where a rule knows it.
    """

    rows: tuple[Row, ...]
    not_loaded: tuple[NotLoaded, ...] = ()
    provided: Mapping[str, Mapping[str, bool]] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)
    opposite_signs: tuple[str, ...] = ()
    diagnoses: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for attribute, value in {
            "provided": {name_line(name): parts for name, parts in self.provided.items()},
            "provenance": {name_line(name): one_line(value, LONGEST_FACT) for name, value in self.provenance.items()},
            "opposite_signs": tuple(map(name_line, self.opposite_signs)),
            "diagnoses": {name_line(name): one_line(text) for name, text in self.diagnoses.items()},
        }.items():
            object.__setattr__(self, attribute, value)

    @property
    def formulations(self) -> tuple[str, ...]:
        """The names of all formulations that loaded, in the order of the run."""
        return tuple(dict.fromkeys([*(row.formulation for row in self.rows), *self.provided]))

    @property
    def properties(self) -> dict[str, PropertyInfo]:
        """All properties {id: property}, in the order of the run."""
        return {row.property_id: row.info for row in self.rows}

    @property
    def row_of(self) -> dict[tuple[str, str], Row]:
        """The rows, {(formulation, property id): row}."""
        return {(row.formulation, row.property_id): row for row in self.rows}

    @property
    def unexpected(self) -> tuple[Row, ...]:
        """The rows that make the run fail."""
        return tuple(row for row in self.rows if row.unexpected)

    @property
    def promises_kept(self) -> bool:
        """Return whether all promises are kept, properties judged, at least one, plugins loaded, and signs right."""
        is_judged = any(row.verdict not in (Verdict.NOT_APPLICABLE, Verdict.NOT_PROVIDED) for row in self.rows)
        return is_judged and not (self.not_loaded or self.unexpected or self.opposite_signs)

    def count(self, *results: Result) -> int:
        """Return the number of rows with one of these results."""
        return sum(row.result in results for row in self.rows)

    @property
    def result(self) -> Result:
        """The word for the run, as for a row; it is a pass only if nothing fails, whoever promised it."""
        return overall(self.rows) if self.promises_kept else Result.BROKEN_PROMISE

    @property
    def conclusion(self) -> str:
        """The sentence about a run of which no promise is broken: what fails all the same, or was not judged."""
        words = {name: describe_failures(self.rows_of(name)) for name in self.formulations}
        if failures := [f"{name} {text}" for name, text in words.items() if text]:
            more = f"; and {len(failures) - _MOST_NAMED} more fail" if len(failures) > _MOST_NAMED else ""
            stated = any(row.promised_by or row.promise is False for row in self.rows)
            end = "No promise is broken." if stated else "No trait is stated, so no promise can be broken."
            return f"{'; '.join(failures[:_MOST_NAMED])}{more}. {end}"
        if unasked := {row.formulation for row in self.rows} - {row.formulation for row in self.rows if row.planned}:
            return f"Nothing was judged of {', '.join(sorted(unasked))}: no property applies. What was judged is kept."
        names = [f"{row.formulation} {row.property_id}" for row in self.rows if row.result is Result.UNDECIDED]
        if names:
            return f"Every promise that was judged is kept. Undecided: {'; '.join(names)}."
        if self.result is Result.PASS:
            return "Every promise is kept and every property was judged."
        return "Nothing fails, and nothing was promised."

    @property
    def promises(self) -> str:
        """The numbers of rows by promise, in a sentence; traits of the method, and what does not apply, are none."""
        rows = (row for row in self.rows if row.verdict is not Verdict.NOT_APPLICABLE and not row.is_trait)
        counts = Counter(row.promise for row in rows)
        return f"Properties promised to pass: {counts[True]}, to fail: {counts[False]}, neither: {counts[None]}."

    def only(self, property_ids: Collection[str]) -> Run:
        """Return the run without all other properties."""
        return replace(self, rows=tuple(row for row in self.rows if row.property_id in property_ids))

    def rows_of(self, formulation: str) -> list[Row]:
        """Return the rows of a formulation."""
        return [row for row in self.rows if row.formulation == formulation]


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """The cases of one property, of all formulations that it was judged for."""

    info: PropertyInfo
    n_formulations: int  # The number of formulations with at least one case.
    counts: CaseCounts
    # {kind of situation: counts}, in the order of the property; empty if its cases are of no kind.
    kinds: Mapping[str, CaseCounts]
    # {reason: number of cases} of the undecided cases, the most frequent first. Numbers in a reason are replaced by
    # "…", so that cases that differ in a number alone have one reason.
    reasons: Mapping[str, int]


def coverage_of(run: Run) -> tuple[Coverage, ...]:
    """Return the coverage of each property of which a case was judged, in the order of the run."""
    coverage = []
    for id_ in run.properties:
        rows = [row for row in run.rows if row.property_id == id_ and row.outcomes]
        if not rows:
            continue
        reasons: Counter[str] = Counter()
        for row in rows:
            for reason, number in row.tally.reasons.items():
                reasons[_NUMBER.sub("…", reason)] += number
        counts, kinds = total(row.tally.counts for row in rows), add_by_kind(row.tally.kinds for row in rows)
        coverage.append(Coverage(rows[0].info, len(rows), counts, kinds, dict(reasons.most_common())))
    return tuple(coverage)
