"""The options that say where a plugin lives, what it may take, and what is open to it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from contactverif.api.plugin_places import Isolation, limits_of, settle_place

if TYPE_CHECKING:
    from contactverif.isolation.limits import Limits

ISOLATION_HELP = (
    "box: each plugin in a process of its own that can write nothing, and sees no network and no other process; the "
    "default where the system has boxes. landlock: a process that writes no file, the default where it can be had and "
    "a box cannot. process: without either. inline: in this process, for debugging."
)
OPEN_HELP = "What a plugin in a box may use and write: a file, a folder, a device, or network. Repeatable."


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
        """Return the options with the place and with what is open, as `settle_place` chooses them."""
        place, opened = settle_place(self.isolation, self.opened, "--isolation")
        return replace(self, isolation=place, opened=opened)

    def limits(self, hidden: Iterable[Path] = ()) -> Limits | None:
        """Return the limits of a plugin's process, and its box, in which some paths are not there.

        None if plugins live in this process.
        """
        place, opened = settle_place(self.isolation, self.opened, "--isolation")
        return limits_of(place, opened, hidden, seconds=self.time_limit, memory=self.memory_limit)


def place_line(place: str) -> str:
    """Say whether the plugins of a run were in a box, as its report has it, and how to get one where there was none."""
    if place.startswith(Isolation.BOX):
        return f"The plugins ran in a {place}."
    from contactverif.isolation.box import why_no_box

    reason = why_no_box() or "as --isolation says"
    return f"The plugins ran in a {place} without a box: {reason}."
