"""The use of hypothesis: it draws the planned cases of a property, and shrinks a case that fails.

The planned cases are drawn first, all of them, by a function that never fails. So every formulation of a run is judged
on the same cases, and a failure ends nothing early. Hypothesis sees a formulation only while it shrinks.

A property may have a strategy for each kind of situation. Then each kind gets the same share of the planned cases;
hypothesis itself would draw many cases of some kinds and none of others, because it varies what it has drawn before.

A property may have a finite list of named cases instead of a strategy. Then all of them are planned, whatever the
number of examples, and none is shrunk: its name says what it is.

Rule: the same seed gives the same cases, in pytest and on the command line, from any folder and with any other modules
imported. Therefore every setting is spelled out here (or the settings of a user's own tests would leak in), nothing is
stored, and `_reproducible` takes away what depends on the imported modules.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from hypothesis import HealthCheck, Phase, Verbosity, given, settings
from hypothesis import seed as seeded
from hypothesis.errors import Flaky, Unsatisfiable
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants
from hypothesis.statistics import collector
from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError

# A strategy, a strategy for each kind of situation, or a finite list of named cases.
CaseSource = SearchStrategy[Case] | Mapping[str, SearchStrategy[Case]] | tuple[Case, ...]

# The largest number of judgements for one counterexample. Hypothesis itself stops after 500 shrinks or 300 s.
SHRINK_CALLS = 2000


@dataclass(frozen=True, slots=True)
class PlannedCases:
    """The planned cases of a property.

    Attributes
    ----------
    cases : tuple[Case, ...]
        The cases in the order in which they were drawn.
    exhausted : bool
        Whether there are no other cases, so that there may be fewer or more than were asked for.
    """

    cases: tuple[Case, ...]
    exhausted: bool


def draw_cases(
    source: CaseSource, *, seed: str, examples: int, progress: Callable[[int], None] | None = None
) -> PlannedCases:
    """Draw different cases, or all cases if the strategy has fewer, or return the cases of a finite list.

    Parameters
    ----------
    source : CaseSource
        The strategy, the strategies by kind, or the finite list. A case that a strategy filters out is not counted.
    seed : str
        The same seed gives the same cases.
    examples : int
        The number of cases.
    progress : Callable[[int], None] | None
        Called with the number of cases after each.

    Returns
    -------
    PlannedCases
        The cases; the first is the simplest that the strategy makes. Kinds follow one another in turn.

    Raises
    ------
    MisuseError
        If a case of a finite list has no name, or two have the same.
    """
    if isinstance(source, tuple):
        _check_names([case.name for case in source])
        return PlannedCases(source, exhausted=True)
    if isinstance(source, Mapping):
        parts = _draw_each_kind(source, seed=seed, examples=examples, progress=progress or (lambda _: None))
        complete = zip(parts, _shares(source, examples), strict=True)
        return PlannedCases(
            tuple(parts[n].cases[place] for n, place in _deal(parts)),
            exhausted=all(part.exhausted or len(part.cases) == share for part, (_, share) in complete),
        )
    cases: list[Case] = []
    stopped: list[str] = []

    @seeded(seed)
    @_settings(examples, Phase.generate)
    @given(source)
    def take(case: Case) -> None:
        cases.append(case)
        if progress is not None:
            progress(len(cases))

    statistics: Any = collector  # Hypothesis declares it as None.
    with _reproducible(), statistics.with_value(lambda facts: stopped.append(facts.get("stopped-because", ""))):
        try:
            take()
        except Unsatisfiable:  # The strategy filters out every case; the caller sees that there is nothing to judge.
            return PlannedCases((), exhausted=False)
    return PlannedCases(tuple(cases), exhausted=stopped == ["nothing left to do"])


def _draw_each_kind(
    strategies: Mapping[str, SearchStrategy[Case]], *, seed: str, examples: int, progress: Callable[[int], None]
) -> list[PlannedCases]:
    """Return the cases of each kind that gets any."""
    parts = []
    for kind, share in _shares(strategies, examples):
        parts.append(draw_cases(_strategy_of_kind(strategies, kind), seed=f"{seed}/{kind}", examples=share))
        progress(sum(len(part.cases) for part in parts))
    return parts


def _deal(parts: Sequence[PlannedCases]) -> list[tuple[int, int]]:
    """Return (part, place in it) of all cases in the order of a run: the first of each part, then the second, ….

    So the first cases of a run are of all kinds.
    """
    most = max((len(part.cases) for part in parts), default=0)
    return [(n, place) for place in range(most) for n, part in enumerate(parts) if place < len(part.cases)]


def _strategy_of_kind(strategies: Mapping[str, SearchStrategy[Case]], kind: str) -> SearchStrategy[Case]:
    """Return the strategy of a kind; a case that names no kind gets this one."""
    return strategies[kind].map(lambda case: case if case.kind else replace(case, kind=kind))


def _shares(kinds: Mapping[str, object], examples: int) -> list[tuple[str, int]]:
    """Return each kind with its number of cases, equal up to one; kinds that get none are left out."""
    least, more = divmod(examples, len(kinds))
    shares = [(kind, least + (place < more)) for place, kind in enumerate(kinds)]
    return [(kind, share) for kind, share in shares if share]


def _check_names(names: list[str]) -> None:
    """Check that each case of a finite list can be told from the others by its name."""
    for name, times in Counter(names).items():
        if not name or times > 1:
            actual = f"{times} times {name!r}" if name else "a case without a name"
            raise MisuseError("cases", actual, "a finite list whose cases have a name each, all different")


def shrink(
    source: CaseSource,
    *,
    seed: str,
    examples: int,
    first: int,
    fails: Callable[[Case], bool],
    limit: int = SHRINK_CALLS,
) -> None:
    """Call `fails` with smaller and smaller cases; the last case for which it returns True is the smallest.

    A formulation that answers differently each time ends the search early. Of a finite list nothing is smaller. A case
    of a kind is shrunk to another one of its kind.

    Parameters
    ----------
    source : CaseSource
        The source of the planned cases.
    seed, examples : str or int
        The arguments of `draw_cases`, so that the same cases are drawn again.
    first : int
        The number of the first case that fails. The cases before it are not judged again.
    fails : Callable[[Case], bool]
        The judgement of a case.
    limit : int
        The largest number of judgements. It counts calls and not seconds, so that a slow machine ends at the same case
        as a fast one.

    Raises
    ------
    Exception
        If `fails` raises it.
    """
    if isinstance(source, tuple):
        return
    if isinstance(source, Mapping):
        parts = _draw_each_kind(source, seed=seed, examples=examples, progress=lambda _: None)
        number, place = _deal(parts)[first]
        kind, share = _shares(source, examples)[number]
        strategy = _strategy_of_kind(source, kind)
        shrink(strategy, seed=f"{seed}/{kind}", examples=share, first=place, fails=fails, limit=limit)
        return
    n_drawn = n_judged = 0

    @seeded(seed)
    @_settings(examples, Phase.generate, Phase.shrink)
    @given(source)
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

    with _reproducible():
        try:
            attempt()
        except _ForeignError as carrier:
            raise carrier.error from None
        except (_Failed, _LimitReached, Flaky):
            pass


class _Failed(Exception):
    """The exception that hypothesis takes for the failure. It never leaves this file."""


class _LimitReached(BaseException):
    """The end of the search. It is no Exception, because hypothesis would take that for another failure."""


class _ForeignError(BaseException):
    """A carrier for an exception of `fails`. Hypothesis itself would run the case twice more and add its notes."""

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
    """Keep hypothesis from drawing constants that stand in the source of imported modules.

    Otherwise one integer in twenty is a literal of some imported module outside site-packages. Then the same seed would
    mean other cases in pytest than on the command line, and other cases once a user edits a file; and hypothesis would
    write the literals to a folder `.hypothesis` in the working folder. Hypothesis 6.131 to 6.170 have no setting for
    it. If a later version lacks the function that is replaced here, nothing is replaced, and the test of determinism
    shows whether that matters.
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
