"""The methods of formulations that run in a call, as the interpreter sees them: also those that a plugin calls itself.

Unlike seconds they are the same on every machine, so that a needless call is found without a clock.
"""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

METHODS = frozenset({"pair", "residual", "tangent", "residual_and_tangent"})


class MethodCalls:
    """A block in which `count` grows by one for each call of a Python function that has the name of a method."""

    def __init__(self) -> None:
        self.count = 0
        self._before: Any = None

    def __enter__(self) -> MethodCalls:
        self._before = sys.getprofile()
        sys.setprofile(self._see)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(self._before)

    def _see(self, frame: FrameType, event: str, _: Any) -> None:
        self.count += event == "call" and frame.f_code.co_name in METHODS
