"""Types of the arrays that flow through the house, and how they are made read-only."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Array = NDArray[Any]  # float64 or complex128: a residual takes and gives either

UNIT_ROUNDOFF = 2.0**-53

_Scalar = TypeVar("_Scalar", bound=np.generic)


def freeze(values: ArrayLike, dtype: type[_Scalar]) -> NDArray[_Scalar]:
    """A contiguous copy of `values` with the given dtype that nobody can write on.

    It stands on immutable bytes: a plugin cannot make it writeable again and change what others are judged on.
    """
    array = np.asarray(values, dtype=dtype)
    if array.size == 0:
        array = array.copy()
        array.setflags(write=False)
        return array
    return np.frombuffer(array.tobytes(), dtype=dtype).reshape(array.shape)


def dense(matrix: Any) -> FloatArray:
    """Return a matrix, given as an array or as a sparse matrix or array of scipy, as an array of the same shape."""
    array: FloatArray = matrix.toarray() if sparse.issparse(matrix) else np.asarray(matrix)
    return array
