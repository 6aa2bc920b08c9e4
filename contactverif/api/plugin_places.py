"""The place where plugins live: a box, a process, or this process. Scripts and the command line choose it alike."""

from __future__ import annotations

import os
from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from contactverif.api.settings import read_settings
from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.isolation.limits import Limits


class Isolation(StrEnum):
    """The place where plugins live."""

    BOX = "box"
    LANDLOCK = "landlock"
    PROCESS = "process"
    INLINE = "inline"


def settle_place(
    wanted: Isolation | None, opened: Iterable[str] | None = None, argument: str = "isolation"
) -> tuple[Isolation, list[str]]:
    """Return the place of plugins and what is open to them, as the user, the project or the system says.

    Without a choice of the user a plugin is in a box, or else has rules of Landlock, or else neither. Under pytest it
    is in this process, where a test may want to look into it. `argument` is the name of the choice in an error.
    """
    settings = read_settings()
    paths = _absolute(settings.open if opened is None else opened)
    place = wanted or (Isolation(settings.isolation) if settings.isolation else None)
    if place is None and "PYTEST_CURRENT_TEST" in os.environ:
        place = Isolation.INLINE
    if place in (None, Isolation.BOX, Isolation.LANDLOCK):
        place = _strongest(place, tuple(paths), argument)
    return place, paths


def limits_of(
    place: Isolation, opened: Iterable[str], hidden: Iterable[Path] = (), *, seconds: float, memory: int
) -> Limits | None:
    """Return the limits of a plugin's process and its box, in which some paths are not there.

    None if plugins live in this process. A call takes at most `seconds`, a process at most `memory` megabytes.
    """
    if place is Isolation.INLINE:
        return None
    from contactverif.isolation.box import Box
    from contactverif.isolation.limits import Limits
    from contactverif.isolation.process import adopt_orphans

    adopt_orphans()
    box = Box(tuple(opened), tuple(map(str, hidden)), by_rules=place is Isolation.LANDLOCK)
    return Limits(seconds, memory, None if place is Isolation.PROCESS else box)


def _strongest(wanted: Isolation | None, opened: tuple[str, ...], argument: str) -> Isolation:
    """Return the place that the user wants, which must be possible, or else the safest that is."""
    from contactverif.isolation.box import Box, why_no_box
    from contactverif.isolation.confine import landlock_version

    reason = "" if wanted is Isolation.LANDLOCK else why_no_box(Box(opened))
    if reason and wanted is Isolation.BOX:
        raise MisuseError(argument, f"box, but {reason}", "a system that has boxes, or process")
    if wanted is Isolation.LANDLOCK and not landlock_version():
        needed = "Linux with Landlock and the package landlockpy, or process"
        raise MisuseError(argument, "landlock, which this system has not", needed)
    if wanted is None and reason:
        return Isolation.LANDLOCK if landlock_version() else Isolation.PROCESS
    return wanted or Isolation.BOX


def _absolute(opened: Iterable[str]) -> list[str]:
    """Return what is open by absolute paths, each of which must exist."""
    from contactverif.isolation.confine import NETWORK

    paths = [path if path == NETWORK else os.path.abspath(path) for path in opened]
    for path in paths:
        if path != NETWORK and not os.path.exists(path):
            raise MisuseError("--open", f"{path}, which does not exist", f"a path that exists, or {NETWORK}")
    return paths
