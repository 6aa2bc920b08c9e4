"""The planned cases of a strategy, block by block, and the search for a smaller case that fails.

The planned cases are drawn before one of them is judged, by functions that never fail. So every formulation of a run is
judged on the same cases, and a failure ends nothing early. Hypothesis sees a formulation only while it shrinks.

A block is drawn without the blocks before it, so that a run of a million cases never holds them all. The cases of a
block are different; two blocks may, rarely, have a case in common.

A property may have a strategy for each kind of situation. Then the kinds take turns, so that each gets the same share
of the planned cases.

A property may have a finite list of named cases instead of a strategy. Then all of them are planned, whatever the
number of examples, and none is shrunk: its name says what it is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.run.engine import draw_all, reproducible, shrink_choices, shrink_drawn
from contactverif.run.quick_draws import AVAILABLE, Draw, draw_different

# A strategy, a strategy for each kind of situation, or a finite list of named cases.
CaseSource = SearchStrategy[Case] | Mapping[str, SearchStrategy[Case]] | tuple[Case, ...]

BLOCK = 500  # The number of cases that are drawn, and kept in memory, at a time.
# The largest number of judgements for one counterexample. Hypothesis itself stops after 500 shrinks or 300 s.
SHRINK_CALLS = 2000


@dataclass(frozen=True, slots=True)
class PlannedCases:
    """Some or all of the planned cases of a strategy.

    Attributes
    ----------
    cases : tuple[Case, ...]
        The cases in the order in which they were drawn.
    exhausted : bool
        Whether the strategy has no other cases, so that there may be fewer or more than were asked for.
    last : bool
        Whether no further block follows.
    """

    cases: tuple[Case, ...]
    exhausted: bool
    last: bool = True


def draw_cases(
    source: CaseSource, *, seed: str, examples: int, progress: Callable[[int], None] | None = None
) -> PlannedCases:
    """Draw all planned cases.

    Parameters
    ----------
    source : CaseSource
        The strategy, the strategies by kind, or the finite list. A case that a strategy filters out is not counted.
    seed : str
        The same seed gives the same cases.
    examples : int
        The number of cases. There are fewer if the strategy has fewer.
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
    cases: list[Case] = []
    for number in range(number_of_blocks(examples)):
        block = draw_block(source, seed=seed, examples=examples, number=number, progress=progress)
        cases += block.cases
        if block.last:
            break
    return PlannedCases(tuple(cases), block.exhausted)


