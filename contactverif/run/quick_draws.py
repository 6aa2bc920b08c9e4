"""Cases drawn straight from a strategy, without hypothesis' engine, which takes longer than the strategy itself.

The engine looks for failures among the cases that it makes: it keeps a tree of all choices, and varies what it made
before. The harness draws all cases before one is judged, so it needs none of that. Here a case is what a strategy makes
of random choices, which are kept: hypothesis shrinks a case from its choices alone.

Rule for the next editor: this file alone knows the inside of hypothesis' test cases, and `AVAILABLE` says whether this
version has it. Where it has not, and where a strategy makes few different cases, the engine draws (`engine.py`).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from random import Random
from typing import Any

from hypothesis.errors import StopTest, UnsatisfiedAssumption
from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case

try:
    from hypothesis.control import BuildContext
    from hypothesis.database import choices_to_bytes
    from hypothesis.internal.conjecture.choice import ChoiceTemplate
    from hypothesis.internal.conjecture.data import ConjectureData
except ImportError:  # pragma: no cover
    AVAILABLE = False
else:
    AVAILABLE = True

PATIENCE = 100  # The number of choices in a row that make no new case before a strategy counts as having no other.
# The probabilities with which a case repeats an integer, and with which it makes the simplest choice. Each case has one
# of these pairs. Some errors show only where lengths, slopes or depths are equal, others best in a small mesh.
# Hypothesis' engine, too, makes such cases on purpose.
HABITS = ((0.0, 0.0), (0.0, 0.0), (0.5, 0.0), (0.9, 0.0), (0.0, 0.5))
_NARROW = 2**10  # The widest range of integers from which each is drawn as often as any other.
_DEEPEST = 100  # The depth at which hypothesis, too, gives up a strategy that contains itself.


@dataclass(frozen=True, slots=True)
class Draw:
    """A case and the choices it was made of.

    Attributes
    ----------
    case : Case
        The case.
    choices : tuple[Any, ...]
        The choices in order: integers, booleans, floats, texts and bytes.
    """

    case: Case
    choices: tuple[Any, ...]

    def stored_choices(self) -> bytes:
        """Return the choices as hypothesis stores them."""
        return choices_to_bytes(self.choices)


def draw_different(strategy: SearchStrategy[Case], *, seed: str, simplest: bool) -> Iterator[Draw]:
    """Yield different cases; end when the strategy seems to have no other.

    Parameters
    ----------
    strategy : SearchStrategy[Case]
        The strategy. What it filters out is not yielded.
    seed : str
        The same seed gives the same cases.
    simplest : bool
        Begin with the simplest case that the strategy makes.
    """
    past: set[tuple[Any, ...]] = set()
    if simplest:
        data = ConjectureData(random=None, prefix=(ChoiceTemplate("simplest", count=None),))
        yield from _draw_new(strategy, data, past)
    random, checked = Random(seed), dict[int, Any]()
    in_vain = 0
    while in_vain < PATIENCE:
        in_vain += 1
        for draw in _draw_new(strategy, _RandomChoices(random, checked), past):
            in_vain = 0
            yield draw


def _draw_new(strategy: SearchStrategy[Case], data: Any, past: set[tuple[Any, ...]]) -> Iterator[Draw]:
    """Yield the case that a strategy makes of some choices, unless it filters it out or has made it in the past."""
    try:
        with _Context(data, is_final=False, wrapped_test=draw_different):
            case = data.draw(strategy)
    except (StopTest, UnsatisfiedAssumption):
        return
    choices = data.choices
    if choices not in past:
        past.add(choices)
        yield Draw(case, choices)


_NO_LABELS = nullcontext(dict[str, int]())

if AVAILABLE:

    class _Context(BuildContext):
        """The test that strategies draw for. It remembers nothing, because no case is described in words."""

        def record_call(self, *_: Any, **__: Any) -> None:
            """Forget how an object was made."""

    class _RandomChoices(ConjectureData):
        """Random choices. All integers of a narrow range are equally probable; hypothesis draws everything else.

        Parameters
        ----------
        random : Random
            The source of randomness.
        checked : dict[int, Any]
            The strategies that are known to be valid, by their identity. It grows.
        """

        def __init__(self, random: Random, checked: dict[int, Any]) -> None:
            super().__init__(random=random)
            self._choices: list[Any] = []
            self._between_0_and_1 = random.random
            self._p_repeat, self._p_simple = random.choice(HABITS)
            self._past: dict[tuple[int, int], int] = {}
            self._checked = checked

        @property
        def choices(self) -> tuple[Any, ...]:
            """The choices in order, also those that a strategy forced."""
            return tuple(self._choices)

        def draw(self, strategy: Any, label: int | None = None, observe_as: str | None = None) -> Any:
            """Draw from a strategy, without a record of which choices belong to it."""
            if id(strategy) not in self._checked:
                strategy.validate()
                if not strategy.is_empty:
                    self._checked[id(strategy)] = strategy
            if self.depth > _DEEPEST or id(strategy) not in self._checked:
                self.mark_invalid()
            self.depth += 1
            try:
                return strategy.do_draw(self)
            finally:
                self.depth -= 1

        def start_span(self, label: int) -> None:
            """Count the depth alone."""
            self.depth += 1

        def stop_span(self, *, discard: bool = False) -> None:
            """Count the depth alone."""
            self.depth -= 1

        def track_arg_label(self, label: str) -> Any:
            """Record nothing."""
            return _NO_LABELS

        def draw_boolean(self, p: float = 0.5, *, forced: bool | None = None, observe: bool = True) -> bool:
            """Return True with probability p."""
            if forced is not None:
                value = forced
            elif self._p_simple and p < 1 and self._between_0_and_1() < self._p_simple:
                value = False
            else:
                value = self._between_0_and_1() < p
            if observe:
                self._choices.append(value)
            return value

        def draw_integer(
            self,
            min_value: int | None = None,
            max_value: int | None = None,
            *,
            weights: dict[int, float] | None = None,
            shrink_towards: int = 0,
            forced: int | None = None,
            observe: bool = True,
        ) -> int:
            """Return an integer of a range."""
            if forced is not None:
                value = forced
            elif min_value is None or max_value is None or max_value - min_value >= _NARROW or weights is not None:
                value = self.provider.draw_integer(min_value, max_value, weights=weights, shrink_towards=shrink_towards)
            else:
                value = self._draw_narrow(min_value, max_value, shrink_towards)
            if observe:
                self._choices.append(value)
            return value

        def _draw_narrow(self, least: int, most: int, simplest: int) -> int:
            """Return an integer of a narrow range: any, the last one from this range, or the simplest."""
            range_ = least, most
            if self._p_repeat and range_ in self._past and self._between_0_and_1() < self._p_repeat:
                return self._past[range_]
            if self._p_simple and self._between_0_and_1() < self._p_simple:
                return min(max(simplest, least), most)
            value = least + int(self._between_0_and_1() * (most - least + 1))
            self._past[range_] = value
            return value

        def _draw(self, choice_type: Any, constraints: Any, *, observe: bool, forced: Any) -> Any:
            """Return a float, a text or bytes."""
            value = forced
            if forced is None:
                value = getattr(self.provider, f"draw_{choice_type}")(**constraints)
            if observe:
                self._choices.append(value)
            return value
