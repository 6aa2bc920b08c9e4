"""The runs of the harness: `verify`, the shards of `campaign`, and `merge`, which makes the report of all shards."""

import gc
import os
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import typer
from rich.text import Text

from contactverif.api.report import draw_outcome
from contactverif.api.run_files import REPORT, RUN_FILES, write_run
from contactverif.cli.annotations import annotate
from contactverif.cli.console import columns, echo, print_plugin_output, show
from contactverif.cli.options import OutputFiles, Screen, picture_folder, read_place, select_names, with_engines
from contactverif.cli.progress import SIGNALED, Bar, leave_at_next_signal
from contactverif.cli.run_screen import run_screen, show_run, summary
from contactverif.contract.case import Case
from contactverif.contract.counterexample import case_id, failing_examples
from contactverif.contract.errors import MisuseError, name_line, one_line
from contactverif.contract.interface import Interface
from contactverif.contract.property import LAST_TURN, Property
from contactverif.contract.result import NotLoaded, Run
from contactverif.contract.subject import Subject
from contactverif.isolation.box import why_no_box
from contactverif.isolation.limits import Limits
from contactverif.plugins.provenance import CODE, code_digests, collect_versions, machine
from contactverif.plugins.registry import load_properties
from contactverif.run.campaign import Shard, mark_done, open_shard, read_shards
from contactverif.run.failure_memory import FailureMemory
from contactverif.run.journal import hold_journal, is_own, journal_folder, keep_earlier, new_journal, remove_journal
from contactverif.run.rows import find_missing
from contactverif.run.run import Driver, RunStopped, run, run_failures
from contactverif.run.run_options import PLACE, Isolation, RunOptions, declared_options, group_names, read_settings
from contactverif.run.scheduler import Scheduler, WorkerError, begin_loading
from contactverif.run.store import OF_USER, STORED, Plan, Store, agree, check_versions, read_plan
from contactverif.run.worker_pool import check_jobs, default_jobs, worker_pool
from contactverif.sampling.draw import Sampling
from contactverif_reports.files import made_folder, reason_not_to_grow

VERIFY, COMPARE, CAMPAIGN = "verify", "compare", "campaign"
STOPPED = 130  # The exit status after Ctrl-C.
_NOT_WRITTEN = 2  # The exit status if a file could not be written.
_CAMPAIGN_SEED = 0  # The seed if there is none: all shards must have the same.
_BESIDE_RESUME = ("every", "keep_going", "last_failed", "memory", "jobs")


def verify(options: RunOptions, screen: Screen, resume: Path | None) -> int:
    """Check properties of formulations; return the exit status."""
    memory = read_settings().memory and options.memory
    if resume is not None:
        job = resumed_job(resume, replace(options, names=with_engines(options.names, options.engines), engines=()))
    else:
        job = new_job(replace(options, names=select_names(options)).with_settings())
    return _judge_last_failed(job) if options.last_failed else _run_job(job, screen, memory=memory)


def campaign(options: RunOptions, shard: str, folder: Path) -> int:
    """Judge a shard of a run, and keep its outcomes in a folder for `merge`; return the exit status."""
    piece = Shard.parse(shard)
    typed = replace(options, names=select_names(options), keep_going=True)
    job = new_job(typed.with_settings(), fresh_seed=_CAMPAIGN_SEED, command=CAMPAIGN)
    plan = job.plan(shard=piece.text)
    made_folder(folder, "--out")
    journal_of_shard = folder.absolute() / piece.folder
    with watch_for_stops(replace(job, again="the same command")), open_shard(journal_of_shard, plan) as is_done:
        if is_done:
            echo(f"shard {piece.text} is done already")
            return 0
        plugins = replace(job, hidden=(folder.absolute(),)).load()
        for item in chain(*plugins):
            if isinstance(item, NotLoaded):
                _warn(f"{name_line(item.formulation)} does not load: {one_line(item.reason)}")
                return 1
        subjects = [item for item in plugins.subjects if isinstance(item, Subject)]
        questions = [item for item in plugins.questions if isinstance(item, Property)]
        with Bar() as bar:
            store, scheduler = Store(plan, journal_of_shard, [journal_of_shard]), Scheduler(None, bar.show_progress)
            driver = Driver(subjects, questions, job.sampling, scheduler, store, share=piece.share)
            driver.work()
            driver.check_written()
        print_plugin_output()
        for remark in store.remarks:
            _warn(remark)
        n_outcomes = mark_done(journal_of_shard, plan)
    echo(f"shard {piece.text} is done: {n_outcomes} outcomes")
    return 0


