"""Plugins whose answers are wrong in kind: shape, dtype, NaN, indices, or objects that only look like arrays."""

import itertools
import os
import threading
import time
from typing import Any

import numpy as np
from hostile_kit import CAUGHT, EITHER, LIKE_NTS, answers, instead
from scipy import sparse
from scipy.sparse.linalg import aslinearoperator

_calls = itertools.count(1)
_keepsakes: list[Any] = []


nan = answers("residual")(lambda answer: answer * np.nan, "Answer NaN.")


@answers("residual")
def one_infinity(answer: Any) -> Any:
    """Answer one infinite force."""
    answer[-1] = np.inf
    return answer


wrong_shape = answers("residual")(lambda answer: answer[:-1], "Answer with one entry too few.")
column = answers("residual")(lambda answer: answer[:, None], "Answer a column, which broadcasts to a matrix.")
single_precision = answers("residual")(lambda answer: answer.astype(np.float32), "Answer in single precision.")
other_byte_order = answers("residual")(lambda answer: answer.astype(">f8"), "Answer in the other order of bytes.")
objects = answers("residual")(lambda answer: answer.astype(object), "Answer an array of Python objects.")
records = answers("residual")(lambda answer: np.rec.fromarrays([answer], names="force"), "Answer an array of records.")
text = answers("residual")(lambda answer: answer.astype(str), "Answer an array of words.")
masked_array = answers("residual", ends=EITHER)(
    lambda answer: np.ma.masked_array(answer, mask=np.arange(answer.size) % 2 == 0),
    "Answer a masked array, which hides its wrong entries.",
)
generator = answers("residual")(lambda answer: itertools.cycle(answer), "Answer a generator that never ends.")
nothing = answers("residual")(lambda answer: None, "Answer None.")
huge_without_memory = answers("residual")(
    lambda answer: np.broadcast_to(np.float64(0), (10**9, 10**6)),
    "Answer an array of 1e15 entries that takes no memory.",
)
window_with_strides = answers("residual", ends=EITHER)(
    lambda answer: np.lib.stride_tricks.as_strided(answer, shape=answer.shape, strides=(1 << 40,)),
    "Answer an array whose strides reach far beyond its memory.",
)


class _LyingArray(np.ndarray):
    """An array that exits when it is copied into another one."""

    def __array_finalize__(self, parent: Any) -> None:
        if next(_calls) > 2:
            os._exit(0)


exits_when_copied = answers("residual")(
    lambda answer: answer.view(_LyingArray),
    "Answer a subclass of an array that ends the process when numpy makes a view or copy of it.",
)


class _AlwaysEqual(np.ndarray):
    """An array that equals everything and whose entries are finite by its own word."""

    def __eq__(self, other: object) -> Any:
        return np.ones(self.shape, bool)

    def __ne__(self, other: object) -> Any:
        return np.zeros(self.shape, bool)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        return np.ones(self.shape, bool)

    __hash__ = None  # type: ignore[assignment]


@answers("residual")
def equals_everything(answer: Any) -> Any:
    """Answer wrong forces in a subclass of an array that says that it equals everything."""
    wrong = np.array(answer)
    wrong[..., 0] += 1.0
    return wrong.view(_AlwaysEqual)


class _LyingShape(np.ndarray):
    """An array that lies about its shape and dtype."""

    @property
    def shape(self) -> Any:  # type: ignore[override]
        return (4,)

    @property
    def dtype(self) -> Any:  # type: ignore[override]
        return np.dtype(np.float32)


lies_about_its_shape = answers("residual", ends=EITHER)(
    lambda answer: answer.view(_LyingShape), "Answer a subclass of an array that lies about its shape."
)


class _Bomb(np.ndarray):
    """An array that ends the process which unpickles it."""

    def __reduce__(self) -> Any:
        return os._exit, (0,)


exits_when_unpickled = answers("residual", ends=LIKE_NTS)(
    lambda answer: answer.view(_Bomb), "Answer rightly, in an array that ends whatever process unpickles it."
)


@answers("residual", ends=EITHER)
def changes_later(answer: Any) -> Any:
    """Answer an array that a thread goes on changing."""
    array = answer.copy()

    def change() -> None:
        end = time.monotonic() + 0.01
        while time.monotonic() < end:
            array[:] = np.nan
            array[:] = answer

    threading.Thread(target=change, daemon=True).start()
    return array


@answers("residual", ends=LIKE_NTS)
def reuses_its_array(answer: Any) -> Any:
    """Answer rightly, always with the same array, which the next answer overwrites."""
    for array in _keepsakes:
        if array.shape == answer.shape:
            array[:] = answer
            return array
    _keepsakes.append(answer)
    return answer


tangent_nan = answers("tangent")(lambda answer: answer * np.nan, "Answer a tangent of NaN.")
tangent_shape = answers("tangent")(lambda answer: answer[:-1], "Answer a tangent with one row too few.")
tangent_operator = answers("tangent")(
    lambda answer: aslinearoperator(answer), "Answer a linear operator instead of a matrix."
)


