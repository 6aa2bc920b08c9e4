"""The limits of a plugin's process."""

from __future__ import annotations

import math
from dataclasses import dataclass

from contactverif.contract.errors import MisuseError

MEGABYTE = 2**20
_START_FACTOR = 5.0  # Import, first calls and compilation take longer than what follows.


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of a plugin's process.

    Attributes
    ----------
    seconds : float
        The longest time that a call may take. The import and the first call of each method may take five times as
        long, because they compile.
    memory : int
        The address space, in megabytes, that the process may take beyond what it has at its start.

    Raises
    ------
    MisuseError
        If a limit is not positive and finite.
    """

    seconds: float = 60.0
    memory: int = 4096

    def __post_init__(self) -> None:
        for argument, value in (("time limit", self.seconds), ("memory limit", self.memory)):
            if not (math.isfinite(value) and value > 0):
                raise MisuseError(argument, str(value), "a positive number")

    @property
    def start_seconds(self) -> float:
        """The longest time that loading and each first call may take."""
        return _START_FACTOR * self.seconds
