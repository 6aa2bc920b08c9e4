"""The outcomes of a row, which may be a million: each is made when somebody asks for it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import overload

from contactverif.contract.property import Outcome


class Outcomes(Sequence[Outcome]):
    """The outcomes of a row in order. A class of this kind has its length, and `at`."""

    @abstractmethod
    def at(self, number: int) -> Outcome:
        """Return an outcome by its number, from 0."""

    @overload
    def __getitem__(self, number: int) -> Outcome: ...
    @overload
    def __getitem__(self, number: slice) -> tuple[Outcome, ...]: ...
    def __getitem__(self, number: int | slice) -> Outcome | tuple[Outcome, ...]:
        if isinstance(number, slice):
            return tuple(self.at(n) for n in range(*number.indices(len(self))))
        if not -len(self) <= number < len(self):
            raise IndexError(number)
        return self.at(number % len(self))