def merge(folder: Path, out: Sequence[Path], options: RunOptions, audit: bool, share: float, screen: Screen) -> int:
    """Make the report of a campaign from its shards' journals, shrink what fails, audit a share; return the status."""
    from contactverif.cli import replay

    replay.check_share(share if audit else 1.0)
    plan, journals = read_shards(folder, "FOLDER")
    typed = replace(options, out=tuple(out))
    planned = options_of(plan, CAMPAIGN, "FOLDER", typed)
    job = new_job(replace(planned, shrink=options.shrink or planned.shrink))
    again = shlex.join(["contactverif", "merge", str(folder), *options.names, *typed.words(["shrink", *OF_USER])])
    if audit and REPORT not in job.files.names:
        raise MisuseError("--audit", "no report", f"--out FILE{REPORT} beside it")
    status = _run_job(replace(job, sources=journals, again=again), screen)
    if audit and job.files.paths[REPORT].exists():
        differs = replay.audit(job.files.paths[REPORT], share, planned)
        status = status or differs
    return status


class Plugins(NamedTuple):
    """The formulations and the properties of a run, as they were loaded."""

    subjects: Sequence[Subject | NotLoaded]
    questions: Sequence[Property | NotLoaded]

    def subject(self, name: str) -> Subject:
        """Return a formulation that was loaded."""
        return next(item for item in self.subjects if isinstance(item, Subject) and item.name == name)

    def question(self, property_id: str) -> Property:
        """Return a property that was loaded."""
        return next(item for item in self.questions if isinstance(item, Property) and item.id == property_id)


@dataclass(frozen=True, slots=True)
class Job:
    """A run of `verify`, `compare` or `campaign` before it begins, or what `merge` makes of a campaign."""

    options: RunOptions  # They are settled.
    files: OutputFiles
    pictures: Path | None  # The folder for pictures.
    place: Interface | Case | None  # The interface or scene on which everything is checked; None for random ones.
    sources: tuple[Path, ...] = ()  # The journals whose outcomes are not judged again.
    resumes: bool = False  # The run goes on with its own journal.
    again: str = ""  # The command line that goes on with the run, if it is not that command with `--resume`.
    command: str = VERIFY
    hidden: tuple[Path, ...] = ()  # Other files of the run that a plugin in a box does not see.

    def load(self, executor: Executor | None = None) -> Plugins:
        """Load the formulations, in the workers where there are any, and the properties meanwhile."""
        loaders = begin_loading(self.options.names, self.limits(), executor)
        questions = load_properties(self.options.properties, engines=True)
        if self.options.quick:  # What does not load is told.
            cheap = tuple(each for each in questions if isinstance(each, NotLoaded) or each.turn < LAST_TURN)
            if not cheap:
                words = f"{len(questions)} properties, none of them of the first round"
                raise MisuseError("--quick", words, "no --property, or -p 'balance.*'")
            questions = cheap
        return Plugins([load() for load in loaders], questions)

    def limits(self) -> Limits | None:
        """Return the limits of the plugins' processes; in a box they do not see what this run writes."""
        files = self.files.paths.values()
        return self.options.limits([*files, *map(journal_folder, files), *self.hidden])

    def run_options(self, **others: Any) -> dict[str, Any]:
        """Return the options of `contactverif.run.run.run`, and others beside them."""
        options = self.options
        stop = "failure" if options.exit_first else "never" if options.keep_going else "foundation"
        of_run = {"profile": options.size, "known": options.known, "stop": stop}
        return others | of_run | {"place": self.place, "shrink": options.shrink or "one"}

    @property
    def jobs(self) -> int:
        """The number of processes: the user's, or one that fits the work."""
        if self.options.jobs is not None:
            return check_jobs(self.options.jobs)
        return default_jobs(len(self.options.names) * len(self.options.properties) * self.options.size.examples)

    @property
    def sampling(self) -> Sampling:
        """The size and the seed of the run, and the place where it asks."""
        size = self.options.size
        assert size.seed is not None
        return Sampling.at(self.place, size.examples, size.seed)

    @property
    def output(self) -> Path | None:
        """The file that the journal belongs to: the report, or else the page, or else another."""
        return next((self.files.names[suffix] for suffix in RUN_FILES if suffix in self.files.names), None)

    @property
    def journal(self) -> Path | None:
        """The folder of the journal."""
        return self.output and journal_folder(self.files.paths[self.output.suffix.lower()])

    def plan(self, shard: str = "") -> Plan:
        """Return the plan for the header of a journal."""
        options, versions, folder = self.options, versions_of(self.options), os.getcwd()
        command, here = self.command, machine()
        return Plan(command=command, versions=versions, options=options, shard=shard, folder=folder, machine=here)

    @contextmanager
    def begin(self, load: Callable[[], Plugins]) -> Iterator[tuple[Plugins, Store]]:
        """Open a block with what a function loads, and with the store of the run, whose journal no other process uses.

        The store is there before a box is, which hides it. A plugin that lives in this process is loaded before: it
        may end us, and then leaves no file.
        """
        first = load() if self.options.isolation is Isolation.INLINE else None
        if (folder := self.journal) is None:
            yield first or load(), Store()
            return
        plan, outputs = self.plan(), tuple(self.files.paths.values())
        with hold_journal(folder, "--resume") if self.resumes else new_journal(folder, plan, outputs) as aside:
            if aside:
                _warn(f"the journal of a run that was stopped is now {folder.with_name(aside)}")
            keep_earlier(folder, outputs)
            store = Store(plan, folder, self.sources)
            try:
                yield first or load(), store
            finally:
                for remark in store.remarks:  # They name the rows whose stored outcomes do not count.
                    _warn(remark)


