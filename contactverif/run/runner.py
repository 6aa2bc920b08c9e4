"""The runner: it judges the planned cases of each property, then shrinks what failed.

Rules for the next editor:

- All planned cases of a row are judged before one is shrunk, so that a failure ends nothing early.
- The cases of a property depend on the seed and the property alone, neither on the formulation nor on other properties.
- A finite list of named cases is planned whole, whatever the number of examples.
- Whatever a plugin does is an outcome. What the harness or a property does wrong is an exception.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from time import perf_counter
from typing import Literal, cast

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError
from contactverif.contract.interface import Interface
from contactverif.contract.names import unknown_name_error
from contactverif.contract.property import Outcome, Property, PropertyInfo, Verdict, checked_numbers, judge
from contactverif.contract.result import JUDGED_SHARE, NotLoaded, Row, Run
from contactverif.contract.subject import OPTIONAL_PARTS, STATED_PARTS, Subject
from contactverif.run.driver import SHRINK_CALLS, CaseSource, PlannedCases, draw_cases, shrink
from contactverif.run.profiles import PROFILES, Profile, profile_named
from contactverif.run.provenance import collect_provenance
from contactverif.run.sign_check import has_opposite_sign
from contactverif.scenes.named_states import named_case

__all__ = ["PROFILES", "Profile", "Progress", "judge_case", "profile_named", "run"]

CLEAR_RATIO = 1000.0  # A shrunk case need not fail by more than this many tolerances.

Phase = Literal["drawing", "judging", "shrinking"]


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a run with one property of one formulation.

    Attributes
    ----------
    formulation, property_id : str
        The names on the command line.
    phase : Phase
        The kind of work.
    count, planned : int
        The numbers of finished cases and of all cases; shrinking may end early.
    """

    formulation: str
    property_id: str
    phase: Phase
    count: int
    planned: int


