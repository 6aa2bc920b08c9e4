"""Judges the planned cases of each property, then shrinks what failed. The command line and pytest both come here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from time import perf_counter
from typing import Literal, cast

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError
from contactverif.contract.interface import Interface
from contactverif.contract.names import unknown_name_error
from contactverif.contract.property import Outcome, Property, Verdict, excess, judge
from contactverif.contract.result import JUDGED_SHARE, NotLoaded, Row, Run
from contactverif.contract.subject import OPTIONAL_PARTS, Subject
from contactverif.run.driver import SHRINK_CALLS, PlannedCases, draw_cases, shrink
from contactverif.run.profiles import PROFILES, Profile, profile_named
from contactverif.run.provenance import collect_provenance
from contactverif.scenes.named_states import named_case

__all__ = ["PROFILES", "Profile", "Progress", "judge_case", "profile_named", "run"]

CLEARLY = 1000.0  # a shrunk case need not fail by more than this many tolerances


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a run is: `done` of `planned` cases of one property of one formulation; shrinking may end early."""

    formulation: str
    property_id: str
    phase: Literal["drawing", "judging", "shrinking"]
    done: int
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
    """Ask every property of every formulation.

    Parameters
    ----------
    subjects, properties : Sequence[Subject | NotLoaded] or Sequence[Property | NotLoaded]
        As the registry loads them; what did not load is reported and fails the run.
    profile, examples, seed : Profile | str or int | None
        How much is asked; examples and seed overrule the profile.
    interface : Interface | None
        Ask everything on this one, with random states, instead of on random interfaces.
    scene : Case | None
        Ask what needs bodies of this one alone, and all else on its interface. That it passes there breaks no
        promise to fail.
    known : Mapping[str, str] | None
        {property id: why its failure is known}.
    progress : Callable[[Progress], None] | None
        Called after every case.

    Raises
    ------
    MisuseError
        If a known failure names no property of this run, or something is asked twice.
    """
    known = known or {}
    questions = [question for question in properties if isinstance(question, Property)]
    loaded = [subject for subject in subjects if isinstance(subject, Subject)]
    not_loaded = tuple(item for item in (*subjects, *properties) if isinstance(item, NotLoaded))
    _check_once("formulation", [subject.name for subject in loaded])
    _check_once("property", [question.id for question in questions])
    asked = [item.id if isinstance(item, Property) else item.formulation for item in properties]
    for property_id in known:
        if property_id not in asked:
            raise unknown_name_error("known failure", property_id, asked)
    settled = (profile_named(profile) if isinstance(profile, str) else profile).resolve(examples=examples, seed=seed)
    assert settled.seed is not None
    if scene is not None:
        interface = scene.interface
    plan = _Plan(settled.examples, settled.seed, interface, scene, known, progress or (lambda _: None), {})
    return Run(
        rows=tuple(_row(plan, subject, question) for subject in loaded for question in questions),
        not_loaded=not_loaded,
        provided={subject.name: {part: part in subject.provides for part in OPTIONAL_PARTS} for subject in loaded},
        provenance=collect_provenance(profile=settled.name, examples=settled.examples, seed=settled.seed),
    )


def _check_once(what: str, names: Sequence[str]) -> None:
    for name, times in Counter(names).items():
        if times > 1:
            raise MisuseError(what, f"{name} {times} times", "each of them once")


def judge_case(question: Property, case: Case, subject: Subject) -> Outcome:
    """What becomes of one case; also how a stored one is judged again. Whatever the plugin does is an outcome.

    Raises
    ------
    Exception
        From the harness itself or the property, whose mistake it then is, with the case as a note.
    """
    start = perf_counter()

    def outcome(verdict: Verdict, reason: str, *, breach: bool = False) -> Outcome:
        return Outcome(case, verdict, reason, seconds=perf_counter() - start, breach=breach)

    try:
        with np.errstate(all="ignore"):  # NaN is told by a check of the answer, not by a warning in between
            measurement = question.measure(case, subject)
            verdict, reason = judge(question, measurement)
    except PluginError as error:
        hows: dict[type, str] = {MemoryError: "memory", SystemExit: "exit"}
        how = hows.get(type(error.__cause__), "exception")
        return outcome(Verdict.CRASHED, f"{how}: {error}")
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
    """What all rows of a run share; `drawn` fills up with the cases of each property."""

    examples: int
    seed: int
    interface: Interface | None
    scene: Case | None
    known: Mapping[str, str]
    progress: Callable[[Progress], None]
    drawn: dict[str, PlannedCases]

    def key(self, question: Property) -> str:
        """The seed of a property, which does not depend on what else is asked."""
        return f"{self.seed}/{question.id}"

    def strategy(self, question: Property) -> SearchStrategy[Case] | None:
        """Of its cases; None where it cannot be asked of what is given."""
        if not question.bodies:
            return cast("SearchStrategy[Case] | None", question.cases(self.interface))
        if self.interface is not None and self.scene is None:
            return None
        return cast("SearchStrategy[Case] | None", question.cases(self.scene))


