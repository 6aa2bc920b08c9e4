"""The types of the arrays that flow through the house, and how an array is checked and made read-only.

What a plugin may keep or change must not be what others are judged on: arrays go to it and come from it as copies.
"""

from collections.abc import Collection
from copy import copy
from functools import cache, lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactverif.contract.errors import MisuseError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Array = NDArray[Any]  # float64 or complex128: a residual takes either and returns the same.

UNIT_ROUNDOFF = 2.0**-53

_Scalar = TypeVar("_Scalar", bound=np.generic)


def freeze(values: ArrayLike, dtype: type[_Scalar]) -> NDArray[_Scalar]:
    """Return a contiguous read-only copy of an array.

    It stands on immutable bytes, so that nobody can make it writeable again. An array that already does is returned.
    """
    array = np.asarray(values, dtype=dtype)
    base: Any = array.base
    while type(base) is np.ndarray:
        base = base.base
    if type(base) is bytes and type(array) is np.ndarray and array.flags.c_contiguous:
        return array
    return np.ndarray(array.shape, array.dtype, array.tobytes())


def freeze_together(arrays: Collection[NDArray[_Scalar]], dtype: type[_Scalar]) -> list[NDArray[_Scalar]]:
    """Return read-only copies of arrays of a dtype as parts of one, the last of the list: that takes less time."""
    buffers: list[Any] = [array if array.flags.c_contiguous else array.tobytes() for array in arrays]
    together: NDArray[_Scalar] = np.frombuffer(b"".join(buffers), dtype)
    parts, end = [], 0
    for array in arrays:
        begin, end = end, end + array.size
        parts.append(together[begin:end] if array.ndim == 1 else together[begin:end].reshape(array.shape))
    return [*parts, together]


@cache
def sparse_of_scipy() -> Any:
    """Return the module `scipy.sparse`, imported when a tangent is first asked for, since that takes long."""
    from scipy import sparse

    return sparse


def dense(matrix: Any) -> FloatArray:
    """Return a matrix, given as an array or as a sparse matrix or array of scipy, as an array of the same shape."""
    is_sparse = not isinstance(matrix, np.ndarray) and sparse_of_scipy().issparse(matrix)
    return matrix.toarray() if is_sparse else np.asarray(matrix)


def compressed_matrix(kind: str, size: int, data: FloatArray, indices: Array, indptr: Array) -> Any:
    """Return the csr or csc array (size, size) of these three arrays, which fit each other and are not copied.

    scipy's own constructor checks and compares the arrays, which takes longer than the product with a small matrix.
    """
    matrix = copy(_empty_matrix(kind, size))
    matrix.data, matrix.indices, matrix.indptr = data, indices, indptr
    return matrix


@lru_cache(maxsize=64)  # Each holds a number for each row, which counts where there are millions.
def _empty_matrix(kind: str, size: int) -> Any:
    return getattr(sparse_of_scipy(), f"{kind}_array")((size, size))


def as_array(argument: str, values: ArrayLike) -> NDArray[Any]:
    """Return the values as an array of any dtype and shape."""
    try:
        return np.asarray(values)
    except ValueError as error:
        raise MisuseError(argument, "rows of different lengths", "an array") from error


def as_floats(argument: str, values: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Return real numbers as a new array of floats of a shape, in which −1 stands for any length."""
    raw = as_array(argument, values)
    if raw.dtype.kind not in "fiu":
        raise MisuseError(argument, f"dtype {raw.dtype}", "numbers")
    check_shape(argument, raw, shape)
    return raw.astype(np.float64)


def check_shape(argument: str, array: NDArray[Any], shape: tuple[int, ...]) -> None:
    """Check the shape of an array, in which −1 stands for any length."""
    if array.ndim != len(shape) or any(n not in (-1, actual) for n, actual in zip(shape, array.shape, strict=True)):
        lengths = ", ".join("n" if length < 0 else str(length) for length in shape)
        raise MisuseError(argument, f"shape {array.shape}", f"shape ({lengths}{',' * (len(shape) == 1)})")