def run(
    subjects: Sequence[Subject | NotLoaded],
    properties: Sequence[Property | NotLoaded],
    *,
    profile: Profile | str = "dev",
    examples: int | None = None,
    seed: int | None = None,
    interface: Interface | None = None,
    scene: Case | None = None,
    known: Mapping[str, str] | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Run:
    """Check every property of every formulation.

    Parameters
    ----------
    subjects : Sequence[Subject | NotLoaded]
        The formulations, as the registry loads them. One that did not load is reported and fails the run.
    properties : Sequence[Property | NotLoaded]
        The properties, likewise.
    profile : Profile | str
        The numbers of cases and the seed.
    examples, seed : int | None
        Numbers that overrule those of the profile.
    interface : Interface | None
        Check everything on this interface, with random states, instead of on random interfaces.
    scene : Case | None
        Check what needs bodies on this scene alone, and all else on its interface. A pass there breaks no statement
        that the formulation fails.
    known : Mapping[str, str] | None
        {property id: reason why its failure is known}.
    progress : Callable[[Progress], None] | None
        A function that is called after every case.

    Returns
    -------
    Run
        A row for each formulation and property.

    Raises
    ------
    MisuseError
        If a known failure names no property of this run, or a name stands there twice.
    """
    known = known or {}
    loaded = [subject for subject in subjects if isinstance(subject, Subject)]
    questions = [question for question in properties if isinstance(question, Property)]
    _check_once("formulation", [subject.name for subject in loaded])
    _check_once("property", [question.id for question in questions])
    _check_known(known, properties)
    resolved = (profile_named(profile) if isinstance(profile, str) else profile).resolve(examples=examples, seed=seed)
    assert resolved.seed is not None
    plan = _Plan(
        examples=resolved.examples,
        seed=resolved.seed,
        interface=interface if scene is None else scene.interface,
        scene=scene,
        known=known,
        report_progress=progress or (lambda _: None),
        cases={},
    )
    return Run(
        rows=tuple(_check_property(plan, subject, question) for subject in loaded for question in questions),
        not_loaded=tuple(item for item in (*subjects, *properties) if isinstance(item, NotLoaded)),
        provided={subject.name: {part: part in subject.provides for part in OPTIONAL_PARTS} for subject in loaded},
        opposite_signs=tuple(subject.name for subject in loaded if has_opposite_sign(subject)),
        provenance=collect_provenance(profile=resolved.name, examples=resolved.examples, seed=resolved.seed),
    )


def _check_once(argument: str, names: Sequence[str]) -> None:
    for name, times in Counter(names).items():
        if times > 1:
            raise MisuseError(argument, f"{name} {times} times", "each of them once")


def _check_known(known: Mapping[str, str], properties: Sequence[Property | NotLoaded]) -> None:
    ids = [item.id if isinstance(item, Property) else item.formulation for item in properties]
    for property_id in known:
        if property_id not in ids:
            raise unknown_name_error("known failure", property_id, ids)


def judge_case(question: Property, case: Case, subject: Subject) -> Outcome:
    """Judge one case, a new one or one that was stored. Whatever the plugin does is an outcome.

    Parameters
    ----------
    question : Property
        The property to check.
    case : Case
        The case to check it on.
    subject : Subject
        The formulation.

    Returns
    -------
    Outcome
        Verdict, reason and numbers.

    Raises
    ------
    Exception
        Any error of the harness or the property itself, with the case as a note.
    """
    start = perf_counter()

    def outcome(verdict: Verdict, reason: str, *, breach: bool = False) -> Outcome:
        return Outcome(case, verdict, reason, seconds=perf_counter() - start, breach=breach)

    try:
        with np.errstate(all="ignore"):  # A check of the answer reports NaN, not a warning on the way.
            measurement = question.measure(case, subject)
            verdict, reason = judge(question, measurement)
    except PluginError as error:
        kinds: dict[type, str] = {MemoryError: "memory", SystemExit: "exit"}
        kind = kinds.get(type(error.__cause__), "exception")
        return outcome(Verdict.CRASHED, f"{kind}: {error}")
    except NonFiniteError as error:
        return outcome(Verdict.FAIL, f"not finite: {error}", breach=True)
    except ContractError as error:
        return outcome(Verdict.FAIL, f"breaks the contract: {error}", breach=True)
    except Exception as error:
        error.add_note(f"while judging {question.id} of {subject.name} on {case!r}")
        raise
    return replace(outcome(verdict, reason), measurement=measurement)


@dataclass(frozen=True, slots=True)
class _Plan:
    """The data that all rows of a run share; `cases` fills up with the cases of each property."""

    examples: int
    seed: int
    interface: Interface | None
    scene: Case | None
    known: Mapping[str, str]
    report_progress: Callable[[Progress], None]
    cases: dict[str, PlannedCases]

    def key(self, question: Property) -> str:
        """Return the seed of a property, which does not depend on the other properties of the run."""
        return f"{self.seed}/{question.id}"

    def source(self, question: Property) -> CaseSource | None:
        """Return the source of the cases; None if the property cannot be checked on this interface or scene."""
        if not question.bodies:
            return cast("CaseSource | None", question.cases(self.interface))
        if self.interface is not None and self.scene is None:
            return None
        return cast("CaseSource | None", question.cases(self.scene))

    def progress(self, subject: Subject, question: Property, phase: Phase, planned: int) -> Callable[[int], None]:
        """Return a function that reports how many cases are finished."""
        return lambda count: self.report_progress(Progress(subject.name, question.id, phase, count, planned))

    def planned_cases(self, source: CaseSource, subject: Subject, question: Property) -> tuple[PlannedCases, int]:
        """Return the cases of the property, drawn once a run, and how many were planned."""
        if question.id not in self.cases:
            progress = self.progress(subject, question, "drawing", self.examples)
            self.cases[question.id] = draw_cases(
                source, seed=self.key(question), examples=self.examples, progress=progress
            )
        cases = self.cases[question.id]
        return cases, len(cases.cases) if cases.exhausted else self.examples


def _check_property(plan: _Plan, subject: Subject, question: Property) -> Row:
    """Return the row of one formulation and one property."""
    row = Row(
        formulation=subject.name,
        info=question.info,
        verdict=Verdict.PASS,
        promise=question.promise(subject.traits),
        known=plan.known.get(question.id, ""),
    )
    if reason := question.applicable(subject.traits):
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason=reason)
    if missing := question.needs - subject.provides:
        promise = row.promise if missing & STATED_PARTS else None
        reason = f"{', '.join(sorted(missing))}: not provided"
        return replace(row, verdict=Verdict.NOT_PROVIDED, promise=promise, reason=reason)
    source = plan.source(question)
    if source is None:
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason="this interface or scene has no such cases")
    if plan.scene is not None and row.promise is False:  # The formulation fails on some scene, not on every one.
        row = replace(row, promise=None)
    try:
        witness = _witness(subject, question, source) if row.promise is False else None
    except MisuseError as error:
        return replace(row, verdict=Verdict.CRASHED, reason=f"traits: {error}")
    row = _judge_all(plan, subject, question, row, source, witness)
    return replace(row, shrunk=_shrink(plan, source, subject, question, row))


def _judge_all(
    plan: _Plan,
    subject: Subject,
    question: Property,
    row: Row,
    source: CaseSource,
    witness: Case | None,
) -> Row:
    """Return the row with the outcomes of all planned cases, and the verdict over them."""
    cases, planned = plan.planned_cases(source, subject, question)
    progress = plan.progress(subject, question, "judging", planned)
    start = perf_counter()
    outcomes = []
    for case in cases.cases:
        outcomes.append(judge_case(question, case, subject))
        progress(len(outcomes))
    row = replace(
        row,
        planned=planned,
        outcomes=tuple(outcomes),
        witness=None if witness is None else _judge_witness(question, witness, subject, outcomes),
        seconds=perf_counter() - start,
    )
    verdict, reason = _verdict_over_all(row)
    if verdict is Verdict.NOT_JUDGED and question.bodies and _may_stay_undecided(plan, row, source):
        verdict = Verdict.UNDECIDED
        reason = row.outcomes[0].reason or reason if plan.scene is not None else reason
    return replace(row, verdict=verdict, reason=reason)


