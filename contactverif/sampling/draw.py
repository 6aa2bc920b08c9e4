"""The planned cases of a run: drawn block by block before one of them is judged, and shrunk where one fails.

The cases of a property depend on the seed of the run and on its strategy alone. So the choice of properties and
formulations, their order and the number of processes change no case, and properties with the same strategy have the
same cases. A block is drawn without the blocks before it, so that a run of a million cases never holds them all. The
cases of a block are different; two blocks may, rarely, have a case in common.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Self, cast

from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case, name_of_source
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE, Interface
from contactverif.contract.property import Outcome, Property
from contactverif.sampling import hypothesis_draws

# A strategy, or a strategy for each kind of situation: the kinds take turns, so that each gets the same share.
RandomSource = SearchStrategy[Case] | Mapping[str, SearchStrategy[Case]]
# Or a finite list of named cases: all of them are planned, whatever the number of examples, and none is shrunk.
CaseSource = RandomSource | tuple[Case, ...]

BLOCK = 500  # The number of cases that are drawn, and kept in memory, at a time.
# The largest number of judgements for one counterexample. It counts calls and not seconds, so that a slow machine ends
# at the same case as a fast one. Hypothesis itself stops after 500 shrinks or 300 s.
SHRINK_CALLS = 2000


@dataclass(frozen=True, slots=True)
class Sampling:
    """The size and the seed of a run, and the place where it asks."""

    examples: int  # The number of cases of each property.
    seed: int
    interface: Interface | None = None  # The interface on which everything is checked; None for random ones.
    scene: Case | None = None  # The scene on which bodies are checked; None for random ones.

    @classmethod
    def at(cls, place: Interface | Case | None, examples: int, seed: int) -> Self:
        """Return the sampling on an interface, on a scene, or on random ones."""
        return cls(examples, seed, place.interface, place) if isinstance(place, Case) else cls(examples, seed, place)

    def source(self, question: Property) -> CaseSource | None:
        """Return the source of the cases; None if the property cannot be checked on this interface or scene."""
        if self.interface is not None:
            in_space = question.cases is question.cases_in_space
            if in_space is (self.interface.dim == PLANE) or (question.bodies and self.scene is None):
                return None
        with hypothesis_draws.one_thread():
            return cast("CaseSource | None", question.cases(self.scene if question.bodies else self.interface))

    def key(self, question: Property) -> str:
        """Return the seed of the cases of a property, which properties with the same strategy have in common."""
        return f"{self.seed}/{strategy_name(question)}"

    def plan(self, question: Property) -> tuple[CaseSource, str, int]:
        """Return what the cases of a property follow from, one that can be checked: their source, seed and number."""
        source = self.source(question)
        assert source is not None
        return source, self.key(question), self.examples

    def group(self, question: Property) -> tuple[str, bool]:
        """Return what properties have in common if their cases are the same: the seed, and what makes them."""
        return self.key(question), question.bodies


def strategy_name(question: Property) -> str:
    """Return the stored name of the strategy of a property (`random_source`), or else the id of the property.

    A run draws the cases of a name once, and those in space are others.
    """
    space = question.cases_in_space
    in_space = f" in space{space.on_which_faces}" if space is not None and question.cases is space else ""
    return name_of_source(question.cases) or f"{question.id}{in_space}"


@dataclass(frozen=True, slots=True)
class PlannedCases:
    """Some or all of the planned cases of a strategy, in the order in which they were drawn."""

    cases: tuple[Case, ...]
    exhausted: bool  # The strategy has no other cases, so there may be fewer or more than were wanted.
    last: bool = True  # No further block follows.


def why_the_engine_draws() -> str:
    """Return why hypothesis' engine draws all cases, or an empty string: usually it draws those of few strategies."""
    difference = hypothesis_draws.find_difference()
    return f"{difference}, so its engine drew all cases" if difference else ""


