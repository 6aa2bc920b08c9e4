"""All that drives hypothesis: the planned cases of a property, and the shrinking of one that failed.

Hypothesis sees a formulation only while it shrinks. The planned cases are drawn first, in full, by a function that
never fails; so every formulation of a run is judged on the same cases, and a failure ends nothing early. The same seed
gives the same cases whoever asks, from whichever folder, with whatever else imported: every setting is spelled out
here (profiles of a user's own tests would leak in otherwise), nothing is stored, and see `_reproducible`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from hypothesis import HealthCheck, Phase, Verbosity, given, settings
from hypothesis import seed as seeded
from hypothesis.errors import Flaky, Unsatisfiable
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants
from hypothesis.statistics import collector
from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case

SHRINK_CALLS = 2000  # judgements spent on one counterexample; hypothesis itself stops after 500 shrinks or 300 s


@dataclass(frozen=True, slots=True)
class PlannedCases:
    """The planned cases.

    Attributes
    ----------
    cases : tuple[Case, ...]
        In the order in which they were drawn.
    exhausted : bool
        There are no others, so fewer than asked are all there are.
    """

    cases: tuple[Case, ...]
    exhausted: bool


def draw_cases(
    strategy: SearchStrategy[Case], *, seed: str, examples: int, progress: Callable[[int], None] | None = None
) -> PlannedCases:
    """As many different cases as asked, or all there are.

    `progress` is told how many there are. The first is the simplest that the strategy makes; what the strategy
    filters out is not counted.
    """
    cases: list[Case] = []
    stopped: list[str] = []

    @seeded(seed)
    @_settings(examples, Phase.generate)
    @given(strategy)
    def take(case: Case) -> None:
        cases.append(case)
        if progress is not None:
            progress(len(cases))

    statistics: Any = collector  # hypothesis types it as holding None for ever
    with _reproducible(), statistics.with_value(lambda facts: stopped.append(facts.get("stopped-because", ""))):
        try:
            take()
        except Unsatisfiable:  # no case came through the filters: nothing to judge, which the caller sees
            return PlannedCases((), exhausted=False)
    return PlannedCases(tuple(cases), exhausted=stopped == ["nothing left to do"])


def shrink(
    strategy: SearchStrategy[Case],
    *,
    seed: str,
    examples: int,
    first: int,
    fails: Callable[[Case], bool],
    limit: int = SHRINK_CALLS,
) -> None:
    """Ask `fails` about smaller and smaller cases; the last one of which it says True is the smallest found.

    The cases are drawn again as `draw_cases` drew them; those before number `first` are known not to fail and not
    asked again. A formulation that answers differently each time ends this early. So does the limit, which counts
    questions and not seconds, so that a slow machine finds the same case as a fast one.
    """
    drawn = asked = 0

    @seeded(seed)
    @_settings(examples, Phase.generate, Phase.shrink)
    @given(strategy)
    def attempt(case: Case) -> None:
        nonlocal drawn, asked
        drawn += 1
        if drawn <= first:
            return
        asked += 1
        if asked > limit:
            raise _Enough
        try:
            failed = fails(case)
        except Exception as error:
            raise _Trouble(error) from None
        if failed:
            raise _Failed

    with _reproducible():
        try:
            attempt()
        except _Trouble as trouble:
            raise trouble.error from None
        except (_Failed, _Enough, Flaky):
            pass


class _Failed(Exception):
    """What hypothesis takes for the failure; it never leaves this file."""


class _Enough(BaseException):
    """Ends the shrinking; no Exception, or hypothesis would take it for another failure."""


class _Trouble(BaseException):
    """Carries an exception of our own out of hypothesis, which would run the case twice more and add its notes."""

    def __init__(self, error: Exception) -> None:
        self.error = error


def _settings(examples: int, *phases: Phase) -> settings:
    return settings(
        max_examples=examples,
        phases=phases,
        database=None,
        deadline=None,
        derandomize=False,
        verbosity=Verbosity.quiet,
        print_blob=False,
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
        backend="hypothesis",
    )


@contextmanager
def _reproducible() -> Iterator[None]:
    """Keep hypothesis from drawing constants that it found in the source of loaded modules.

    One integer in twenty is otherwise one of the literals of all modules outside site-packages that happen to be
    imported, so that the same seed would mean other cases in pytest than on the command line, and other cases once a
    user edits a file; and the literals are cached in a folder `.hypothesis` wherever one stands. Hypothesis 6.131 to
    6.170 have no setting for it. Where a later one has no such function any more, nothing is done; the test of
    determinism then tells.
    """
    name = "_get_local_constants"
    original = getattr(providers, name, None)
    if original is None:
        yield
        return
    none = Constants()
    setattr(providers, name, lambda: none)
    providers.CONSTANTS_CACHE.cache.clear()
    try:
        yield
    finally:
        setattr(providers, name, original)
        providers.CONSTANTS_CACHE.cache.clear()