def _may_stay_undecided(plan: _Plan, row: Row, source: CaseSource) -> bool:
    """Return whether nobody promised that the scenes of a row can be decided.

    It is so for the one scene that a user names, and for a list of scenes about which the formulation states nothing:
    they may have no solution.
    """
    if plan.scene is not None:
        return bool(row.outcomes) and not row.judged
    return row.promise is None and row.undecided > 0 and isinstance(source, tuple)


def _judge_witness(question: Property, witness: Case, subject: Subject, outcomes: Sequence[Outcome]) -> Outcome:
    """Return the outcome of the witness, which a case of a finite list has already."""
    judged = (outcome for outcome in outcomes if outcome.case_or_summary is witness)
    return next(judged, None) or judge_case(question, witness, subject)


def _witness(subject: Subject, question: Property, source: CaseSource) -> Case:
    """Return the case that the traits name as a proof that the formulation fails.

    It is a case of the property's own finite list, if that has one of this name, else a named state or scene.
    """
    name = subject.traits.witness(question.id)
    if name is None:
        raise MisuseError(
            "witnesses", f"none for {question.id}, which {subject.name} says it does not pass", "the name of a case"
        )
    if isinstance(source, tuple) and (matches := [case for case in source if case.name == name]):
        return matches[0]
    if not question.bodies:
        return named_case(name)
    # The catalogue imports bodies and Newton's method, so it is imported only where it is needed.
    from contactverif.scenes.catalogue import load_scene_case

    return load_scene_case(name)


def _verdict_over_all(row: Row) -> tuple[Verdict, str]:
    """Return verdict and reason of a row from its outcomes."""
    everything = [*row.outcomes, *([row.witness] if row.witness else [])]
    worst = max(everything, key=lambda outcome: _badness(row.info, outcome), default=None)
    if worst is not None and worst.verdict in (Verdict.CRASHED, Verdict.FAIL):
        return worst.verdict, _reason_with_name(row, worst)
    if row.judged < JUDGED_SHARE * row.planned:
        cause = next((f"most often because {reason}" for reason in row.tally.reasons), "no more cases could be made")
        return Verdict.NOT_JUDGED, f"{row.judged} of {row.planned} cases judged; {cause}"
    if reason := _too_idle(row):
        return Verdict.NOT_JUDGED, reason
    return Verdict.PASS, ""


def _too_idle(row: Row) -> str:
    """Return why too few cases were in contact, or an empty string. One idle case may be chance; all of them is not."""
    counts, least = row.tally.counts, row.info.least_contact
    if not counts.idle or counts.contact_share >= least or (counts.idle == 1 and counts.judged > 1):
        return ""
    if counts.idle == counts.judged:
        return "nothing was in contact in any case: nothing was judged"
    return f"{counts.judged - counts.idle} of {counts.judged} judged cases in contact, needed {least:.0%}"


def _reason_with_name(row: Row, outcome: Outcome) -> str:
    """Return the reason of an outcome, with the name of its case before it where a finite list has named it."""
    name = outcome.case.name
    return f"{name}: {outcome.reason}" if name and outcome is not row.witness else outcome.reason


def _badness(info: PropertyInfo, outcome: Outcome) -> tuple[int, float]:
    """Return a key that orders outcomes: crashes, breaches of the contract, failures by how far beyond tolerance."""
    if outcome.verdict is Verdict.CRASHED:
        return 3, inf
    if outcome.verdict is not Verdict.FAIL:
        return 0, 0.0
    if outcome.breach:
        return 2, inf
    if outcome.measurement is None or outcome.measurement.broken:
        return 1, inf
    return 1, max((number.ratio for number in checked_numbers(info, outcome.measurement)), default=inf)


def _shrink(plan: _Plan, source: CaseSource, subject: Subject, question: Property, row: Row) -> Outcome | None:
    """Return the smallest case that fails as badly as the worst random one; None if no random case failed.

    Of a finite list of named cases it is the first that fails as badly.

    It crashes if something crashed, and breaks the contract if something did. Of failures by a number it must be a
    clear one, half-way on a logarithmic scale between the tolerance and the worst value: the smallest case that fails
    at all often fails by a hair, and convinces nobody.
    """
    badness = [_badness(row.info, outcome) for outcome in row.outcomes]
    kind, worst = max(badness, default=(0, 0.0))
    if kind == 0:
        return None
    least = (kind, min(CLEAR_RATIO, sqrt(worst)) if kind == 1 else worst)
    first = next(number for number, bad in enumerate(badness) if bad >= least and bad[0] == kind)
    smallest = row.outcomes[first]
    progress = plan.progress(subject, question, "shrinking", SHRINK_CALLS)
    calls = 0

    def fails(case: Case) -> bool:
        nonlocal smallest, calls
        calls += 1
        progress(calls)
        outcome = judge_case(question, case, subject)
        bad = _badness(row.info, outcome)
        if bad[0] != kind or bad < least:
            return False
        smallest = outcome
        return True

    shrink(source, seed=plan.key(question), examples=plan.examples, first=first, fails=fails)
    return smallest
