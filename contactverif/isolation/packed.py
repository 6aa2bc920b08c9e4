"""Arrays as plain bytes, for the way between two processes: written as they are, checked when they are read.

Rule: nothing that comes out of `PackedArray.unpack` is larger than the bytes that came in, or holds objects.
"""

from __future__ import annotations

import math
import re
from contextlib import suppress
from functools import lru_cache
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

_DTYPE = re.compile(r"[<>|=][biufcS][1-9]\d{0,8}")  # Booleans, integers, real and complex numbers, and characters.
MOST_AXES = 8


class PackedArray(msgspec.Struct, array_like=True, frozen=True):
    """An array: its dtype as numpy writes it, its shape, and its entries in the order of C."""

    dtype: str
    shape: Annotated[tuple[int, ...], msgspec.Meta(max_length=MOST_AXES)]
    data: bytes  # A copy, for an array inside a message would not lie where compiled code wants it.

    @classmethod
    def pack(cls, values: Any, name: str = "an array") -> PackedArray:
        """Return an array of numbers or characters, packed, or raise a ValueError that begins with its name."""
        array = np.asarray(values)
        try:
            _dtype(array.dtype.str)
        except ValueError:
            raise ValueError(f"{name} is of the type {array.dtype}, which is none of numbers or characters") from None
        if array.ndim > MOST_AXES:
            raise ValueError(f"{name} of {array.ndim} axes; needed at most {MOST_AXES}")
        native = array if array.dtype.isnative else array.astype(array.dtype.newbyteorder("="))
        return cls(native.dtype.str, native.shape, native.tobytes())

    def unpack(self) -> NDArray[Any]:
        """Return the array, read-only, or raise a ValueError if type, shape and bytes do not fit each other."""
        dtype = _dtype(self.dtype)
        if min(self.shape, default=0) < 0 or math.prod(self.shape) * dtype.itemsize != len(self.data):
            raise ValueError(f"{len(self.data)} bytes for an array of {dtype} and shape {self.shape}")
        return np.ndarray(self.shape, dtype, self.data)


@lru_cache(maxsize=256)
def _dtype(text: str) -> np.dtype[Any]:
    with suppress(TypeError):
        if _DTYPE.fullmatch(text):
            return np.dtype(text)
    raise ValueError(f"an array of the unknown dtype {text[:20]!r}")
