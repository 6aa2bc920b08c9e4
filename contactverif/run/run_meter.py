"""A meter of a whole run: the cases that are judged, of how many, and a guess of the seconds that are left."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from time import perf_counter

from contactverif.contract.property import Outcome, Property
from contactverif.contract.result import Row
from contactverif.contract.subject import Subject
from contactverif.run.rows import OpenRow
from contactverif.run.scheduler import RunProgress
from contactverif.sampling.draw import Sampling

_SHARE = 0.05  # The share of the cases that must be judged before anything is guessed: the first property is dear.
_LIST = 8  # Cases of a list that is not made yet: making all of them takes a second.
# Seconds of a case over those of a drawn one that solves no bodies, of VTS-PPT: {(solves bodies, is in a list): ratio}.
# They count only until the first cases of that kind are measured.
_COSTS = {(False, False): 1.0, (False, True): 0.7, (True, False): 2.7, (True, True): 8.6}


class RunMeter:
    """A meter of a run. A kind of cases is whether they solve bodies, and whether they stand in a list."""

    def __init__(self, subjects: Sequence[Subject], questions: Sequence[Property], sampling: Sampling) -> None:
        self._kinds: dict[str, tuple[bool, bool]] = {}
        self._planned: dict[tuple[str, str], int] = {}
        self._cases, self._seconds = Counter[tuple[bool, bool]](), defaultdict[tuple[bool, bool], float](float)
        self._started: float | None = None
        for subject, plain in product(subjects, questions):
            question = plain.for_traits(subject.traits)
            if sampling.interface is not None and sampling.source(question) is None:
                continue  # It has no cases on this mesh.
            is_list = sampling.interface is None and getattr(question.cases, "is_list", False)
            self._kinds[question.id] = question.bodies, is_list
            if not (question.refusal_of(subject) or question.needs - subject.provides):
                self._planned[subject.name, question.id] = _LIST if is_list else sampling.examples

    def measure(self, property_id: str, outcomes: Iterable[Outcome]) -> None:
        """Note what cases have cost that were judged just now."""
        for outcome in outcomes:
            self._cases[self._kinds[property_id]] += 1
            self._seconds[self._kinds[property_id]] += outcome.seconds

    def read(self, rows: Mapping[tuple[str, str], OpenRow | Row]) -> RunProgress:
        """Return how far a run with these rows is, in which others may still be missing."""
        if self._started is None:  # First calls, which may compile, say nothing about the cases.
            self._started = perf_counter()
        finished, planned, left = 0, 0, Counter[tuple[bool, bool]]()
        for key, count in self._planned.items():
            row = rows.get(key)
            if isinstance(row, Row):
                continue
            n_finished, n_cases = (0, count) if row is None else (row.n_finished, row.planned or count)
            finished, planned = finished + n_finished, planned + n_cases
            left[self._kinds[key[1]]] += n_cases - n_finished
        return RunProgress(finished, planned, self._guess(left) if finished > _SHARE * planned else None)

    def _guess(self, left: Mapping[tuple[bool, bool], int]) -> float | None:
        """Return the seconds that cases take, if they go on as fast as those before."""
        measured = sum(self._seconds.values())
        if not measured or self._started is None:
            return None
        unit = measured / sum(_COSTS[kind] * count for kind, count in self._cases.items())
        ahead = sum(count * self._cost(kind, unit) for kind, count in left.items())
        return ahead * (perf_counter() - self._started) / measured

    def _cost(self, kind: tuple[bool, bool], unit: float) -> float:
        """Return the seconds of a case of a kind; `unit` is that of a drawn one without bodies."""
        return self._seconds[kind] / self._cases[kind] if self._cases[kind] else _COSTS[kind] * unit
