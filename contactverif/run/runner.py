"""The runner: it judges the planned cases of each property, then shrinks what failed.

Rules for the next editor:

- All planned cases of a row are judged before one is shrunk, so that a failure ends nothing early.
- The cases of a property depend on the seed and its strategy alone, neither on the formulation nor on other properties.
- A finite list of named cases is planned whole, whatever the number of examples.
- The work is done in pieces (`pieces.py`), which any process may do in any order (`conductor.py`, `workers.py`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import TypeVar

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.names import unknown_name_error
from contactverif.contract.property import Property, Verdict
from contactverif.contract.result import NotLoaded, Row, Run
from contactverif.contract.subject import OPTIONAL_PARTS, STATED_PARTS, Subject
from contactverif.run.conductor import Conductor
from contactverif.run.draw import CaseSource, Sampling
from contactverif.run.open_row import OpenRow
from contactverif.run.profiles import PROFILES, Profile, profile_named
from contactverif.run.provenance import collect_provenance
from contactverif.run.run_journal import Journal
from contactverif.run.tasks import Progress
from contactverif.run.witnesses import find_witness
from contactverif.run.workers import Team

__all__ = ["PROFILES", "Profile", "Progress", "RunStopped", "profile_named", "run"]

_Kind = TypeVar("_Kind")


class RunStopped(KeyboardInterrupt):
    """The user has stopped a run.

    Parameters
    ----------
    run : Run
        The rows as far as they are judged; a row that is not complete is not judged, and its reason says so.
    """

    def __init__(self, run: Run) -> None:
        super().__init__("the run was stopped")
        self.run = run


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
    executor: Executor | None = None,
    journal: Journal | None = None,
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
        A function that is called after every case; with an executor, after every piece.
    executor : Executor | None
        Worker processes that do the pieces of the run, such as a `concurrent.futures.ProcessPoolExecutor`, one of loky
        or ``dask.distributed.Client().get_executor()``. The results are the same but for the seconds. By default this
        process does all.
    journal : Journal | None
        The journal, in which every outcome is noted, and whose outcomes are not judged again.

    Returns
    -------
    Run
        A row for each formulation and property.

    Raises
    ------
    MisuseError
        If a known failure names no property of this run, or a name stands there twice.
    WorkerError
        If a worker process dies.
    RunStopped
        If the user presses Ctrl-C. It is a `KeyboardInterrupt` with the rows as far as they are judged.
    """
    known = known or {}
    loaded, questions = _of_kind(Subject, subjects), _of_kind(Property, properties)
    check_once("formulation", map(attrgetter("name"), loaded))
    check_once("property", map(attrgetter("id"), questions))
    _check_known(known, properties)
    resolved = (profile_named(profile) if isinstance(profile, str) else profile).resolve(examples=examples, seed=seed)
    assert resolved.seed is not None
    sampling = Sampling(
        examples=resolved.examples,
        seed=resolved.seed,
        interface=interface if scene is None else scene.interface,
        scene=scene,
    )
    rows = open_rows(loaded, questions, sampling, known)
    journal = journal or Journal()
    conductor = Conductor(sampling, Team(executor), progress or (lambda _: None), journal)
    make_run = partial(_make_run, conductor, rows, (*subjects, *properties), resolved)
    try:
        conductor.check_signs(loaded, {question.id: question for question in questions})
        conductor.judge(_of_kind(OpenRow, rows))
    except KeyboardInterrupt:
        raise RunStopped(make_run()) from None
    finally:
        journal.close()
    return make_run()


def _make_run(
    conductor: Conductor,
    rows: Sequence[OpenRow | Row],
    items: Sequence[Subject | Property | NotLoaded],
    profile: Profile,
) -> Run:
    """Return the run with all rows as far as they are judged; the items are those that were to be judged."""
    assert profile.seed is not None
    loaded = _of_kind(Subject, items)
    return Run(
        rows=tuple(conductor.close(row) if isinstance(row, OpenRow) else row for row in rows),
        not_loaded=tuple(_of_kind(NotLoaded, items)),
        provided={subject.name: {part: part in subject.provides for part in OPTIONAL_PARTS} for subject in loaded},
        opposite_signs=tuple(subject.name for subject in loaded if subject.name in conductor.opposite_signs),
        provenance=collect_provenance(profile=profile.name, examples=profile.examples, seed=profile.seed),
    )


def open_rows(
    subjects: Sequence[Subject], questions: Sequence[Property], sampling: Sampling, known: Mapping[str, str]
) -> list[OpenRow | Row]:
    """Return a row for each formulation and property: one whose cases are to be judged, or a complete one."""
    sources = {sampling.group(question): sampling.source(question) for question in questions}
    return [
        _open(
            subject,
            question,
            sources[sampling.group(question)],
            known=known.get(question.id, ""),
            on_scene=sampling.scene is not None,
        )
        for subject in subjects
        for question in questions
    ]


def _of_kind(kind: type[_Kind], items: Iterable[object]) -> list[_Kind]:
    return [item for item in items if isinstance(item, kind)]


def check_once(argument: str, names: Iterable[str]) -> None:
    """Check that no name stands there twice.

    Raises
    ------
    MisuseError
        If one does.
    """
    for name, times in Counter(names).items():
        if times > 1:
            raise MisuseError(argument, f"{name} {times} times", "each of them once")


def _check_known(known: Mapping[str, str], properties: Sequence[Property | NotLoaded]) -> None:
    ids = [item.id if isinstance(item, Property) else item.formulation for item in properties]
    for property_id in known:
        if property_id not in ids:
            raise unknown_name_error("known failure", property_id, ids)


def _open(
    subject: Subject, question: Property, source: CaseSource | None, *, known: str, on_scene: bool
) -> OpenRow | Row:
    """Return a row whose cases are to be judged, or the row itself if there is nothing to judge."""
    row = Row(
        formulation=subject.name,
        info=question.info,
        verdict=Verdict.PASS,
        promise=question.promise(subject.traits),
        known=known,
    )
    if reason := question.refusal(subject.traits):
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason=reason)
    if missing := question.needs - subject.provides:
        promise = row.promise if missing & STATED_PARTS else None
        reason = f"{', '.join(sorted(missing))}: not provided"
        return replace(row, verdict=Verdict.NOT_PROVIDED, promise=promise, reason=reason)
    if source is None:
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason="this interface or scene has no such cases")
    if on_scene and row.promise is False:  # The formulation fails on some scene, not on every one.
        row = replace(row, promise=None)
    try:
        witness = find_witness(subject, question, source) if row.promise is False else None
    except MisuseError as error:
        return replace(row, verdict=Verdict.CRASHED, reason=f"traits: {error}")
    return OpenRow(row, subject, question, source, witness)
