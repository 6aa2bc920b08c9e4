"""The name of a strategy's random source, on which the cases of a run depend besides the seed.

Rule for the next editor: a name never changes, wherever its function moves, or the same seed gives other cases.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

_Function = TypeVar("_Function", bound=Callable[..., Any])


def random_source(name: str) -> Callable[[_Function], _Function]:
    """Return a decorator that stores a name at a function for `Property.cases`.

    Properties with this function are judged on the same cases. A function without a stored name has the id of its
    property instead.

    Parameters
    ----------
    name : str
        A name that no other function has.
    """

    def store(function: _Function) -> _Function:
        function.__dict__["random_source"] = name
        return function

    return store


def name_of_source(function: Callable[..., Any]) -> str:
    """Return the stored name of a function, or an empty string."""
    return str(getattr(function, "random_source", ""))