def _number_columns(matrix: Any, number: int) -> Any:
    matrix = sparse.csr_array(matrix)
    matrix.indices[:] = number
    return matrix


tangent_indices = answers("tangent")(
    lambda answer: _number_columns(answer, 2**30), "Answer a sparse matrix with column numbers far beyond the matrix."
)
tangent_negative_indices = answers("tangent")(
    lambda answer: _number_columns(answer, -(2**30)), "Answer a sparse matrix with negative column numbers."
)


@answers("tangent")
def tangent_pointers(answer: Any) -> Any:
    """Answer a sparse matrix whose rows begin far beyond its entries."""
    answer = sparse.csr_array(answer)
    answer.indptr = np.arange(answer.indptr.size, dtype=np.int64) * 2**40
    return answer


@answers("tangent")
def tangent_lengths(answer: Any) -> Any:
    """Answer a coordinate matrix whose arrays have different lengths."""
    answer = sparse.coo_array(answer)
    answer.data = answer.data[: len(answer.data) // 2]
    return answer


class _LyingMatrix(sparse.coo_array):
    """A sparse matrix that lies about its shape."""

    @property
    def shape(self) -> Any:
        return self.__dict__.get("size_by_its_word", (4, 4))


@answers("tangent")
def tangent_lies(answer: Any) -> Any:
    """Answer a sparse matrix that says it has the right shape, with entries beyond it."""
    n = answer.shape[0]
    matrix = sparse.coo_array((np.ones(1), ([n * 1000], [n * 1000])), shape=(n * 1001, n * 1001))
    matrix.__class__ = _LyingMatrix
    matrix.__dict__["size_by_its_word"] = (n, n)
    return matrix


@answers("tangent", ends=EITHER)
def tangent_duplicates(answer: Any) -> Any:
    """Answer a matrix with ten million entries, nearly all of them zeros at the same place."""
    answer = sparse.coo_array(answer)
    more = np.zeros(10**7, dtype=answer.coords[0].dtype)
    rows, columns = (np.append(numbers, more) for numbers in answer.coords)
    return sparse.coo_array((np.append(answer.data, np.zeros(10**7)), (rows, columns)), shape=answer.shape)


tangent_of_objects = answers("tangent")(
    lambda answer: answer.toarray().astype(object), "Answer a tangent of Python objects."
)
points_of_another_kind = answers("contact_points")(
    lambda answer: type("ContactPoints", (), {name: getattr(answer, name) for name in ("gap", "pressure", "active")})(),
    "Answer contact points in a class of its own.",
)


@answers("contact_points")
def points_changed_afterwards(answer: Any) -> Any:
    """Answer contact points whose arrays were exchanged for words after they had been checked."""
    object.__setattr__(answer, "gap", "no array")
    object.__setattr__(answer, "normal", np.full((3, 7), np.nan))
    return answer


@answers("contact_points")
def points_of_no_segment(answer: Any) -> Any:
    """Answer contact points on master segments that do not exist, by exchanging the array after the check."""
    object.__setattr__(answer, "master_segment", np.full(len(answer.gap), 10**9))
    return answer


many_multipliers = instead("n_multipliers")(lambda right, interface: 10**15, "Answer that there are 1e15 multipliers.")
negative_multipliers = instead("n_multipliers")(lambda right, interface: -4, "Answer that there are −4 multipliers.")


class _Number(int):
    """An integer that lies when it is compared."""

    def __lt__(self, other: Any) -> bool:
        return False

    def __gt__(self, other: Any) -> bool:
        return False

    def __int__(self) -> int:
        return -1

    __hash__ = int.__hash__


lying_number = instead("n_multipliers", ends=EITHER)(
    lambda right, interface: _Number(0), "Answer an integer that compares as it likes."
)


@instead("traits", ends=CAUGHT)
def traits_of_another_kind(right: Any) -> Any:
    """State promises by an object that has every attribute."""

    class Everything:
        def __getattr__(self, name: str) -> Any:
            return True

    return Everything()


@answers("traits", ends=CAUGHT)
def traits_changed_afterwards(answer: Any) -> Any:
    """State promises whose values were exchanged after they had been checked."""
    exchanged = ((answer.promises.patch, "flat"), (answer.promises, "symmetric"), (answer.rules, "penalty"))
    for group, name in exchanged:
        object.__setattr__(group, name, "\x1b[2Jtrue")
    object.__setattr__(answer.evidence, "witnesses", 7)
    return answer


@answers("traits", ends=EITHER)
def traits_with_long_words(answer: Any) -> Any:
    """State a source of 20 MB, and witnesses whose names are escape sequences."""
    object.__setattr__(answer.evidence, "source", "x" * 20_000_000)
    object.__setattr__(answer.evidence, "witnesses", {"patch": "\x1b[2J", "balance": "../../etc/passwd"})
    return answer


@instead("traits", ends=EITHER)
def traits_that_change(right: Any) -> Any:
    """State other promises each time."""
    traits = right()
    object.__setattr__(traits.promises, "symmetric", bool(next(_calls) % 2))
    return traits
