"""A run checks every property of some formulations."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from typing import TypeVar, get_args

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.property import Property
from contactverif.contract.result import NotLoaded, Run
from contactverif.contract.subject import Subject
from contactverif.journals.run_journal import Journal
from contactverif.plugins.registry import unknown_property_error
from contactverif.run.profiles import Profile, Shrink, profile_named
from contactverif.run.run_jobs import RunJobs
from contactverif.run.scheduler import Progress, Scheduler
from contactverif.sampling.draw import Sampling

_Kind = TypeVar("_Kind")


class RunStopped(KeyboardInterrupt):
    """The user has stopped a run: a row that is not complete is not judged, and its reason says so."""

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
    place: Interface | Case | None = None,
    known: Mapping[str, str] | None = None,
    shrink: Shrink = "new",
    progress: Callable[[Progress], None] | None = None,
    executor: Executor | None = None,
    journal: Journal | None = None,
    keep_going: bool = True,
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
    place : Interface | Case | None
        Check everything on this interface, with random states, instead of on random interfaces. Of a scene, check what
        needs bodies on it alone, and all else on its interface; a pass there breaks no statement that the formulation
        fails.
    known : Mapping[str, str] | None
        {property id: reason why its failure is known}.
    shrink : Shrink
        The failures that are shrunk: `"new"` those that neither the formulation nor `known` states, `"one"` the most
        telling one of each formulation, `"all"` or `"none"`. One that is not shrunk shows the witness, or the first
        case that clearly fails.
    progress : Callable[[Progress], None] | None
        A function that is called after every case; with an executor, after every job. It gets each row as soon as
        its cases are judged, those of cheap properties first.
    executor : Executor | None
        Worker processes that do the jobs of the run, such as a `concurrent.futures.ProcessPoolExecutor`, one of loky
        or ``dask.distributed.Client().get_executor()``. The results are the same but for the seconds. By default this
        process does all.
    journal : Journal | None
        The journal, in which every outcome is noted, and whose outcomes are not judged again.
    keep_going : bool
        Ask all properties of a formulation, whatever the first of them show. Else a formulation is asked nothing more
        once its forces have the opposite sign, or it crashes, breaks the contract or is impure in the cases of
        `purity`.

    Returns
    -------
    Run
        A row for each formulation and property.

    Raises
    ------
    MisuseError
        If a known failure names no property of this run, a name stands there twice, or `shrink` is another word.
    WorkerError
        If a worker process dies.
    RunStopped
        If the user presses Ctrl-C. It is a `KeyboardInterrupt` with the rows as far as they are judged.
    """
    known = known or {}
    check_known(known, properties)
    if shrink not in get_args(Shrink):
        raise MisuseError("shrink", repr(shrink), "one, new, all or none")
    resolved = (profile_named(profile) if isinstance(profile, str) else profile).resolve(examples=examples, seed=seed)
    assert resolved.seed is not None
    scheduler, journal = Scheduler(executor, progress), journal or Journal()
    loaded, questions = _of_kind(Subject, subjects), _of_kind(Property, properties)
    sampling = Sampling.at(place, resolved.examples, resolved.seed)
    jobs = RunJobs(loaded, questions, sampling, journal, scheduler.report, known, shrink=shrink, keep_going=keep_going)
    not_loaded = tuple(_of_kind(NotLoaded, (*subjects, *properties)))
    with closing(journal):
        try:
            jobs.work(scheduler)
        except KeyboardInterrupt:
            raise RunStopped(jobs.result(not_loaded, resolved.name)) from None
    return jobs.result(not_loaded, resolved.name)


def judge_share(
    subjects: Sequence[Subject],
    questions: Sequence[Property],
    sampling: Sampling,
    progress: Callable[[Progress], None],
    journal: Journal,
    *,
    share: tuple[int, int],
) -> None:
    """Judge what the journal of a share (its number from 0, the number of all shares) does not have yet."""
    scheduler = Scheduler(None, progress)
    jobs = RunJobs(subjects, questions, sampling, journal, scheduler.report, {}, share)
    with closing(journal):
        jobs.work(scheduler)
    jobs.check_written()


def _of_kind(kind: type[_Kind], items: Iterable[object]) -> list[_Kind]:
    return [item for item in items if isinstance(item, kind)]


def check_known(known: Mapping[str, str], properties: Sequence[Property | NotLoaded]) -> None:
    """Check that each known failure is that of a property of the run."""
    ids = [item.id if isinstance(item, Property) else item.formulation for item in properties]
    for property_id in known:
        if property_id not in ids:
            raise unknown_property_error("known failure", property_id, ids)
