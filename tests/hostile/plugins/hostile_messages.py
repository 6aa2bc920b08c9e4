"""Plugins that speak the harness' own language on the line to it, and say there what no honest process says.

Rule for the next editor: the messages here are those of `contactverif.isolation.messages`, and change with them.
"""

import sys
from typing import Any

import msgspec
import numpy as np
from hostile_kit import EITHER, HostileNts, before, instead, write_to_sockets

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
