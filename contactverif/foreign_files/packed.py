"""Arrays as plain bytes, for the way from a child process to its parent: written as they are, checked when read.

Rule for the next editor: nothing that comes out of `PackedArray.unpack` may be larger than the bytes that came in.
"""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

KINDS = "biufS"  # The kinds of array that may pass: bool, integers, floats and bytes.


class PackedArray(msgspec.Struct, array_like=True, frozen=True):
    """An array.

    Attributes
    ----------
    dtype : str
        Its type, as numpy writes it.
    shape : tuple[int, ...]
        Its shape.
    data : memoryview
        Its entries, in the order of C.
    """

    dtype: str
    shape: tuple[int, ...]
    data: memoryview

    @classmethod
    def pack(cls, values: Any, name: str = "an array") -> PackedArray:
        """Return an array of numbers or bytes, packed.

        Raises
        ------
        ValueError
            If it holds anything else.
        """
        array = np.asarray(values)
        if array.dtype.kind not in KINDS or array.dtype.itemsize == 0:
            raise ValueError(f"{name} is of the type {array.dtype}, which is none of numbers or characters")
        native = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))
        return cls(native.dtype.str, array.shape, native.reshape(-1).view(np.uint8).data)

    def unpack(self) -> NDArray[Any]:
        """Return the array, read-only.

        Raises
        ------
        ValueError
            If type, shape and bytes do not fit each other.
        """
        dtype = np.dtype(self.dtype)
        if dtype.kind not in KINDS or min(self.shape, default=0) < 0:
            raise ValueError(f"an array of {self.dtype} and shape {self.shape}")
        if math.prod(self.shape) * dtype.itemsize != self.data.nbytes:
            raise ValueError(f"{self.data.nbytes} bytes for an array of {self.dtype} and shape {self.shape}")
        array: NDArray[Any] = np.frombuffer(self.data, dtype=dtype).reshape(self.shape)
        return array