def number_of_blocks(examples: int) -> int:
    """Return the number of blocks of so many examples, at least one."""
    return max(1, -(-examples // BLOCK))


def draw_block(
    source: CaseSource, seed: str, examples: int, *, number: int, progress: Callable[[int], None] | None = None
) -> PlannedCases:
    """Draw one block of the planned cases, numbered from 0. Where the engine draws, the first block has all cases."""
    if isinstance(source, tuple):
        check_names(source)
        return PlannedCases(source, exhausted=True)
    draws = _draw_block(source, seed, examples, number, progress)
    if draws is None:
        return _draw_with_engine(source, seed, examples, progress)
    end = number * BLOCK + len(draws)
    short = end < min(examples, (number + 1) * BLOCK)
    return PlannedCases(tuple(draw.case for draw in draws), short, short or end == examples)


def draw_first(source: CaseSource, seed: str, count: int) -> tuple[Case, ...]:
    """Return so many of the first planned cases; none of a finite list, or where hypothesis' engine draws."""
    draws = None if isinstance(source, tuple) else _draw_block(source, seed, count, 0)
    return tuple(draw.case for draw in draws or ())


def draws_blocks(source: CaseSource, seed: str, examples: int) -> bool:
    """Return whether cases are drawn block by block; otherwise the first block has all cases."""
    return not isinstance(source, tuple) and _draw_block(source, seed, examples, 0) is not None


def draw_case(source: CaseSource, seed: str, examples: int, *, number: int) -> Case:
    """Return the case with this number among those of all blocks."""
    if isinstance(source, tuple):
        return source[number]
    draws = _draw_block(source, seed, examples, number // BLOCK)
    return _draw_with_engine(source, seed, examples).cases[number] if draws is None else draws[number % BLOCK].case


def with_case(sampling: Sampling, question: Property, number: int, outcome: Outcome) -> Outcome:
    """Return the outcome with this number in its row with its case, which is drawn once more if it was not kept."""
    if isinstance(outcome.case_or_summary, Case):
        return outcome
    return replace(outcome, case_or_summary=draw_case(*sampling.plan(question), number=number))


def shrink(source: CaseSource, seed: str, examples: int, *, first: int, fails: Callable[[Case], bool]) -> None:
    """Call `fails` with smaller and smaller cases; the last case for which it returns True is the smallest.

    `first` is the number of the first case that fails. The cases before it are not judged again. A formulation that
    answers differently each time ends the search early. A case of a kind is shrunk to another one of its kind.
    """
    if isinstance(source, tuple):
        return
    draws = _draw_block(source, seed, examples, first // BLOCK)
    if draws is not None:
        strategies = _strategies_in_turn(source)
        _, strategy = strategies[first % len(strategies)]
        choices = draws[first % BLOCK].stored_choices()
        hypothesis_draws.shrink_case(strategy, seed=seed, fails=fails, limit=SHRINK_CALLS, choices=choices)
        return
    parts, n, place = _parts(source, seed, examples), 0, first
    if len(parts) > 1:
        n, place = _deal([hypothesis_draws.draw_all(*part)[0] for part in parts])[first]
    strategy, own_seed, share = parts[n]
    hypothesis_draws.shrink_case(strategy, seed=own_seed, fails=fails, limit=SHRINK_CALLS, examples=share, first=place)


def check_names(cases: Sequence[Case]) -> None:
    """Check that each case of a finite list can be told from the others by its name."""
    for name, times in Counter(case.name for case in cases).items():
        if not name or times > 1:
            actual = f"{times} times {name!r}" if name else "a case without a name"
            raise MisuseError("cases", actual, "a finite list whose cases have a name each, all different")


def _draw_block(
    source: RandomSource, seed: str, examples: int, number: int, progress: Callable[[int], None] | None = None
) -> list[hypothesis_draws.Draw] | None:
    """Return the cases of a block; None if hypothesis' engine must draw all blocks.

    A strategy with few different cases may run out. Only the engine knows whether it has more, so it draws all of them;
    where that shows late, the block is short.
    """
    if hypothesis_draws.find_difference():
        return None
    streams = [
        hypothesis_draws.draw_different(strategy, seed=f"{seed}/{kind}/{number}", simplest=number == 0)
        for kind, strategy in _strategies_in_turn(source)
    ]
    draws: list[hypothesis_draws.Draw] = []
    with hypothesis_draws.reproducible():
        for place in range(number * BLOCK, min(examples, (number + 1) * BLOCK)):
            draw = next(streams[place % len(streams)], None)
            if draw is None:
                return None if number == 0 else draws
            draws.append(draw)
            if progress:
                progress(place + 1)
    return draws


def _strategies_in_turn(source: RandomSource) -> list[tuple[str, SearchStrategy[Case]]]:
    """Return each kind and its strategy; one without a name if there are no kinds. A case without a kind gets its."""

    def name_kind(kind: str, case: Case) -> Case:
        return case if case.kind else replace(case, kind=kind)

    if isinstance(source, Mapping):
        return [(kind, strategy.map(partial(name_kind, kind))) for kind, strategy in source.items()]
    return [("", source)]


def _parts(source: RandomSource, seed: str, examples: int) -> list[tuple[SearchStrategy[Case], str, int]]:
    """Return the strategy of each kind, its seed, and its number of cases, equal up to one, for hypothesis' engine."""
    kinds = _strategies_in_turn(source)
    least, more = divmod(examples, len(kinds))
    parts = [
        (strategy, f"{seed}/{kind}" if kind else seed, least + (place < more))
        for place, (kind, strategy) in enumerate(kinds)
    ]
    return [part for part in parts if part[2]]


def _draw_with_engine(
    source: RandomSource, seed: str, examples: int, progress: Callable[[int], None] | None = None
) -> PlannedCases:
    cases: list[tuple[Case, ...]] = []
    complete = True
    for strategy, own_seed, share in _parts(source, seed, examples):
        part, exhausted = hypothesis_draws.draw_all(strategy, own_seed, share, progress, sum(map(len, cases)))
        cases.append(part)
        complete &= exhausted or len(part) == share
    return PlannedCases(tuple(cases[n][place] for n, place in _deal(cases)), complete)


def _deal(parts: Sequence[tuple[Case, ...]]) -> list[tuple[int, int]]:
    """Return (part, place in it) of all cases in the order of a run: the first of each part, then the second, ….

    So the first cases of a run are of all kinds.
    """
    most = max(map(len, parts), default=0)
    return [(n, place) for place in range(most) for n, part in enumerate(parts) if place < len(part)]
