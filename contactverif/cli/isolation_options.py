"""The options that say where a plugin lives, what it may take, and what is open to it."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from contactverif.cli.settings import read_settings
from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.isolation.limits import Limits

ISOLATION_HELP = (
    "box: each plugin in a process of its own that can write nothing, and sees no network and no other process; the "
    "default where the system has boxes. landlock: a process that writes no file, the default where it can be had and "
    "a box cannot. process: without either. inline: in this process, for debugging."
)
OPEN_HELP = "What a plugin in a box may use and write: a file, a folder, a device, or network. Repeatable."


class Isolation(StrEnum):
    """The place where plugins live."""

    BOX = "box"
    LANDLOCK = "landlock"
    PROCESS = "process"
    INLINE = "inline"


@dataclass(frozen=True, slots=True)
class IsolationOptions:
    """The place where a plugin lives, the limits of its process, and what is open to it."""

    isolation: Annotated[Isolation | None, typer.Option(help=ISOLATION_HELP)] = None
    time_limit: Annotated[
        float, typer.Option(help="Longest time of a call in a plugin's process.", metavar="SECONDS")
    ] = 60.0
    memory_limit: Annotated[int, typer.Option(help="Memory that a plugin's process may take.", metavar="MEGABYTES")] = (
        4096
    )
    opened: Annotated[list[str] | None, typer.Option("--open", help=OPEN_HELP, metavar="PATH")] = None

    def settle(self) -> IsolationOptions:
        """Return the options with the place and with what is open, as the user, the project or the system says.

        Without a choice of the user a plugin is in a box, or else has rules of Landlock, or else neither. Under pytest
        it is in this process, where a test may want to look into it.
        """
        settings = read_settings()
        opened = _absolute(settings.open if self.opened is None else self.opened)
        place = self.isolation or (Isolation(settings.isolation) if settings.isolation else None)
        if place is None and "PYTEST_CURRENT_TEST" in os.environ:
            place = Isolation.INLINE
        if place in (None, Isolation.BOX, Isolation.LANDLOCK):
            place = _strongest(place, tuple(opened))
        return replace(self, isolation=place, opened=opened)

    def limits(self, hidden: Iterable[Path] = ()) -> Limits | None:
        """Return the limits of a plugin's process, and its box, in which some paths are not there.

        None if plugins live in this process.
        """
        settled = self.settle()
        if settled.isolation is Isolation.INLINE:
            return None
        from contactverif.isolation.box import Box
        from contactverif.isolation.limits import Limits
        from contactverif.isolation.process import adopt_orphans
        from contactverif.run.keys import state_folder

        adopt_orphans()
        with suppress(OSError, RuntimeError):  # Only what is there can be hidden.
            state_folder().mkdir(mode=0o700, parents=True, exist_ok=True)
            hidden = (*hidden, state_folder())
        by_rules = settled.isolation is Isolation.LANDLOCK
        box = Box(tuple(settled.opened or ()), tuple(map(str, hidden)), by_rules=by_rules)
        return Limits(self.time_limit, self.memory_limit, None if settled.isolation is Isolation.PROCESS else box)


def _strongest(wanted: Isolation | None, opened: tuple[str, ...]) -> Isolation:
    """Return the place that the user wants, which must be possible, or else the safest that is."""
    from contactverif.isolation.box import Box, why_no_box
    from contactverif.isolation.landlock import landlock_version

    reason = "" if wanted is Isolation.LANDLOCK else why_no_box(Box(opened))
    if reason and wanted is Isolation.BOX:
        raise MisuseError("--isolation", f"box, but {reason}", "a system that has boxes, or process")
    if wanted is Isolation.LANDLOCK and not landlock_version():
        needed = "Linux with Landlock and the package landlockpy, or process"
        raise MisuseError("--isolation", "landlock, which this system has not", needed)
    if wanted is None and reason:
        return Isolation.LANDLOCK if landlock_version() else Isolation.PROCESS
    return wanted or Isolation.BOX


def place_line(place: str) -> str:
    """Say whether the plugins of a run were in a box, as its report has it, and how to get one where there was none."""
    if place.startswith(Isolation.BOX):
        return f"The plugins ran in a {place}."
    from contactverif.isolation.box import why_no_box

    reason = why_no_box() or "as --isolation says"
    return f"The plugins ran in a {place} without a box: {reason}."


def _absolute(opened: Iterable[str]) -> list[str]:
    """Return what is open by absolute paths, each of which must exist."""
    from contactverif.isolation.landlock import NETWORK

    paths = [path if path == NETWORK else os.path.abspath(path) for path in opened]
    for path in paths:
        if path != NETWORK and not os.path.exists(path):
            raise MisuseError("--open", f"{path}, which does not exist", f"a path that exists, or {NETWORK}")
    return paths
