"""Cases drawn with hypothesis, and shrunk by it. The same seed gives the same, from any folder, with any other modules.

The engine of hypothesis looks for failures among the cases that it makes, which takes longer than to make them. The
harness draws all cases before one is judged, so `draw_different` draws straight from the strategy and keeps the choices
of each case: hypothesis shrinks a case from its choices alone. It knows the inside of hypothesis' test cases, which may
change. So it is compared with stored draws first (`find_difference`). Where they differ, and where a strategy makes few
different cases, the engine draws.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from itertools import islice
from random import Random
from typing import Any
from unittest import SkipTest

import hypothesis
from hypothesis import HealthCheck, Phase, Verbosity, given, settings
from hypothesis import seed as seeded
from hypothesis import strategies as st
from hypothesis.database import ExampleDatabase
from hypothesis.errors import Flaky, StopTest, Unsatisfiable, UnsatisfiedAssumption
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants
from hypothesis.statistics import collector
from hypothesis.strategies import SearchStrategy
from threadpoolctl import ThreadpoolController

from contactverif.contract.case import Case


def one_thread() -> AbstractContextManager[Any]:
    """Return a context in which numpy and scipy compute on one thread, to judge cases and to make them.

    The matrices of a case are small: threads of BLAS that share one wait for each other longer than they compute. One
    thread also gives the same last bit on any number of cores. Exact solutions are solved once and remembered, so what
    makes a case needs one thread, too.
    """
    context: AbstractContextManager[Any] = _blas().limit(limits=1, user_api="blas")
    return context


@cache  # To look for the libraries that are loaded takes some milliseconds.
def _blas() -> Any:
    import_module("scipy.linalg")  # It brings a BLAS of its own, which would not be found later.
    return ThreadpoolController()


try:
    from hypothesis.control import BuildContext
    from hypothesis.database import choices_to_bytes
    from hypothesis.internal.conjecture.choice import ChoiceTemplate
    from hypothesis.internal.conjecture.data import ConjectureData
    from hypothesis.strategies._internal.lazy import LazyStrategy
except ImportError:  # pragma: no cover  # `find_difference` says so.
    BuildContext = ConjectureData = LazyStrategy = object  # type: ignore[assignment, misc]

PATIENCE = 100  # The number of choices in a row that make no new case before a strategy counts as having no other.
# The probabilities with which a case repeats an integer, and with which it makes the simplest choice. Each case has one
# of these pairs: some errors show only where lengths, slopes or depths are equal, others best in a small mesh.
# Hypothesis' engine, too, makes such cases on purpose.
REPEAT_AND_SIMPLE = ((0.0, 0.0), (0.0, 0.0), (0.5, 0.0), (0.9, 0.0), (0.0, 0.5))
_NARROW = 2**10  # The widest range of integers from which each is drawn as often as any other.
_DEEPEST = 100  # The depth at which hypothesis, too, gives up a strategy that contains itself.
_PARTS = st.tuples(  # What strategies of cases are made of, but for integers of a wide range: hypothesis draws those.
    st.integers(-3, 4),
    st.lists(st.integers(0, 5), min_size=1, max_size=3, unique=True),
    st.one_of(st.just("a"), st.booleans(), st.sampled_from([2.0, 3.0])).filter(lambda item: item != 3.0),
)
_STORED_PARTS = [
    (0, [0], "a"),
    (0, [4, 1], "a"),
    (0, [3], "a"),
    (0, [4], "a"),
    (0, [5], 2.0),
    (0, [5], "a"),
    (4, [5], 2.0),
    (-3, [2, 5, 3], True),
    (2, [2, 3], False),
    (4, [4, 0, 3], 2.0),
    (2, [5, 1, 4], 2.0),
    (0, [0], False),
]


@dataclass(frozen=True, slots=True)
class Draw:
    """A case and the choices it was made of, in order: integers, booleans, floats, texts and bytes."""

    case: Case
    choices: tuple[Any, ...]

    def stored_choices(self) -> bytes:
        """Return the choices as hypothesis stores them."""
        return choices_to_bytes(self.choices)


@cache
def find_difference() -> str:
    """Return what differs if this version of hypothesis draws otherwise than the one whose draws are stored.

    Its own engine must make the same of the choices, too.
    """
    version = f"hypothesis {hypothesis.__version__}"
    try:
        with reproducible():
            parts, wide = (_draw_some(strategy) for strategy in (_PARTS, st.tuples(_PARTS, st.integers(0, 10**6))))
    except Exception as error:  # The inside of hypothesis is another one.
        return f"{version} has another inside ({type(error).__name__})"
    return "" if parts == _STORED_PARTS and wide else f"{version} draws otherwise"


def _draw_some(strategy: Any) -> list[Any]:
    """Return some draws of a strategy; none if hypothesis makes something else of their choices."""
    draws = [*islice(draw_different(strategy, seed="1", simplest=True), len(_STORED_PARTS))]
    again = [next(_draw_new(strategy, ConjectureData.for_choices(draw.choices), set())) for draw in draws]
    return [draw.case for draw in draws] if again == draws else []


def draw_different(strategy: SearchStrategy[Case], *, seed: str, simplest: bool) -> Iterator[Draw]:
    """Yield different cases, with `simplest` the simplest first; end when the strategy seems to have no other."""
    past, random, checked, in_vain = set[tuple[Any, ...]](), Random(seed), dict[int, Any](), 0
    if simplest:
        data = ConjectureData(random=None, prefix=(ChoiceTemplate("simplest", count=None),))
        yield from _draw_new(strategy, data, past)
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


class _Context(BuildContext):
    """The test that strategies draw for. It remembers nothing, because no case is described in words."""

    def record_call(self, *_: Any, **__: Any) -> None:
        pass


class _RandomChoices(ConjectureData):
    """Random choices. All integers of a narrow range are equally probable; hypothesis draws everything else.

    `checked` has the strategies that are known to be valid, by their identity, and what they are made of. It grows.
    """

    def __init__(self, random: Random, checked: dict[int, Any]) -> None:
        super().__init__(random=random)
        self._choices: list[Any] = []
        self._between_0_and_1 = random.random
        self._p_repeat, self._p_simple = random.choice(REPEAT_AND_SIMPLE)
        self._past: dict[tuple[int, int], int] = {}
        self._checked = checked

    @property
    def choices(self) -> tuple[Any, ...]:
        """The choices in order, also those that a strategy forced."""
        return tuple(self._choices)

    def draw(self, strategy: Any, label: int | None = None, observe_as: str | None = None) -> Any:
        checked = self._checked.get(id(strategy))
        if checked is None:
            strategy.validate()
            if strategy.is_empty:
                self.mark_invalid()
            inner = strategy
            while isinstance(inner, LazyStrategy):
                inner = inner.wrapped_strategy
            checked = self._checked[id(strategy)] = strategy, inner
        if self.depth > _DEEPEST:
            self.mark_invalid()
        self.depth += 1
        try:
            return checked[1].do_draw(self)
        finally:
            self.depth -= 1

    # It records neither spans nor labels.
    def start_span(self, label: int) -> None:
        self.depth += 1

    def stop_span(self, *, discard: bool = False) -> None:
        self.depth -= 1

    def track_arg_label(self, label: str) -> Any:
        return _NO_LABELS

    def draw_boolean(self, p: float = 0.5, *, forced: bool | None = None, observe: bool = True) -> bool:
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
        range_ = least, most
        if self._p_repeat and range_ in self._past and self._between_0_and_1() < self._p_repeat:
            return self._past[range_]
        if self._p_simple and self._between_0_and_1() < self._p_simple:
            return min(max(simplest, least), most)
        value = least + int(self._between_0_and_1() * (most - least + 1))
        self._past[range_] = value
        return value

    def _draw(self, choice_type: Any, constraints: Any, *, observe: bool, forced: Any) -> Any:  # Float, text or bytes.
        value = getattr(self.provider, f"draw_{choice_type}")(**constraints) if forced is None else forced
        if observe:
            self._choices.append(value)
        return value


def draw_all(
    strategy: SearchStrategy[Case],
    seed: str,
    examples: int,
    progress: Callable[[int], None] | None = None,
    past: int = 0,
) -> tuple[tuple[Case, ...], bool]:
    """Return different cases that the engine draws, and whether the strategy has no others; it may have fewer.

    The progress counts the cases of the past, too.
    """
    cases: list[Case] = []
    stopped: list[str] = []

    @seeded(seed)
    @_settings(examples, Phase.generate)
    @given(strategy)
    def take(case: Case) -> None:
        cases.append(case)
        if progress:
            progress(past + len(cases))

    statistics: Any = collector  # Hypothesis declares it as None.
    with reproducible(), statistics.with_value(lambda facts: stopped.append(facts.get("stopped-because", ""))):
        try:
            take()
        except Unsatisfiable:  # The strategy filters out every case; the caller sees that there is nothing to judge.
            return (), False
    return tuple(cases), stopped == ["nothing left to do"]


def shrink_case(
    strategy: SearchStrategy[Case],
    *,
    seed: str,
    fails: Callable[[Case], bool],
    limit: int,
    choices: bytes = b"",
    examples: int = 1,
    first: int = 0,
) -> None:
    """Shrink the case that a strategy makes of some choices, as if an earlier run of hypothesis had stored it.

    Without choices, shrink the case with the number `first` of those of `draw_all`: those before it are drawn again.
    """
    run_settings = _settings(examples, Phase.generate, Phase.shrink)
    if choices:
        run_settings = _settings(1, Phase.reuse, Phase.shrink, database=_OneFailure(choices))
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
        except Exception as error:  # Hypothesis would take it for the failure that it shrinks.
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
    """A database with one failure that is not shrunk. It stores nothing.

    Hypothesis takes what stands under the key itself for shrunk, and reads unshrunk failures under a key of their own.
    """

    def __init__(self, failure: bytes) -> None:
        super().__init__()
        self._failure = failure

    def fetch(self, key: bytes) -> Iterable[bytes]:
        if key.endswith(b".secondary"):
            yield self._failure

    def save(self, key: bytes, value: bytes) -> None:
        pass

    def delete(self, key: bytes, value: bytes) -> None:
        pass


class _Failed(Exception):
    """The exception that hypothesis takes for the failure. It never leaves this file."""


class _LimitReached(BaseException):
    """The end of the search. It is no Exception, because hypothesis would take that for another failure."""


class _ForeignError(BaseException):
    """A carrier for an exception of `fails`. Hypothesis itself would run the case twice more and add its notes."""

    def __init__(self, error: Exception) -> None:
        self.error = error


def _settings(examples: int, *phases: Phase, database: ExampleDatabase | None = None) -> settings:
    """Return settings in which everything is spelled out, or those of a user's own tests would leak in."""
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
    name, none = "_get_local_constants", Constants()
    original = getattr(providers, name, None)
    with one_thread():
        if original is None:
            yield
            return
        setattr(providers, name, lambda: none)
        providers.CONSTANTS_CACHE.cache.clear()
        try:
            yield
        finally:
            setattr(providers, name, original)
            providers.CONSTANTS_CACHE.cache.clear()