def _row(plan: _Plan, subject: Subject, question: Property) -> Row:
    row = Row(
        formulation=subject.name,
        question=question,
        verdict=Verdict.PASS,
        promise=question.promise(subject.traits),
        known=plan.known.get(question.id, ""),
    )
    if reason := question.applicable(subject.traits):
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason=reason)
    if missing := question.needs - subject.provides:
        return replace(row, verdict=Verdict.NOT_PROVIDED, reason=f"{', '.join(sorted(missing))}: not provided")
    strategy = plan.strategy(question)
    if strategy is None:
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason="cannot be asked of what is given")
    if plan.scene is not None and row.promise is False:  # some scene fails, this one need not
        row = replace(row, promise=None)
    try:
        witness_case = _witness(subject, question) if row.promise is False else None
    except MisuseError as error:
        return replace(row, verdict=Verdict.CRASHED, reason=f"traits: {error}")

    def told(phase: Literal["drawing", "judging", "shrinking"], done: int, planned: int) -> None:
        plan.progress(Progress(subject.name, question.id, phase, done, planned))

    if question.id not in plan.drawn:
        plan.drawn[question.id] = draw_cases(
            strategy,
            seed=plan.key(question),
            examples=plan.examples,
            progress=lambda done: told("drawing", done, plan.examples),
        )
    drawn = plan.drawn[question.id]
    planned = len(drawn.cases) if drawn.exhausted else plan.examples
    start = perf_counter()
    outcomes = []
    for case in drawn.cases:
        outcomes.append(judge_case(question, case, subject))
        told("judging", len(outcomes), planned)
    witness = judge_case(question, witness_case, subject) if witness_case is not None else None
    row = replace(row, planned=planned, outcomes=tuple(outcomes), witness=witness, seconds=perf_counter() - start)
    verdict, reason = _overall(row)
    if verdict is Verdict.NOT_JUDGED and plan.scene is not None and question.bodies and row.outcomes and not row.judged:
        # there is one case, and nobody said that it can be decided
        verdict, reason = Verdict.UNDECIDED, row.outcomes[0].reason or reason
    row = replace(row, verdict=verdict, reason=reason)
    smallest = _shrunk(plan, strategy, subject, row, lambda asked: told("shrinking", asked, SHRINK_CALLS))
    return replace(row, shrunk=smallest)


def _witness(subject: Subject, question: Property) -> Case:
    name = subject.traits.witness(question.id)
    if name is None:
        raise MisuseError(
            "witnesses", f"none for {question.id}, which {subject.name} says it does not pass", "the name of a case"
        )
    if not question.bodies:
        return named_case(name)
    from contactverif.scenes.catalogue import (
        load_scene_case,  # brings bodies and Newton's method: only where they are needed
    )

    return load_scene_case(name)


def _overall(row: Row) -> tuple[Verdict, str]:
    """Verdict and reason of a row from its outcomes."""
    everything = [*row.outcomes, *([row.witness] if row.witness else [])]
    worst = max(everything, key=lambda outcome: _badness(row.question, outcome), default=None)
    if worst is not None and worst.verdict in (Verdict.CRASHED, Verdict.FAIL):
        return worst.verdict, worst.reason
    if row.judged < JUDGED_SHARE * row.planned:
        why = Counter(outcome.reason for outcome in row.outcomes if not outcome.decided).most_common(1)
        cause = f"most often because {why[0][0]}" if why else "no more cases could be made"
        return Verdict.NOT_JUDGED, f"{row.judged} of {row.planned} cases judged; {cause}"
    if everything and all(outcome.measurement is not None and outcome.measurement.idle for outcome in everything):
        return Verdict.NOT_JUDGED, "no case gave any force: nothing was judged"
    return Verdict.PASS, ""


def _badness(question: Property, outcome: Outcome) -> tuple[int, float]:
    """Orders outcomes: crashes, then breaches of the contract, then failures, each by how far beyond its tolerance."""
    if outcome.verdict is Verdict.CRASHED:
        return 3, inf
    if outcome.verdict is not Verdict.FAIL:
        return 0, 0.0
    if outcome.breach:
        return 2, inf
    found = outcome.measurement
    if found is None or found.broken:
        return 1, inf
    excesses = [
        excess(quantity, found.values[quantity.name], found.tolerances[quantity.name])
        for quantity in question.quantities
        if quantity.name in found.values
    ]
    return 1, max(excesses, default=inf)


def _shrunk(
    plan: _Plan, strategy: SearchStrategy[Case], subject: Subject, row: Row, told: Callable[[int], None]
) -> Outcome | None:
    """The smallest case found that fails as badly as the worst random one; None if no random case failed.

    As badly: it crashes if something crashed, breaks the contract if something did. Of failures by a number it must
    be a clear one, half-way on a logarithmic scale between the tolerance and the worst value: the smallest case that
    fails at all often fails by a hair, and convinces nobody.
    """
    question = row.question
    badness = [_badness(question, outcome) for outcome in row.outcomes]
    kind, worst = max(badness, default=(0, 0.0))
    if kind == 0:
        return None
    least = (kind, min(CLEARLY, sqrt(worst)) if kind == 1 else worst)
    first = next(number for number, found in enumerate(badness) if found >= least and found[0] == kind)
    smallest = row.outcomes[first]
    asked = 0

    def fails(case: Case) -> bool:
        nonlocal smallest, asked
        asked += 1
        told(asked)
        outcome = judge_case(question, case, subject)
        found = _badness(question, outcome)
        if found[0] != kind or found < least:
            return False
        smallest = outcome
        return True

    shrink(strategy, seed=plan.key(question), examples=plan.examples, first=first, fails=fails)
    return smallest
