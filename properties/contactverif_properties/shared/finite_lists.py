"""The cases of a property that has a finite list of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from contactverif.contract.case import Case

Cases = tuple[Case, ...]


def unless_given(make: Callable[[], Cases]) -> Callable[[Any], Cases | None]:
    """Return a function for `Property.cases`: the finite list, or None where an interface or a scene is given."""
    return lambda interface: make() if interface is None else None