def new_job(options: RunOptions, *, fresh_seed: int | None = None, command: str = VERIFY) -> Job:
    """Return the job of options as they were typed. Where nothing says the seed it is the fresh one, or a new one."""
    files = OutputFiles.check(options.out, RUN_FILES)
    folder = picture_folder(options.pictures)
    return Job(options.settle(fresh_seed), files, folder, read_place(options), command=command)


def resumed_job(output: Path, typed: RunOptions, command: str = VERIFY) -> Job:
    """Return the job that goes on with a run that was to write a report or page, and was stopped.

    Beside `--resume` only `--jobs` and `--keep-going` may be typed: all other options come from the journal. If this
    user has not begun it, what it may reach, write or excuse comes from the command line, as for the shards of others.
    """
    if output.is_dir():
        raise MisuseError("--resume", f"{output}, a folder", "the report of a run that was stopped")
    folder = journal_folder(output, "--resume")
    if output.exists() and not folder.exists():
        raise MisuseError("--resume", f"{output}, which is complete", "the report of a run that was stopped")
    plan, nothing = read_plan(folder, "--resume"), RunOptions()
    is_mine = is_own(folder)
    beside = _BESIDE_RESUME if is_mine else (*_BESIDE_RESUME, "names", *OF_USER, *group_names(PLACE))
    for name, (_, option) in declared_options(RunOptions).items():
        if name not in beside and getattr(typed, name) != getattr(nothing, name):
            needed = "--jobs and --keep-going at most: all other options come from the journal"
            raise MisuseError("--resume", f"{option.group or name} beside it", needed)
    options = options_of(plan, command, "--resume", None if is_mine else typed)
    others = [path for path in options.out if path.suffix.lower() != output.suffix.lower()]
    jobs = options.jobs if typed.jobs is None else typed.jobs
    keep_going = typed.keep_going or options.keep_going
    job = new_job(replace(options, out=(output, *others), jobs=jobs, keep_going=keep_going), command=command)
    return replace(job, sources=(folder,), resumes=True)


def versions_of(options: RunOptions) -> dict[str, str]:
    """Return the versions of all libraries, and a digest of the code of the harness and of the plugins."""
    versions = collect_versions() | code_digests(options.names, options.properties)
    if options.scene_file is not None:
        from contactverif.meshes.scene_file import digest_scene_file  # It imports meshlane.

        versions[f"{CODE}scene file"] = digest_scene_file(options.scene_file)
    return versions


