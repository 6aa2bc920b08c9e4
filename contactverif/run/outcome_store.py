"""The outcomes of a row, kept so that a row may have a million of them.

The first outcomes of a row stay whole, and so do the first failures. Of all others the numbers stay, in one long array
and without their meshes: all that a report stores. An outcome is made of them again when somebody asks for it.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import overload

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, Verdict
from contactverif.run.outcome_forms import OutcomeForm, decode, encode

WHOLE = 100  # The first outcomes of a row that stay as they are.
FAILURES = 100  # The failures behind them that stay as they are.


class OutcomeStore(Sequence[Outcome]):
    """The outcomes of a row in order. `append` adds one; everything else only reads.

    Parameters
    ----------
    whole : int
        The first outcomes that stay as they are.
    """

    def __init__(self, whole: int = WHOLE) -> None:
        self._n_whole = whole
        self._whole: dict[int, Outcome] = {}
        self._forms: list[OutcomeForm] = []
        self._numbers_of_forms: dict[OutcomeForm, int] = {}
        self._form_of = array("l")
        self._starts = array("q")
        self._numbers = array("d")
        self._n_failures = 0

    def keeps_whole(self, number: int, outcome: Outcome) -> bool:
        """Return whether an outcome stays as it is if it gets this number; of failures the first few do."""
        failed = outcome.verdict in (Verdict.FAIL, Verdict.CRASHED)
        return number < self._n_whole or (failed and self._n_failures < FAILURES)

    def append(self, outcome: Outcome, case: Case | None) -> None:
        """Add an outcome.

        Parameters
        ----------
        outcome : Outcome
            An outcome with the summary of its case.
        case : Case | None
            The case, if it is kept anyway; it stays with an outcome that stays whole.
        """
        number = len(self)
        if self.keeps_whole(number, outcome):
            self._n_failures += number >= self._n_whole
            self._whole[number] = outcome if case is None else replace(outcome, case_or_summary=case)
            self._form_of.append(-1)
            self._starts.append(len(self._numbers))
            return
        form, numbers = encode(outcome)
        place = self._numbers_of_forms.setdefault(form, len(self._forms))
        if place == len(self._forms):
            self._forms.append(form)
        self._form_of.append(place)
        self._starts.append(len(self._numbers))
        self._numbers.extend(numbers)

    def __len__(self) -> int:
        return len(self._form_of)

    @overload
    def __getitem__(self, number: int) -> Outcome: ...
    @overload
    def __getitem__(self, number: slice) -> tuple[Outcome, ...]: ...
    def __getitem__(self, number: int | slice) -> Outcome | tuple[Outcome, ...]:
        if isinstance(number, slice):
            return tuple(self[n] for n in range(*number.indices(len(self))))
        if not -len(self) <= number < len(self):
            raise IndexError(number)
        number %= len(self)
        if number in self._whole:
            return self._whole[number]
        start = self._starts[number]
        end = self._starts[number + 1] if number + 1 < len(self) else len(self._numbers)
        return decode(self._forms[self._form_of[number]], self._numbers[start:end].tolist())

    def __iter__(self) -> Iterator[Outcome]:
        return (self[number] for number in range(len(self)))
