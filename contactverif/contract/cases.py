"""The source of the cases of a property, with the stored name on which the drawn cases depend besides the seed.

Rule for the next editor: a stored name never changes, wherever its function moves, or the same seed gives other cases.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from inspect import signature
from typing import Any, TypeVar

from contactverif.contract.case import Case
from contactverif.contract.faces import TRIANGLE

_Function = TypeVar("_Function", bound=Callable[..., Any])


OWN_MESHES = "own meshes with a known answer"


def return_none(place: Any) -> None:
    """Return None: there are no cases on an interface or a scene."""


@dataclass(frozen=True, slots=True)
class Cases:
    """The source of the cases of a property: random ones, random ones of several kinds, or a list.

    Call it with None for the property's own cases. Call it with an interface (or with the case of a scene, if the
    property is about bodies) for cases there; None comes back if the property cannot be checked there.

    Attributes
    ----------
    make : Callable[..., Any]
        The function that makes the cases.
    is_list : bool
        Whether they are a list, of which all are judged, whatever the number of examples.
    on_place : Callable[[Any], Any]
        Makes the cases on an interface or a scene, in place of the list.
    needs : str
        What an interface or a scene must be so that there are cases on it: "a flat interface". A run says it where
        there are none.
    """

    make: Callable[..., Any]
    is_list: bool = False
    on_place: Callable[[Any], Any] = return_none
    needs: str = OWN_MESHES

    @classmethod
    def random(cls, make: Callable[..., Any]) -> Cases:
        """Return random cases.

        Parameters
        ----------
        make : Callable[..., Any]
            Takes None, an interface or a scene, and returns a hypothesis strategy of `Case`, or None. Properties for
            which the same function makes the cases are judged on the same ones, if it has a name (`random_source`).
        """
        return cls(make, needs=needs_of_place(make))

    @classmethod
    def by_kind(cls, make: Callable[..., Mapping[str, Any] | Any]) -> Cases:
        """Return random cases of several kinds of situation, each with the same share.

        Parameters
        ----------
        make : Callable[..., Mapping[str, Any] | Any]
            As in `random`, but it returns {kind: strategy}.
        """
        return cls(make, needs=needs_of_place(make))

    @classmethod
    def from_list(
        cls,
        make: Callable[[], tuple[Case, ...]],
        on_place: Callable[[Any], Any] = return_none,
        needs: str = OWN_MESHES,
    ) -> Cases:
        """Return a list of cases, each with a name of its own; tables and reports call it by that name.

        Parameters
        ----------
        make : Callable[[], tuple[Case, ...]]
            Returns the list.
        on_place : Callable[[Any], Any]
            Takes an interface or a scene, and returns a strategy, or None if there are no cases.
        needs : str
            What an interface or a scene must be so that there are cases.
        """
        return cls(make, is_list=True, on_place=on_place, needs=needs)

    @property
    def takes_faces(self) -> bool:
        """True if the function makes cases in space with other faces than triangles, by an argument `faces`."""
        return "faces" in signature(self.make).parameters

    def on_faces(self, faces: tuple[int, ...]) -> Cases:
        """Return the cases on faces with these numbers of corners."""
        return self if faces == (TRIANGLE,) else replace(self, make=_OnFaces(self.make, faces))

    @property
    def random_source(self) -> str:
        """The stored name of the function, or an empty string."""
        return name_of_source(self.make)

    def __call__(self, place: Any) -> Any:
        """Return the cases on an interface or a scene; on None, the property's own."""
        if not self.is_list:
            return self.make(place)
        return self.make() if place is None else self.on_place(place)


@dataclass(frozen=True, slots=True)
class _OnFaces:
    """A function that makes cases on faces with some numbers of corners."""

    make: Callable[..., Any]
    faces: tuple[int, ...]

    def __call__(self, place: Any) -> Any:
        return self.make(place, self.faces)

    @property
    def random_source(self) -> str:
        """The stored name of the function, if it has one, and the faces: these are other cases."""
        name = name_of_source(self.make)
        return name and f"{name} on faces of {' or '.join(map(str, self.faces))} corners"


def random_source(name: str, needs: str = "") -> Callable[[_Function], _Function]:
    """Return a decorator that stores a name at a function that makes cases, and what it needs of an interface.

    Properties with this function are judged on the same cases. A function without a stored name has the id of its
    property instead.

    Parameters
    ----------
    name : str
        A name that no other function has.
    needs : str
        What an interface or a scene must be so that the function makes cases on it: "a flat interface".
    """

    def store(function: _Function) -> _Function:
        function.__dict__["random_source"] = name
        function.__dict__["needs"] = needs
        return function

    return store


def name_of_source(function: Callable[..., Any]) -> str:
    """Return the stored name of a function, or an empty string."""
    return str(getattr(function, "random_source", ""))


def needs_of_place(function: Callable[..., Any]) -> str:
    """Return the stored words about what a function that makes cases needs of an interface or a scene."""
    return str(getattr(function, "needs", "") or OWN_MESHES)
