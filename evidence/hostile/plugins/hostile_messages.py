"""Plugins that speak the harness' own language on the line to it, and say there what no honest process says.

Rule for the next editor: the messages here are those of `contactverif.isolation.wire`, and change with them.
"""

import os
import struct
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from hostile_kit import CAUGHT, EITHER, LONG, MOST_FILES, HostileNts, before, instead, send_all, write_to_sockets

import contactverif_nts

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
    write_to_sockets(msgspec.msgpack.encode([[kind, _question(), *content]]))


say_misuse = before("residual", ends=EITHER)(
    lambda: _say(FAILURE, "misuse", "exception", ["--seed", "nothing", "another command"]),
    "Tell the harness that the user has made a mistake on the command line, which would end the run.",
)
say_misuse_in_make = before("make", ends=EITHER)(
    lambda: _say(FAILURE, "misuse", "exception", ["--seed", "nothing", "another command"]),
    "Tell the harness, while it is loaded, that the user has made a mistake, which would end a list of all.",
)


@instead("make")
def say_misuse_when_it_starts_again(right: Any) -> HostileNts:
    """End the process at the first forces; the next one says that the user has made a mistake."""
    mark = Path(os.environ.get("NUMBA_CACHE_DIR", tempfile.gettempdir()), "started")
    if mark.exists():
        mark.unlink()
        _say(FAILURE, "misuse", "exception", ["--seed", "nothing", "another command"])
    return HostileNts(1.0, {"residual": lambda *_: (mark.touch(), os._exit(1))})


say_too_much = before("residual", ends=EITHER)(
    lambda: _say(FAILURE, "plugin", "exception", ["\x1b[2J\x07\n" * 700_000]),
    "Tell the harness of an error in 5 MB of escape sequences.",
)
say_no_words = before("residual", ends=EITHER)(
    lambda: _say(FAILURE, "plugin", "exception", []), "Tell the harness of an error without words."
)
say_loaded_again = before("residual", ends=EITHER)(
    lambda: _say(LOADED, {"flat": True, "enforcement": "multiplier", "nonsense": 1}, ["pair", "nonsense"]),
    "Tell the harness in the middle of a case that a formulation with other promises was loaded.",
)
say_huge_shape = before("residual", ends=EITHER)(
    lambda: _say(ANSWER, {"residual": ["<f8", [0, 2**62], b""]}, 0.0, 0.0),
    "Answer an array without numbers whose shape is larger than any memory.",
)
say_objects = before("residual", ends=EITHER)(
    lambda: _say(ANSWER, {"residual": ["|O", [1], b"\x08" * 8]}, 0.0, 0.0),
    "Answer an array of Python objects, whose bytes would be addresses.",
)
say_negative_seconds = before("residual", ends=EITHER)(
    lambda: _say(ANSWER, {"residual": ["<f8", [1], bytes(8)]}, float("-inf"), float("-inf")),
    "Answer that the call took less than no time.",
)
say_deep_message = before("residual", ends=EITHER)(
    lambda: write_to_sockets(b"\x91" * 10_000 + b"\xc0"), "Send a message of lists in lists, 10,000 deep."
)
say_a_little = before("residual", ends=EITHER)(
    lambda: write_to_sockets(b"\x93", 100_000), "Send the beginning of a message, and the rest of it never."
)


def _many(kind: int, data: bytes, count: int) -> bytes:
    """Return a list (0xdd) or a mapping (0xdf) of so many entries, whose bytes are known."""
    return bytes([kind]) + struct.pack(">I", count) + data


def _send(kind: str, *parts: Any) -> None:
    """Send a reply instead of the real one; bytes among its parts are encoded already."""
    content = [
        part if isinstance(part, bytes) else msgspec.msgpack.encode(part) for part in (kind, _question(), *parts)
    ]
    send_all(b"".join([bytes([0x91, 0x90 + len(content)]), *content]))
    time.sleep(LONG)


_BYTES = 100_000_000
send_long_shape = before("residual", ends=CAUGHT)(
    lambda: _send(ANSWER, b"\x81\xa1a\x93\xa3<f8" + _many(0xDD, b"\1" * _BYTES, _BYTES) + b"\xc4\0", 0.0, 0.0),
    "Answer an array whose shape has a hundred million axes.",
)
send_many_names = before("residual", ends=CAUGHT)(
    lambda: _send(
        ANSWER,
        _many(0xDF, b"".join(b"\xa8%8d\x93\xa3<f8\x91\0\xc4\0" % n for n in range(3_000_000)), 3_000_000),
        0.0,
        0.0,
    ),
    "Answer three million arrays, each with a name of its own.",
)
send_many_words = before("residual", ends=CAUGHT)(
    lambda: _send(FAILURE, "plugin", "exception", _many(0xDD, b"\xa0" * _BYTES, _BYTES)),
    "Tell the harness of an error in a hundred million words.",
)
send_wide_traits = before("traits", ends=CAUGHT)(
    lambda: _send(LOADED, b"\x81\xa1a" + _many(0xDD, b"\x90" * _BYTES, _BYTES), []),
    "State promises that are a list of a hundred million lists.",
)
send_many_small_lists = before("traits", ends=CAUGHT)(
    lambda: _send(LOADED, b"\x81\xa1a" + _many(0xDD, b"\x90" * 1_000_000, 1_000_000), []),
    "State promises that are a list of a million lists, as many as there may be.",
)


@before("residual", ends=CAUGHT)
def dribble() -> None:
    """Send an answer byte by byte, and count each of them as progress."""
    write_to_sockets(b"\x91", 100_000)
    for count in range(int(LONG / 0.1)):
        time.sleep(0.1)
        for number in range(3, MOST_FILES):
            with suppress(OSError):
                if "progress" in os.readlink(f"/proc/self/fd/{number}"):
                    os.pwrite(number, bytes([count % 256]), 0)
                elif os.readlink(f"/proc/self/fd/{number}").startswith("socket"):
                    os.write(number, b"\x91")


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
