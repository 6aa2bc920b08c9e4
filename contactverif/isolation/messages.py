"""The messages between the judge and a plugin's process, and arrays as bytes.

Rules for the next editor: a message holds numbers, words and bytes, never an object. Whatever comes from the plugin's
process is decoded by these schemas and by `unpack_array` alone, since a plugin may write there what it likes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import msgspec
import numpy as np

from contactverif.contract.arrays import freeze

# The kinds of arrays that may travel. An array of objects never does.
_DTYPES = {
    np.dtype(kind).str: np.dtype(kind)
    for kind in (np.float64, np.complex128, np.longdouble, np.clongdouble, np.int64, np.int32, np.bool_)
}

PackedArray = tuple[str, tuple[int, ...], bytes]  # The dtype, the shape, and the numbers in the order of C.


class MessageError(Exception):
    """A message is not what its schema says."""


class Load(msgspec.Struct, array_like=True, tag=0):
    """Load the formulation of that name, in the way that the judge names (``"module:function"``)."""

    loader: str
    name: str


class Survey(msgspec.Struct, array_like=True, tag=1):
    """Load what is installed under a name, and say what it is."""

    loader: str
    name: str


class Make(msgspec.Struct, array_like=True, tag=2):
    """Make the formulation with a penalty, and keep it under a number. There is no answer; an error waits there."""

    number: int
    penalty: float


class Share(msgspec.Struct, array_like=True, tag=3):
    """Keep an interface under a number. There is no answer."""

    number: int
    nodes: PackedArray
    slave: PackedArray
    master: PackedArray


class SharePairing(msgspec.Struct, array_like=True, tag=4):
    """Keep a pairing, which the judge has changed or made, under a number. There is no answer."""

    number: int
    arrays: dict[str, PackedArray]


class Forget(msgspec.Struct, array_like=True, tag=5):
    """Forget what is kept under some numbers. There is no answer."""

    numbers: list[int]


class Ask(msgspec.Struct, array_like=True, tag=6):
    """Call a method of a formulation. The answer is an `Answer`.

    The pairing of an answer is kept under the number `keep`.
    """

    verb: str
    formulation: int
    interface: int
    pairing: int | None
    z: PackedArray | None
    keep: int


class Run(msgspec.Struct, array_like=True, tag=7):
    """Call a function of the harness (``"module:function"``) with the formulation. The answer is `Words`."""

    function: str
    words: bytes


class Answer(msgspec.Struct, array_like=True, tag=0):
    """The arrays of an answer by name, and the seconds that the call took."""

    arrays: dict[str, PackedArray]
    seconds: float
    number: int = 0
    opaque: bool = False


class Failure(msgspec.Struct, array_like=True, tag=1):
    """The error of a call: its kind, what caused it, and its words."""

    kind: Literal["plugin", "contract", "not finite", "misuse"]
    cause: str
    words: tuple[str, ...]


class Loaded(msgspec.Struct, array_like=True, tag=2):
    """A formulation that was loaded: its promises, and the parts that it has."""

    traits: dict[str, bool | int | str | list[int] | dict[str, str] | None]
    provides: list[str]


class Unloaded(msgspec.Struct, array_like=True, tag=3):
    """The reason why a formulation does not load."""

    reason: str


class Wraps(msgspec.Struct, array_like=True, tag=4):
    """The name is that of a wrapper, with its first line of documentation."""

    summary: str


class Words(msgspec.Struct, array_like=True, tag=5):
    """The words that a function of the harness has returned there."""

    words: bytes


Request = Load | Survey | Make | Share | SharePairing | Forget | Ask | Run
Reply = Answer | Failure | Loaded | Unloaded | Wraps | Words

_encoder = msgspec.msgpack.Encoder()
_request_decoder: msgspec.msgpack.Decoder[list[Request]] = msgspec.msgpack.Decoder(list[Request])
_reply_decoder: msgspec.msgpack.Decoder[list[Reply]] = msgspec.msgpack.Decoder(list[Reply])


def encode(messages: Sequence[Request] | Sequence[Reply]) -> bytes:
    """Return messages as bytes."""
    return _encoder.encode(messages)


def decode_requests(data: bytes) -> list[Request]:
    """Return the messages that the judge sent."""
    return _request_decoder.decode(data)


def decode_replies(data: bytes) -> list[Reply]:
    """Return the messages that a plugin's process sent.

    Raises
    ------
    MessageError
        If there are none.
    """
    try:
        return _reply_decoder.decode(data)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as error:
        raise MessageError(f"a message that cannot be read ({type(error).__name__})") from error


def pack_array(array: np.ndarray[Any, Any]) -> PackedArray:
    """Return an array of floats, complex numbers, integers or booleans as words and bytes."""
    return array.dtype.str, array.shape, array.tobytes()


def unpack_array(packed: PackedArray) -> np.ndarray[Any, Any]:
    """Return the array (any shape), read-only.

    Raises
    ------
    MessageError
        If the dtype is none of those that travel, or the bytes do not fill the shape.
    """
    kind, shape, data = packed
    dtype = _DTYPES.get(kind)
    if dtype is None:
        raise MessageError(f"an array of the unknown dtype {kind[:20]!r}")
    if not data:
        if 0 not in shape or min(shape) < 0 or len(shape) > 8:
            raise MessageError(f"no number at all for an array of shape {shape[:8]}")
        return freeze(np.zeros(shape, dtype), dtype.type)
    try:
        if min(shape, default=1) < 1:
            raise ValueError
        return np.frombuffer(data, dtype).reshape(shape)
    except ValueError:
        raise MessageError(f"{len(data)} bytes for an array of shape {shape[:8]} and dtype {dtype}") from None


def travels(array: np.ndarray[Any, Any]) -> bool:
    """Return whether arrays of this dtype may travel."""
    return array.dtype.str in _DTYPES
