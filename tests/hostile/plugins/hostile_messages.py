"""Plugins that speak the harness' own language on the line to it, and say there what no honest process says.

Rule for the next editor: the messages here are those of `contactverif.isolation.messages`, and change with them.
"""

from __future__ import annotations

import os
import struct
import sys
from contextlib import suppress
from typing import Any

import msgspec
import numpy as np
from hostile_kit import EITHER, HostileNts, before, instead

import contactverif_nts

MOST_FILES = 200
ANSWER, FAILURE, LOADED = "answer", "failure", "loaded"  # The names of messages.


def _question() -> int:
    """Return the number of the question that this process is answering, as the harness' own code there knows it."""
    frame = sys._getframe()
    while (frame := frame.f_back) is not None:
        if hasattr(request := frame.f_locals.get("request"), "question"):
            return int(request.question)
    return 0


def _say(kind: str, *content: Any) -> None:
    """Send a reply to every socket of this process, before the real answer."""
    data = msgspec.msgpack.encode([[kind, _question(), *content]])
    for number in range(3, MOST_FILES):
        with suppress(OSError):
            if os.readlink(f"/proc/self/fd/{number}").startswith("socket"):
                os.write(number, struct.pack("<Q", len(data)) + data)


@before("residual", ends=EITHER)
def say_misuse() -> None:
    """Tell the harness that the user has made a mistake on the command line, which would end the run."""
    _say(FAILURE, "misuse", "exception", ["--seed", "nothing", "another command"])


@before("residual", ends=EITHER)
def say_too_much() -> None:
    """Tell the harness of an error in 5 MB of escape sequences."""
    _say(FAILURE, "plugin", "exception", ["\x1b[2J\x07\n" * 700_000])


@before("residual", ends=EITHER)
def say_no_words() -> None:
    """Tell the harness of an error without words."""
    _say(FAILURE, "plugin", "exception", [])


@before("residual", ends=EITHER)
def say_loaded_again() -> None:
    """Tell the harness in the middle of a case that a formulation with other promises was loaded."""
    _say(LOADED, {"flat": True, "enforcement": "multiplier", "nonsense": 1}, ["pair", "nonsense"])


@before("residual", ends=EITHER)
def say_huge_shape() -> None:
    """Answer an array without numbers whose shape is larger than any memory."""
    _say(ANSWER, {"residual": ["<f8", [0, 2**62], b""]}, 0.0, 0.0)


@before("residual", ends=EITHER)
def say_objects() -> None:
    """Answer an array of Python objects, whose bytes would be addresses."""
    _say(ANSWER, {"residual": ["|O", [1], b"\x08" * 8]}, 0.0, 0.0)


@before("residual", ends=EITHER)
def say_negative_seconds() -> None:
    """Answer that the call took less than no time."""
    _say(ANSWER, {"residual": ["<f8", [1], bytes(8)]}, float("-inf"), float("-inf"))


@before("residual", ends=EITHER)
def say_deep_message() -> None:
    """Send a message of lists in lists, 10,000 deep."""
    data = b"\x91" * 10_000 + b"\xc0"
    for number in range(3, MOST_FILES):
        with suppress(OSError):
            if os.readlink(f"/proc/self/fd/{number}").startswith("socket"):
                os.write(number, struct.pack("<Q", len(data)) + data)


@before("residual", ends=EITHER)
def say_a_little() -> None:
    """Send the beginning of a message, and the rest of it never."""
    for number in range(3, MOST_FILES):
        with suppress(OSError):
            if os.readlink(f"/proc/self/fd/{number}").startswith("socket"):
                os.write(number, struct.pack("<Q", 100_000) + b"\x93")


class _ManyMultipliers(HostileNts):
    """NTS with Lagrange multipliers, a billion of them."""

    def __init__(self, penalty: float) -> None:
        super().__init__(penalty, {})
        self._right: Any = contactverif_nts.nts_lm(penalty=penalty)

    def n_multipliers(self, interface: Any) -> int:
        return 10**9


def billion_multipliers(*, penalty: float) -> Any:
    """State that contact is enforced by a billion multipliers, for which somebody else must find the memory."""
    return _ManyMultipliers(penalty)


billion_multipliers.__dict__.update(ends="caught", verb="n_multipliers")


@instead("contact_points", ends=EITHER)
def million_points(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Answer a million contact points, which the harness must compare with exact ones, one by one."""
    points = right()
    return points.select(np.arange(10**6) % len(points.gap))
