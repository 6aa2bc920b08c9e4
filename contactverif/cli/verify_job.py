"""The job that `verify`, `compare`, `campaign` and `merge` share: options with all settled that a journal must know.

An option that changes an outcome is a field of `VerifyOptions`, so that the journal has it.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from contactverif.api.plugin_places import Isolation
from contactverif.api.run_files import RUN_FILES
from contactverif.api.settings import Settings
from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.output_files import OutputFiles, PictureFolder
from contactverif.cli.shared_options import PlaceOptions, SamplingOptions, WorkerOptions
from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from contactverif.contract.case import Case
    from contactverif.contract.interface import Interface
    from contactverif.contract.property import Property
    from contactverif.contract.result import NotLoaded
    from contactverif.contract.subject import Subject
    from contactverif.isolation.limits import Limits
    from contactverif.run.profiles import Profile
    from contactverif.run.store import Plan, Store
    from contactverif.sampling.draw import Sampling

VERIFY, COMPARE = "verify", "compare"
_Loaded = TypeVar("_Loaded")


@dataclass(frozen=True, slots=True)
class VerifyOptions:
    """The options of `verify`, as they are typed or as a journal has them. `compare` names its reference first."""

    names: tuple[str, ...] = ()
    properties: tuple[str, ...] = ()
    sampling: SamplingOptions = field(default_factory=SamplingOptions)
    out: tuple[Path, ...] = ()
    pictures: Path | None = None
    known: tuple[str, ...] = ()
    keep_going: bool = False
    place: PlaceOptions = field(default_factory=PlaceOptions)
    workers: WorkerOptions = field(default_factory=WorkerOptions)
    isolation: IsolationOptions = field(default_factory=IsolationOptions)

    def with_settings(self, settings: Settings) -> VerifyOptions:
        """Return the options with those of the project where nothing is typed; of `isolation` see there."""
        from contactverif.plugins.registry import has_engine, matching_ids, property_ids, unknown_property_error

        properties = self.properties or settings.properties
        ids, engines = property_ids(engines=True), has_engine(self.names)
        for unknown in settings.known.keys() - {*ids}:
            raise unknown_property_error("known failure", unknown, ids)
        matching = {*matching_ids(properties or ("*",), engines=engines)} - _known_failures(self.known).keys()
        known = (f"{name}={reason}" for name, reason in settings.known.items() if name in matching)
        return replace(
            self,
            properties=properties,
            known=(*self.known, *known),
            sampling=replace(self.sampling, profile=self.sampling.profile or settings.profile),
            workers=replace(self.workers, jobs=settings.jobs if self.workers.jobs is None else self.workers.jobs),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Plugins:
    """The formulations and the properties of a run, as they were loaded."""

    subjects: Sequence[Subject | NotLoaded]
    questions: Sequence[Property | NotLoaded]

    def subject(self, name: str) -> Subject:
        """Return a formulation that was loaded."""
        from contactverif.contract.subject import Subject

        return next(item for item in self.subjects if isinstance(item, Subject) and item.name == name)

    def question(self, property_id: str) -> Property:
        """Return a property that was loaded."""
        from contactverif.contract.property import Property

        return next(item for item in self.questions if isinstance(item, Property) and item.id == property_id)


@dataclass(frozen=True, slots=True)
class VerifyJob:
    """A run of `verify`, `compare` or `campaign` before it begins, or what `merge` makes of a campaign."""

    options: VerifyOptions  # The properties are ids, and the seed is a number.
    profile: Profile
    files: OutputFiles
    pictures: PictureFolder | None
    place: Interface | Case | None  # The interface or scene on which everything is checked; None for random ones.
    known: dict[str, str]  # {property: reason} of the known failures.
    sources: tuple[Path, ...] = ()  # The journals whose outcomes are not judged again.
    resumes: bool = False  # The run goes on with its own journal.
    again: str = ""  # The command line that goes on with the run, if it is not that command with `--resume`.
    command: str = VERIFY
    hidden: tuple[Path, ...] = ()  # Other files of the run that a plugin in a box does not see.

    def load(self, executor: Executor | None = None) -> Plugins:
        """Load the formulations, in the workers where there are any, and the properties meanwhile."""
        from contactverif.plugins.registry import load_properties
        from contactverif.run.scheduler import begin_loading

        loaders = begin_loading(self.options.names, self.limits(), executor)
        questions = load_properties(self.options.properties, engines=True)
        return Plugins([load() for load in loaders], questions)

    def limits(self) -> Limits | None:
        """Return the limits of the plugins' processes; in a box they do not see what this run writes."""
        from contactverif.run.journal import journal_folder

        files = self.files.paths.values()
        return self.options.isolation.limits([*files, *map(journal_folder, files), *self.hidden])

    def run_options(self, **others: Any) -> dict[str, Any]:
        """Return the options of a run, those of `contactverif.run.run.run`, and others beside them."""
        return others | {
            "profile": self.profile,
            "place": self.place,
            "known": self.known,
            "keep_going": self.options.keep_going,
            "shrink": self.options.sampling.shrink or "one",
        }

    @property
    def jobs(self) -> int:
        """The number of processes."""
        n_cases = self.options.sampling.planned_examples()
        return self.options.workers.number(len(self.options.names), len(self.options.properties), n_cases)

    @property
    def sampling(self) -> Sampling:
        """The size and the seed of the run, and the place where it asks."""
        from contactverif.sampling.draw import Sampling

        assert self.profile.seed is not None
        return Sampling.at(self.place, self.profile.examples, self.profile.seed)

    @property
    def output(self) -> Path | None:
        """The file that the journal belongs to: the report, or else the page, or else another."""
        return next((self.files.names[suffix] for suffix in RUN_FILES if suffix in self.files.names), None)

    @property
    def resume_line(self) -> str:
        """The command that goes on with this run; empty if it has no journal."""
        if self.again:
            return self.again
        return (
            f"contactverif {self.command} --resume {shlex.quote(str(self.output))}" if self.output is not None else ""
        )

    def plan(self) -> Plan:
        """Return the plan for the header of a journal."""
        import msgspec

        from contactverif.plugins.provenance import machine
        from contactverif.run.store import Plan

        assert self.profile.seed is not None
        return Plan(
            command=self.command,
            options=msgspec.to_builtins(self.options, enc_hook=str),
            folder=os.getcwd(),
            versions=versions_of(self.options),
            formulations=self.options.names,
            properties=self.options.properties,
            profile=self.profile.name,
            examples=self.profile.examples,
            seed=self.profile.seed,
            machine=machine(),
        )

    @contextmanager
    def begin(self, load: Callable[[], _Loaded]) -> Iterator[tuple[_Loaded, Store]]:
        """Open a block with what a function loads, and with the store of the run.

        The store is there before a box is, which hides it. A plugin that lives in this process is loaded before: it
        may end us, and then leaves no file.
        """
        first = load() if self.options.isolation.isolation is Isolation.INLINE else None
        with self.store() as store:
            yield first or load(), store

    @contextmanager
    def store(self) -> Iterator[Store]:
        """Open a block with the store of the run. In it no other process uses the same journal."""
        from contactverif.run.journal import hold_journal, journal_folder, keep_earlier, new_journal
        from contactverif.run.store import Store

        if self.output is None:
            yield Store()
            return
        plan, outputs = self.plan(), tuple(self.files.paths.values())
        folder = journal_folder(self.files.paths[self.output.suffix.lower()])
        held = hold_journal(folder, "--resume") if self.resumes else new_journal(folder, plan, outputs)
        with held as aside:
            if aside:
                folder_aside = self.output.parent / aside
                typer.echo(f"contactverif: the journal of a run that was stopped is now {folder_aside}", err=True)
            keep_earlier(folder, outputs)
            store = Store(plan, folder, self.sources)
            try:
                yield store
            finally:
                say_what_was_doubted(store)


