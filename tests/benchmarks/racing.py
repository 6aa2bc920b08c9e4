"""Types for the fixture `race` in conftest.py."""

from collections.abc import Callable
from typing import Any

Call = Callable[[], Any]
Race = Callable[[Call, Call, str], None]  # A call, its reference, and what the reference is in words.
