"""A property of an object that is computed once, when it is first read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

_Value = TypeVar("_Value")


class lazy(Generic[_Value]):
    """A `functools.cached_property` without a lock.

    Python 3.11 holds one lock for all objects of the class while a value is computed. A case that needs an answer of a
    plugin for it would keep all others from going on, see `contactverif.isolation.lockstep`.
    """

    def __init__(self, compute: Callable[[Any], _Value]) -> None:
        self._compute, self.__doc__ = compute, compute.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type | None = None) -> _Value:
        value = instance.__dict__[self._name] = self._compute(instance)
        return value
