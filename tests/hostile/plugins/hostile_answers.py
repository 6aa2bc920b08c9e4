"""Plugins whose answers are wrong in kind: shape, dtype, NaN, indices, or objects that only look like arrays."""

from __future__ import annotations

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


@answers("residual")
def nan(answer: Any) -> Any:
    """Answer NaN."""
    return answer * np.nan


@answers("residual")
def one_infinity(answer: Any) -> Any:
    """Answer one infinite force."""
    answer[-1] = np.inf
    return answer


@answers("residual")
def wrong_shape(answer: Any) -> Any:
    """Answer with one entry too few."""
    return answer[:-1]


@answers("residual")
def column(answer: Any) -> Any:
    """Answer a column, which broadcasts to a matrix."""
    return answer[:, None]


@answers("residual")
def single_precision(answer: Any) -> Any:
    """Answer in single precision."""
    return answer.astype(np.float32)


@answers("residual")
def other_byte_order(answer: Any) -> Any:
    """Answer in the other order of bytes."""
    return answer.astype(">f8")


@answers("residual")
def objects(answer: Any) -> Any:
    """Answer an array of Python objects."""
    return answer.astype(object)


@answers("residual")
def records(answer: Any) -> Any:
    """Answer an array of records."""
    return np.rec.fromarrays([answer], names="force")


@answers("residual")
def text(answer: Any) -> Any:
    """Answer an array of words."""
    return answer.astype(str)


@answers("residual", ends=EITHER)
def masked_array(answer: Any) -> Any:
    """Answer a masked array, which hides its wrong entries."""
    return np.ma.masked_array(answer, mask=np.arange(answer.size) % 2 == 0)


@answers("residual")
def generator(answer: Any) -> Any:
    """Answer a generator that never ends."""
    return itertools.cycle(answer)


@answers("residual")
def nothing(answer: Any) -> Any:
    """Answer None."""
    return None


@answers("residual")
def huge_without_memory(answer: Any) -> Any:
    """Answer an array of 1e15 entries that takes no memory."""
    return np.broadcast_to(np.float64(0), (10**9, 10**6))


@answers("residual", ends=EITHER)
def window_with_strides(answer: Any) -> Any:
    """Answer an array whose strides reach far beyond its memory."""
    return np.lib.stride_tricks.as_strided(answer, shape=answer.shape, strides=(1 << 40,))


class _LyingArray(np.ndarray):
    """An array that exits when it is copied into another one."""

    def __array_finalize__(self, parent: Any) -> None:
        if next(_calls) > 2:
            os._exit(0)


@answers("residual")
def exits_when_copied(answer: Any) -> Any:
    """Answer a subclass of an array that ends the process when numpy makes a view or copy of it."""
    return answer.view(_LyingArray)


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


@answers("residual", ends=EITHER)
def lies_about_its_shape(answer: Any) -> Any:
    """Answer a subclass of an array that lies about its shape."""
    return answer.view(_LyingShape)


class _Bomb(np.ndarray):
    """An array that ends the process which unpickles it."""

    def __reduce__(self) -> Any:
        return os._exit, (0,)


@answers("residual", ends=LIKE_NTS)
def exits_when_unpickled(answer: Any) -> Any:
    """Answer rightly, in an array that ends whatever process unpickles it."""
    return answer.view(_Bomb)


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


@answers("tangent")
def tangent_nan(answer: Any) -> Any:
    """Answer a tangent of NaN."""
    return answer * np.nan


@answers("tangent")
def tangent_shape(answer: Any) -> Any:
    """Answer a tangent with one row too few."""
    return answer[:-1]


@answers("tangent")
def tangent_operator(answer: Any) -> Any:
    """Answer a linear operator instead of a matrix."""
    return aslinearoperator(answer)


@answers("tangent")
def tangent_indices(answer: Any) -> Any:
    """Answer a sparse matrix with column numbers far beyond the matrix."""
    answer = sparse.csr_array(answer)
    answer.indices[:] = 2**30
    return answer


@answers("tangent")
def tangent_negative_indices(answer: Any) -> Any:
    """Answer a sparse matrix with negative column numbers."""
    answer = sparse.csr_array(answer)
    answer.indices[:] = -(2**30)
    return answer


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


@answers("tangent")
def tangent_of_objects(answer: Any) -> Any:
    """Answer a tangent of Python objects."""
    return answer.toarray().astype(object)


@answers("contact_points")
def points_of_another_kind(answer: Any) -> Any:
    """Answer contact points in a class of its own."""
    return type("ContactPoints", (), {name: getattr(answer, name) for name in ("gap", "pressure", "active")})()


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


@instead("n_multipliers")
def many_multipliers(right: Any, interface: Any) -> Any:
    """Answer that there are 1e15 multipliers."""
    return 10**15


@instead("n_multipliers")
def negative_multipliers(right: Any, interface: Any) -> Any:
    """Answer that there are −4 multipliers."""
    return -4


class _Number(int):
    """An integer that lies when it is compared."""

    def __lt__(self, other: Any) -> bool:
        return False

    def __gt__(self, other: Any) -> bool:
        return False

    def __int__(self) -> int:
        return -1

    __hash__ = int.__hash__


@instead("n_multipliers", ends=EITHER)
def lying_number(right: Any, interface: Any) -> Any:
    """Answer an integer that compares as it likes."""
    return _Number(0)


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
    for name in ("flat", "penalty", "enforcement", "symmetric"):
        object.__setattr__(answer, name, "\x1b[2Jtrue")
    object.__setattr__(answer, "witnesses", 7)
    return answer


@answers("traits", ends=EITHER)
def traits_with_long_words(answer: Any) -> Any:
    """State a source of 20 MB, and witnesses whose names are escape sequences."""
    object.__setattr__(answer, "source", "x" * 20_000_000)
    object.__setattr__(answer, "witnesses", {"patch": "\x1b[2J", "balance": "../../etc/passwd"})
    return answer


@instead("traits", ends=EITHER)
def traits_that_change(right: Any) -> Any:
    """State other promises each time."""
    traits = right()
    object.__setattr__(traits, "symmetric", bool(next(_calls) % 2))
    return traits
