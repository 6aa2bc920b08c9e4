"""The use of hypothesis' own engine: it shrinks a case, and draws where `quick_draws.py` cannot.

Rule: the same seed gives the same cases, in pytest and on the command line, from any folder and with any other modules
imported. Therefore every setting is spelled out here (or the settings of a user's own tests would leak in), nothing is
stored, and `reproducible` takes away what depends on the imported modules.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any
from unittest import SkipTest

from hypothesis import HealthCheck, Phase, Verbosity, given, settings
from hypothesis import seed as seeded
from hypothesis.database import ExampleDatabase
from hypothesis.errors import Flaky, Unsatisfiable
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants
from hypothesis.statistics import collector
from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case
from contactverif.run.one_thread import one_thread

Fails = Callable[[Case], bool]


def draw_all(
    strategy: SearchStrategy[Case], *, seed: str, examples: int, progress: Callable[[int], None]
) -> tuple[tuple[Case, ...], bool]:
    """Return different cases, or all cases if the strategy has fewer; and whether there are no others.

    Parameters
    ----------
    strategy : SearchStrategy[Case]
        The strategy.
    seed : str
        The same seed gives the same cases.
    examples : int
        The number of cases.
    progress : Callable[[int], None]
        Called with the number of cases after each.
    """
    cases: list[Case] = []
    stopped: list[str] = []

    @seeded(seed)
    @_settings(examples, Phase.generate)
    @given(strategy)
    def take(case: Case) -> None:
        cases.append(case)
        progress(len(cases))

    statistics: Any = collector  # Hypothesis declares it as None.
    with reproducible(), statistics.with_value(lambda facts: stopped.append(facts.get("stopped-because", ""))):
        try:
            take()
        except Unsatisfiable:  # The strategy filters out every case; the caller sees that there is nothing to judge.
            return (), False
    return tuple(cases), stopped == ["nothing left to do"]


def shrink_choices(strategy: SearchStrategy[Case], choices: bytes, *, seed: str, fails: Fails, limit: int) -> None:
    """Shrink the case that a strategy makes of some choices, as if an earlier run of hypothesis had stored it."""
    stored = _OneFailure(choices)
    _shrink(strategy, _settings(1, Phase.reuse, Phase.shrink, database=stored), 0, seed=seed, fails=fails, limit=limit)


def shrink_drawn(
    strategy: SearchStrategy[Case], *, seed: str, examples: int, first: int, fails: Fails, limit: int
) -> None:
    """Shrink the case with the number `first` of those of `draw_all`. The cases before it are drawn once more."""
    _shrink(strategy, _settings(examples, Phase.generate, Phase.shrink), first, seed=seed, fails=fails, limit=limit)


def _shrink(
    strategy: SearchStrategy[Case], run_settings: settings, first: int, *, seed: str, fails: Fails, limit: int
) -> None:
    n_drawn = n_judged = 0

    @run_settings  # Above the seed, which would take the database away.
    @seeded(seed)
    @given(strategy)
    def attempt(case: Case) -> None:
        nonlocal n_drawn, n_judged
        n_drawn += 1
        if n_drawn <= first:
            return
        n_judged += 1
        if n_judged > limit:
            raise _LimitReached
        try:
            failed = fails(case)
        except Exception as error:
            raise _ForeignError(error) from None
        if failed:
            raise _Failed

    with reproducible():
        try:
            attempt()
        except _ForeignError as carrier:
            raise carrier.error from None
        except (_Failed, _LimitReached, Flaky, SkipTest):
            pass  # Hypothesis skips a test if it could not read the choices; the case stays as large as it is.


class _OneFailure(ExampleDatabase):
    """A database with one failure, which nobody has shrunk. It stores nothing.

    Hypothesis takes what stands under the key itself for shrunk, and reads unshrunk failures under a key of their own.
    """

    def __init__(self, failure: bytes) -> None:
        super().__init__()
        self._failure = failure

    def fetch(self, key: bytes) -> Iterable[bytes]:
        """Yield the failure if the key is that of unshrunk ones."""
        if key.endswith(b".secondary"):
            yield self._failure

    def save(self, key: bytes, value: bytes) -> None:
        """Store nothing."""

    def delete(self, key: bytes, value: bytes) -> None:
        """Delete nothing."""


class _Failed(Exception):
    """The exception that hypothesis takes for the failure. It never leaves this file."""


class _LimitReached(BaseException):
    """The end of the search. It is no Exception, because hypothesis would take that for another failure."""


class _ForeignError(BaseException):
    """A carrier for an exception of `fails`. Hypothesis itself would run the case twice more and add its notes."""

    def __init__(self, error: Exception) -> None:
        self.error = error


def _settings(examples: int, *phases: Phase, database: ExampleDatabase | None = None) -> settings:
    return settings(
        max_examples=examples,
        phases=phases,
        database=database,
        deadline=None,
        derandomize=False,
        verbosity=Verbosity.quiet,
        print_blob=False,
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
        backend="hypothesis",
    )


@contextmanager
def reproducible() -> Iterator[None]:
    """Compute on one thread, and keep hypothesis from drawing constants of the source of imported modules.

    Otherwise one integer in twenty is a literal of some imported module outside site-packages. Then the same seed would
    mean other cases in pytest than on the command line, and other cases once a user edits a file; and hypothesis would
    write the literals to a folder `.hypothesis` in the working folder. Hypothesis 6.131 to 6.170 have no setting for
    it. If a later version lacks the function that is replaced here, nothing is replaced, and the test of determinism
    shows whether that matters.
    """
    name = "_get_local_constants"
    original = getattr(providers, name, None)
    if original is None:
        with one_thread():
            yield
        return
    none = Constants()
    setattr(providers, name, lambda: none)
    providers.CONSTANTS_CACHE.cache.clear()
    try:
        with one_thread():
            yield
    finally:
        setattr(providers, name, original)
        providers.CONSTANTS_CACHE.cache.clear()
