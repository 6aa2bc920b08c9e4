"""The loading of formulations and engines by the workers of a run, while the run's own process does other things.

A worker that has loaded one has the plugin's process ready when the first cases come.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from functools import partial
from itertools import cycle, islice
from pathlib import Path

from contactverif.contract.errors import MisuseError
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote_formulation import code_files, note_code_files
from contactverif.plugins.engines import load_subject
from contactverif.run.scheduler import fetch, submit

Loader = Callable[[], Subject | NotLoaded]


def begin_loading(names: Sequence[str], limits: Limits | None, executor: Executor | None = None) -> list[Loader]:
    """Begin to load formulations and engines in the workers of an executor.

    Parameters
    ----------
    names : Sequence[str]
        The names as on the command line.
    limits : Limits | None
        The limits of the plugins' processes; None to load all in this process.
    executor : Executor | None
        Worker processes; None to load all by this process.

    Returns
    -------
    list[Loader]
        For each name a function that waits for what is loaded and returns it. It raises a MisuseError as `load_subject`
        does.
    """
    here = [partial(load_subject, name, limits) for name in names]
    if executor is None or limits is None:
        return list(here)
    futures = [submit(executor, _load, name, limits) for name in names]
    n_workers = int(getattr(executor, "_max_workers", 0))
    for name in islice(cycle(names), len(names), n_workers):  # Each worker has something to load.
        submit(executor, _load, name, limits)
    return [
        load if future is None else partial(_fetch, future, name, limits)
        for future, name, load in zip(futures, names, here, strict=True)
    ]


def _load(name: str, limits: Limits) -> tuple[Subject | NotLoaded | tuple[str, str, str], list[Path]]:
    """Return what a worker has loaded, or the words of its MisuseError, and the files of compiled code there."""
    try:
        subject = load_subject(name, limits)
    except MisuseError as error:
        return (error.argument, error.found, error.needed), []
    return subject, [] if isinstance(subject, NotLoaded) else code_files(subject)


def _fetch(future: Future[bytes], name: str, limits: Limits) -> Subject | NotLoaded:
    """Wait for what a worker loads, and return it, or raise its MisuseError."""
    loaded: Subject | NotLoaded | tuple[str, str, str]
    loaded, files = fetch(future, partial(_load, name, limits))
    if isinstance(loaded, tuple):
        raise MisuseError(*loaded)
    if isinstance(loaded, Subject):
        note_code_files(loaded, files)
    return loaded