def say_what_was_doubted(store: Store) -> None:
    """Name the rows whose stored outcomes do not count."""
    for remark in store.remarks:
        typer.echo(f"contactverif: {' '.join(remark.split())}", err=True)
    store.remarks.clear()


def new_job(options: VerifyOptions, *, fresh_seed: int | None = None, command: str = VERIFY) -> VerifyJob:
    """Return the job of options as they were typed. Where nothing says the seed it is the fresh one, or a new one."""
    from contactverif.plugins.registry import has_engine, matching_ids
    from contactverif.run.profiles import profile_named

    sampling = options.sampling
    profile = profile_named(sampling.profile or "dev").resolve(
        examples=sampling.examples, seed=sampling.seed, fresh=fresh_seed
    )
    files = OutputFiles.check(list(options.out), RUN_FILES)
    folder = PictureFolder.make(options.pictures)
    settled = replace(
        options,
        properties=matching_ids(options.properties or ("*",), engines=has_engine(options.names)),
        isolation=options.isolation.settle(),
        sampling=replace(sampling, examples=profile.examples, seed=profile.seed, profile=profile.name),
    )
    known = _known_failures(options.known)
    return VerifyJob(settled, profile, files, folder, options.place.read(), known, command=command)


def resumed_job(output: Path, typed: VerifyOptions, command: str = VERIFY) -> VerifyJob:
    """Return the job that goes on with a run that was to write a report or page, and was stopped.

    Beside `--resume` only `--jobs` and `--keep-going` may be typed: all other options come from the journal.
    """
    from contactverif.run.journal import journal_folder
    from contactverif.run.store import read_plan

    if output.is_dir():
        raise MisuseError("--resume", f"{output}, a folder", "the report of a run that was stopped")
    folder = journal_folder(output, "--resume")
    if output.exists() and not folder.exists():
        raise MisuseError("--resume", f"{output}, which is complete", "the report of a run that was stopped")
    plan = read_plan(folder, "--resume")
    _check_alone(typed)
    options = options_of(plan, command, "--resume")
    others = [path for path in options.out if path.suffix.lower() != output.suffix.lower()]
    workers = typed.workers if typed.workers.jobs is not None else options.workers
    keep_going = typed.keep_going or options.keep_going
    options = replace(options, out=(output, *others), workers=workers, keep_going=keep_going)
    job = new_job(options, command=command)
    return replace(job, sources=(folder,), resumes=True)


