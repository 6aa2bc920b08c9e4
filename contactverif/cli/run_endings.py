"""The ends of a run that has a journal: what could not be written, what was stopped, and how to go on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from contactverif.api.plugin_places import Isolation
from contactverif.cli.isolation_options import place_line
from contactverif.cli.output_files import OutputFiles
from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.cli.verify_job import VerifyJob
    from contactverif.contract.result import Run
    from contactverif.run.store import Store

STOPPED = 130  # The exit status after Ctrl-C.
NOT_WRITTEN = 2  # The exit status if a file could not be written.
_LINES_OF_A_PLUGIN = 5


def _write_files(files: OutputFiles, writers: Mapping[str, Callable[[Path], None]]) -> OutputFiles:
    """Write each file by the function of its suffix, and return those that are there. A line says why one is not."""
    return files.only(
        [suffix for suffix, path in files.paths.items() if _write(writers[suffix], path, files.names[suffix])]
    )


def _write(write: Callable[[Path], None], path: Path, name: Path) -> bool:
    """Write a file; return whether it is there."""
    try:
        write(path)
    except MisuseError as error:
        _warn(f"{name} is not written: {error.found.removeprefix(f'{path}: ')}")
    except (OSError, RuntimeError) as error:  # The netCDF library raises both, with words of its own.
        from contactverif_reports.files import reason_not_to_grow

        _warn(f"{name} is not written: {reason_not_to_grow(path) or getattr(error, 'strerror', None) or error}")
    else:
        return True
    return False


def _end_journal(store: Store, *, complete: bool) -> None:
    """Remove the journal once the files are complete."""
    from contactverif.run.journal import remove_journal

    if store.write_error:
        _warn(f"the journal could not be written to its end: {store.write_error}")
    if complete and store.folder is not None:
        remove_journal(store.folder)


class End(NamedTuple):
    """The files, the exit status and the gaps of a run."""

    files: OutputFiles  # Those that were written.
    gap: str  # What was not judged; empty if nothing is missing.
    complete: bool
    status: int  # The exit status; 0 only if nothing is missing in the run or in its files, and promises are kept.


def end_run(
    job: VerifyJob,
    store: Store,
    find_missing: Callable[[], str],
    writers: Mapping[str, Callable[[Path], None]],
    *,
    promises_kept: bool,
) -> End:
    """Write the files before anything is shown, so that nothing that was judged is lost, and remove the journal."""
    gap = find_missing() if promises_kept else ""
    written = _write_files(job.files, writers)
    complete = written.paths == job.files.paths and not gap
    _end_journal(store, complete=complete)
    if gap:
        return End(written, gap, complete, 1)
    whole = complete and not store.write_error
    return End(written, gap, complete, (0 if promises_kept else 1) if whole else NOT_WRITTEN)


@contextmanager
def watch_for_stops(job: VerifyJob) -> Iterator[None]:
    """Open a block in which a job is judged. After Ctrl-C it shows what was judged; if a worker dies, how to go on."""
    from contactverif.cli.console import show
    from contactverif.cli.run_screen import RunScreen
    from contactverif.run.run import RunStopped
    from contactverif.run.scheduler import WorkerError

    try:
        yield
    except RunStopped as stop:
        show(RunScreen(stop.run))
        say_how_to_go_on(job)
        raise typer.Exit(STOPPED) from None
    except WorkerError:
        say_how_to_go_on(job)
        raise


def say_how_to_go_on(job: VerifyJob) -> None:
    """Print the line that goes on with a run."""
    if job.resume_line:
        typer.echo(f"what was judged is kept; to go on: {job.resume_line}")
    else:
        typer.echo("with --out FILE.nc a run can go on where it was stopped")


def say_where_plugins_ran(provenance: Mapping[str, str]) -> None:
    """Print in a last line whether plugins were in a box; where they live in this process, the user has said so."""
    place = provenance.get("isolation", Isolation.INLINE)
    if place != Isolation.INLINE:
        typer.echo(place_line(place))


def show_what_plugins_printed() -> None:
    """End the processes of the plugins, and show the last lines that each of them printed."""
    from rich.text import Text

    from contactverif.cli.console import show_as_it_is
    from contactverif.isolation.host import end_all

    for name, printed in end_all().items():
        lines = printed.decode(errors="replace").splitlines()[-_LINES_OF_A_PLUGIN:]
        show_as_it_is(Text("\n".join([f"the process of {name} printed, at last:", *(f"    {line}" for line in lines)])))


def say_how_many_were_stored(result: Run) -> None:
    """Print how many outcomes of a run earlier processes had judged."""
    if stored := result.provenance.get("stored_outcomes"):
        typer.echo(f"outcomes that were judged before: {stored}")


def _warn(words: str) -> None:
    """Print a line about a file that could not be written."""
    typer.echo(f"contactverif: {' '.join(words.split())}", err=True)