def options_of(plan: Plan, command: str, argument: str, typed: RunOptions | None) -> RunOptions:
    """Return the options of a journal of a command and of these versions, with files relative to the working folder.

    `typed` are those of the user, where somebody else may have made the journal.
    """
    if plan.command != command:
        raise MisuseError(argument, f"a journal of {plan.command}", f"one of {command}")
    options = plan.options.from_folder(plan.folder)
    if typed is not None:
        options, refused = agree(options, typed, argument)
        if refused:
            _warn(f"{argument} asks for {shlex.join(refused)}, and does not get it; type it to allow it")
    elif options.isolation in (Isolation.BOX, Isolation.LANDLOCK):
        # They may not be had here, and the results are the same without.
        options = replace(options, isolation=None)
    check_versions(plan.versions, versions_of(options), argument)
    return options


def _run_job(job: Job, screen: Screen, *, memory: bool = False) -> int:
    """Return the exit status. With a memory, what failed before is asked first; a user's mesh or scene has none."""
    failures = FailureMemory() if memory and job.place is None else None
    with watch_for_stops(job), ExitStack() as stack:
        alone = len(job.options.names) == 1 and job.options.isolation is not Isolation.INLINE
        with (
            worker_pool(job.jobs, parent_judges=alone) as executor,
            Bar(Limits(job.options.time_limit).start_seconds) as bar,
        ):
            plugins, store = stack.enter_context(job.begin(partial(job.load, executor)))
            if failures is not None:
                store.failures = failures.recall(job.options.names, job.options.properties)
            gc.freeze()  # What is loaded stays: no collection walks over it again, 2 to 3 % of a run.
            options = job.run_options(progress=bar.show_progress, executor=executor, store=store)
            result = run(*plugins, **options)
            if job.options.quick:
                n_all, size = len(job.options.properties), job.options.size
                words = f"{len(plugins.questions)} of {n_all} properties, {size.examples} cases each, seed {size.seed}"
                result = replace(result, provenance={**result.provenance, "asked": words})
        if failures is not None:
            failures.update(result.rows)
        missing = partial(find_missing, result, *plugins, job.sampling)
        write = partial(write_run, result, report=job.files.names.get(REPORT))
        end = end_run(job, store, missing, write, promises_kept=result.promises_kept)
    if job.pictures is not None:
        for example in failing_examples(result):
            subject, question = plugins.subject(example.formulation), plugins.question(example.property_id)
            path = job.pictures / f"{case_id(subject.name, question.id)}.png"
            draw_outcome(subject, question, example.outcome, path, argument="--pictures")
    advice = ""
    if REPORT not in end.files.names and not result.promises_kept and failing_examples(result):
        seed = result.provenance.get("seed")
        advice = f"to keep these cases: the same command with --seed {seed} --out FILE.nc"

    def show_result() -> None:
        show_run(result, screen, end.files.names.get(REPORT))
        if remark := result.provenance.get("drawing"):
            show(f"{remark}.")

    last_line = summary(result, quiet=screen.quiet, status=end.status)
    return show_end(job, screen, end, result, show_result, last_line, advice)


class End(NamedTuple):
    """The files, the exit status and what is missing of a run."""

    files: OutputFiles  # Those that were written.
    missing: str  # What was not judged; empty if nothing is missing.
    complete: bool
    status: int  # The exit status; 0 only if nothing is missing in the run or in its files, and promises are kept.


def show_end(
    job: Job, screen: Screen, end: End, result: Run, show_result: Callable[[], None], last_line: Text, advice: str = ""
) -> int:
    """Show the results, the names of the files, and the last line; return the exit status."""
    print_plugin_output()
    annotate(result)
    if not screen.quiet:
        show_result()
        longest = sorted(result.rows, key=attrgetter("seconds"), reverse=True)[: max(screen.durations, 0)]
        for row in (row for row in longest if row.outcomes):
            show(f"{row.seconds:8.1f} s  {row.formulation} {row.property_id}, {row.judged} cases")
        if stored := result.provenance.get(STORED):
            typer.echo(f"outcomes that were judged before: {stored}")
        if job.pictures is not None:
            show(f"pictures: {job.options.pictures}")
        end.files.announce()
        if advice:
            show(advice)
    show(f"Not complete: {end.missing}." if end.missing else last_line)
    if isinstance(job.place, Interface):
        typer.echo("Asked on the interface alone; no bodies were solved.")
    if not screen.quiet:
        print_isolation(result.provenance)
    if not end.complete:
        print_resume_hint(job)
    return end.status