def versions_of(options: VerifyOptions) -> dict[str, str]:
    """Return the versions of all libraries, and a digest of the code of the harness and of the plugins."""
    from contactverif.plugins.provenance import CODE, code_digests, collect_versions

    versions = collect_versions() | code_digests(options.names, options.properties)
    if options.place.scene_file is not None:
        from contactverif.meshes.scene_file import digest_scene_file

        versions[f"{CODE}scene file"] = digest_scene_file(options.place.scene_file)
    return versions


def options_of(plan: Plan, command: str, argument: str) -> VerifyOptions:
    """Return the options of a journal of a command and of these versions, with files relative to the working folder."""
    import msgspec

    from contactverif.run.store import check_versions

    if plan.command != command:
        raise MisuseError(argument, f"a journal of {plan.command}", f"one of {command}")
    try:
        options = msgspec.convert(plan.options, VerifyOptions, dec_hook=_to_path)
    except (msgspec.ValidationError, TypeError) as error:
        raise MisuseError(argument, f"a journal with wrong options ({error})", "one of this version") from None
    options = _from_folder(options, plan.folder)
    check_versions(plan.versions, versions_of(options), argument)
    # A box or Landlock may not be had here, and the results are the same without.
    if options.isolation.isolation in (Isolation.BOX, Isolation.LANDLOCK):
        options = replace(options, isolation=replace(options.isolation, isolation=None))
    return options


def _from_folder(options: VerifyOptions, folder: str) -> VerifyOptions:
    """Return the options of a run in a folder, with names of files as they are from here."""
    if os.getcwd() == folder:
        return options
    base = Path(folder)
    mesh = options.place.mesh and base / options.place.mesh
    scene_file = options.place.scene_file and str(base / options.place.scene_file)
    pictures = options.pictures and base / options.pictures
    place = replace(options.place, mesh=mesh, scene_file=scene_file)
    return replace(options, out=tuple(base / path for path in options.out), pictures=pictures, place=place)


def _to_path(kind: type, value: Any) -> Any:
    if kind is Path and isinstance(value, str):
        return Path(value)
    raise TypeError(f"{kind.__name__} expected")


def _check_alone(typed: VerifyOptions) -> None:
    """Refuse other options beside `--resume`: the journal has them all."""
    defaults = VerifyOptions()
    for name in (entry.name for entry in fields(VerifyOptions)):
        if name not in ("workers", "keep_going") and getattr(typed, name) != getattr(defaults, name):
            needed = "--jobs and --keep-going at most: all other options come from the journal"
            raise MisuseError("--resume", f"{name} beside it", needed)


def _known_failures(texts: Sequence[str]) -> dict[str, str]:
    """Return {property: reason} of each ID=REASON."""
    reasons = {}
    for text in texts:
        property_id, _, reason = text.partition("=")
        if not (property_id and reason):
            raise MisuseError("--known", repr(text), "ID=REASON, the id of a property and why it is known to fail")
        reasons[property_id] = reason
    return reasons
