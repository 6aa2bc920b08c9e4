"""The limits of a child process, and the box that it may be in."""

import math
from dataclasses import dataclass

from contactverif.contract.errors import MisuseError
from contactverif.isolation.box import Box

_START_FACTOR = 5.0  # Import, first calls and compilation take longer than what follows.


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of a child process. They are positive and finite."""

    # The longest time that a call may take. The import of a plugin and the first call of each of its methods may take
    # five times as long, because they compile.
    seconds: float = 60.0
    # The address space, in megabytes, that the process may take beyond what it has at its start.
    memory: int = 4096
    # The box of a plugin's process; None for a process without one.
    box: Box | None = None

    def __post_init__(self) -> None:
        for argument, value in (("time limit", self.seconds), ("memory limit", self.memory)):
            if not (math.isfinite(value) and value > 0):
                raise MisuseError(argument, str(value), "a positive number")

    @property
    def start_seconds(self) -> float:
        """The longest time that loading and each first call may take."""
        return _START_FACTOR * self.seconds