def number_of_blocks(examples: int) -> int:
    """Return the number of blocks of so many examples, at least one."""
    return max(1, -(-examples // BLOCK))


def draw_block(
    source: CaseSource, *, seed: str, examples: int, number: int, progress: Callable[[int], None] | None = None
) -> PlannedCases:
    """Draw one block of the planned cases; the parameters of `draw_cases`, and the number of the block from 0.

    Where the harness cannot draw by itself, the first block has all cases.
    """
    if isinstance(source, tuple):
        _check_names([case.name for case in source])
        return PlannedCases(source, exhausted=True)
    report = progress or (lambda _: None)
    past = number * BLOCK
    size = min(BLOCK, examples - past)
    draws = _draw_block(source, seed, number, size, _counted_from(past, report))
    if draws is None:
        return _draw_with_engine(source, seed=seed, examples=examples, progress=report)
    short = len(draws) < size
    return PlannedCases(tuple(draw.case for draw in draws), short, short or past + size == examples)


def draws_blocks(source: CaseSource, *, seed: str, examples: int) -> bool:
    """Return whether a strategy is drawn block by block; otherwise the first block has all cases."""
    return not isinstance(source, tuple) and _block_of(source, seed, examples, 0) is not None


def draw_case(source: CaseSource, *, seed: str, examples: int, number: int) -> Case:
    """Return the case with this number of those of `draw_cases`."""
    if isinstance(source, tuple):
        return source[number]
    draws = _block_of(source, seed, examples, number)
    if draws is None:
        return _draw_with_engine(source, seed=seed, examples=examples, progress=lambda _: None).cases[number]
    return draws[number % BLOCK].case


def _block_of(
    source: SearchStrategy[Case] | Mapping[str, SearchStrategy[Case]], seed: str, examples: int, number: int
) -> list[Draw] | None:
    """Return the block that the case with this number belongs to; None if hypothesis' engine draws it."""
    block = number // BLOCK
    return _draw_block(source, seed, block, min(BLOCK, examples - block * BLOCK), lambda _: None)


def _draw_block(
    source: SearchStrategy[Case] | Mapping[str, SearchStrategy[Case]],
    seed: str,
    number: int,
    size: int,
    progress: Callable[[int], None],
) -> list[Draw] | None:
    """Return the first `size` cases of a block; None if hypothesis' engine must draw all blocks.

    A strategy with few different cases may run out. Only the engine knows whether it has more, so it draws all of them;
    where that shows late, the block is short.
    """
    if not AVAILABLE:
        return None
    strategies = _strategies_in_turn(source)
    streams = [
        draw_different(strategy, seed=f"{seed}/{kind}/{number}", simplest=number == 0) for kind, strategy in strategies
    ]
    draws: list[Draw] = []
    with reproducible():
        for place in range(number * BLOCK, number * BLOCK + size):
            draw = next(streams[place % len(streams)], None)
            if draw is None:
                return None if number == 0 else draws
            draws.append(draw)
            progress(len(draws))
    return draws


def _counted_from(past: int, progress: Callable[[int], None]) -> Callable[[int], None]:
    """Return a progress that also counts the cases of the past."""
    return lambda count: progress(past + count)


def _strategies_in_turn(
    source: SearchStrategy[Case] | Mapping[str, SearchStrategy[Case]],
) -> list[tuple[str, SearchStrategy[Case]]]:
    """Return each kind and its strategy; one without a name if there are no kinds."""
    if isinstance(source, Mapping):
        return [(kind, _strategy_of_kind(source, kind)) for kind in source]
    return [("", source)]


def _draw_with_engine(
    source: SearchStrategy[Case] | Mapping[str, SearchStrategy[Case]],
    *,
    seed: str,
    examples: int,
    progress: Callable[[int], None],
) -> PlannedCases:
    """Return all cases, drawn by hypothesis' engine."""
    if not isinstance(source, Mapping):
        return PlannedCases(*draw_all(source, seed=seed, examples=examples, progress=progress))
    parts = _draw_each_kind(source, seed=seed, examples=examples, progress=progress)
    complete = zip(parts, _shares(source, examples), strict=True)
    return PlannedCases(
        tuple(parts[n].cases[place] for n, place in _deal(parts)),
        exhausted=all(part.exhausted or len(part.cases) == share for part, (_, share) in complete),
    )


def _draw_each_kind(
    strategies: Mapping[str, SearchStrategy[Case]], *, seed: str, examples: int, progress: Callable[[int], None]
) -> list[PlannedCases]:
    """Return the cases of each kind that gets any."""
    parts: list[PlannedCases] = []
    for kind, share in _shares(strategies, examples):
        past = sum(len(part.cases) for part in parts)
        strategy = _strategy_of_kind(strategies, kind)
        report = _counted_from(past, progress)
        part = draw_all(strategy, seed=f"{seed}/{kind}", examples=share, progress=report)
        parts.append(PlannedCases(*part))
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
        The arguments of `draw_cases`, so that the block of the case is drawn again.
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
    draws = _block_of(source, seed, examples, first)
    if draws is not None:
        strategies = _strategies_in_turn(source)
        _, strategy = strategies[first % len(strategies)]
        shrink_choices(strategy, draws[first % BLOCK].stored_choices(), seed=seed, fails=fails, limit=limit)
    elif isinstance(source, Mapping):
        parts = _draw_each_kind(source, seed=seed, examples=examples, progress=lambda _: None)
        n, place = _deal(parts)[first]
        kind, share = _shares(source, examples)[n]
        strategy = _strategy_of_kind(source, kind)
        shrink_drawn(strategy, seed=f"{seed}/{kind}", examples=share, first=place, fails=fails, limit=limit)
    else:
        shrink_drawn(source, seed=seed, examples=examples, first=first, fails=fails, limit=limit)
