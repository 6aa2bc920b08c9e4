"""Plugins whose pairings are no flat mapping from names to small integers."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from hostile_kit import EITHER, answers

from contactverif.contract.formulation import Pairing

NUMBER_OF_NAMES = 200_000


floats = answers("pair")(
    lambda answer: {**answer, "gap": np.zeros(4)},
    "Answer a pairing that holds real numbers, so that the frozen part of the residual may be the whole.",
)


@answers("pair", ends=EITHER)
def floats_as_integers(answer: Any) -> Any:
    """Answer a pairing that holds real numbers, bit by bit, in booleans."""
    bits = np.unpackbits(np.frombuffer(np.float64(0.1).tobytes(), np.uint8)).astype(bool)
    return {**answer, "bits": bits}


too_large_numbers = answers("pair")(
    lambda answer: {**answer, "number": np.array([2**62])}, "Answer a pairing with numbers that number nothing."
)
huge = answers("pair", ends=EITHER)(
    lambda answer: {**answer, "huge": np.broadcast_to(np.int64(0), 10**9)},
    "Answer a pairing with an array of 1e9 entries that takes no memory.",
)
large = answers("pair")(
    lambda answer: {**answer, "large": np.zeros(25_000_000, np.int64)}, "Answer pairings of 200 MB each."
)
long_name = answers("pair", ends=EITHER)(
    lambda answer: {**answer, "x" * 20_000_000: np.zeros(1, np.int64)}, "Answer a pairing with a name of 20 MB."
)
many_names = answers("pair", ends=EITHER)(
    lambda answer: {**answer, **{f"name {number}": np.zeros(0, np.int64) for number in range(NUMBER_OF_NAMES)}},
    "Answer a pairing with 200,000 names.",
)
names_with_controls = answers("pair", ends=EITHER)(
    lambda answer: {**answer, "\x1b[2J": np.zeros(1, np.int64), "\0": np.zeros(1, bool), "\ud800": np.zeros(1, bool)},
    "Answer a pairing with names that clear the terminal, hold NUL, or cannot be written as UTF-8.",
)
number_as_name = answers("pair")(
    lambda answer: {**answer, 7: np.zeros(1, np.int64)}, "Answer a pairing with a name that is no string."
)


@answers("pair", ends=EITHER)
def string_of_its_own(answer: Any) -> Any:
    """Answer a pairing with a name that has another hash each time."""

    class Name(str):
        __slots__ = ()

        def __hash__(self) -> int:
            return id(object())

    return {**answer, Name("name"): np.zeros(1, np.int64)}


@answers("pair")
def endless_mapping(answer: Any) -> Any:
    """Answer a mapping that always has one more name."""

    class Endless(Mapping[str, Any]):
        def __getitem__(self, name: str) -> Any:
            return np.zeros(2**10, np.int64)

        def __iter__(self) -> Iterator[str]:
            number = 0
            while True:
                number += 1
                yield str(number)

        def __len__(self) -> int:
            return 1

    return Endless()


@answers("pair", ends=EITHER)
def floats_after_the_check(answer: Any) -> Any:
    """Answer a pairing into which floats were put after it had been checked."""
    answer = Pairing(answer)
    answer._arrays["gap"] = np.full(4, np.nan)
    return answer


list_of_arrays = answers("pair")(lambda answer: list(answer.values()), "Answer a list instead of a mapping.")


@answers("pair")
def within_itself(answer: Any) -> Any:
    """Answer a pairing that contains itself."""
    nested: dict[str, Any] = dict(answer)
    nested["itself"] = nested
    return nested