def end_run(
    job: Job, store: Store, find_missing: Callable[[], str], write: Callable[[Path], None], *, promises_kept: bool
) -> End:
    """Write the files before anything is shown, so that nothing that was judged is lost, and remove the journal."""
    missing = find_missing() if promises_kept else ""
    files = OutputFiles({}, {})  # Those that are written.
    for suffix, path in job.files.paths.items():
        try:
            write(path)
        except MisuseError as error:
            reason = error.found.removeprefix(f"{path}: ")
        except (OSError, RuntimeError) as error:  # The netCDF library raises both, with words of its own.
            reason = f"{reason_not_to_grow(path) or getattr(error, 'strerror', None) or error}"
        else:
            files = OutputFiles({**files.names, suffix: job.files.names[suffix]}, {**files.paths, suffix: path})
            continue
        _warn(f"{job.files.names[suffix]} is not written: {reason}")
    complete = len(files.paths) == len(job.files.paths) and not missing
    if store.write_error:
        _warn(f"the journal could not be written to its end: {store.write_error}")
    if complete and store.folder is not None:
        remove_journal(store.folder)
    status = 0 if promises_kept and not missing else 1
    whole = complete and not store.write_error
    return End(files, missing, complete, status if whole or missing else _NOT_WRITTEN)


@contextmanager
def watch_for_stops(job: Job) -> Iterator[None]:
    """Open a block in which a job is judged. After Ctrl-C it shows what was judged; if a worker dies, how to go on."""
    try:
        yield
    except KeyboardInterrupt as stop:
        leave_at_next_signal()
        if isinstance(stop, RunStopped):
            show(*run_screen(stop.run, columns()))
        print_resume_hint(job)
        # Where a run is stopped, the interrupt with the number of the signal stands behind the error.
        numbers = [word for error in (stop, stop.__context__) if error for word in error.args if isinstance(word, int)]
        raise typer.Exit(next((SIGNALED + number for number in numbers), STOPPED)) from None
    except WorkerError:
        print_resume_hint(job)
        raise


def print_resume_hint(job: Job) -> None:
    """Print the line that goes on with a run."""
    if job.journal is not None and not job.again and not job.journal.exists():
        typer.echo("nothing was judged")
    elif job.again or job.output is not None:
        line = job.again or f"contactverif {job.command} --resume {shlex.quote(str(job.output))}"
        typer.echo(f"what was judged is kept; to go on: {line}")
    else:
        typer.echo("with --out FILE.nc a run can go on where it was stopped")


def print_isolation(provenance: Mapping[str, str]) -> None:
    """Print in a last line whether plugins were in a box, and how to get one where they were in none.

    Where plugins live in this process, the user has said so.
    """
    place = provenance.get("isolation", Isolation.INLINE)
    if place.startswith(Isolation.BOX):
        typer.echo(f"The plugins ran in a {place}.")
    elif place != Isolation.INLINE:
        typer.echo(f"The plugins ran in a {place} without a box: {why_no_box() or 'as --isolation says'}.")


def _warn(words: str) -> None:
    echo(f"contactverif: {' '.join(words.split())}", to_stderr=True)


def _judge_last_failed(job: Job) -> int:
    others = ["--resume"] if job.resumes else ["--out"] if job.files.names else []
    others += [] if job.place is None else ["a mesh or a scene"]
    if others:
        raise MisuseError("--last-failed", f"{' and '.join(others)} beside it", "--last-failed alone")
    names, memory = (job.options.names, job.options.properties), FailureMemory()
    failures = memory.recall(*names)
    if not failures:
        words = f"no failure of {', '.join(map(repr, job.options.names))} in .contactverif"
        raise MisuseError("--last-failed", words, "a run of `verify` here in which something fails")
    result = run_failures(tuple(chain(*job.load())), failures, {"asked": "what failed in earlier runs"})
    memory.update(result.rows)
    print_plugin_output()
    show(*run_screen(result, columns()))
    left = len(memory.recall(*names))  # What cannot be judged now is left, too.
    show(f"{left} of {len(failures)} failures of earlier runs are left.")
    return 0 if result.promises_kept else 1
