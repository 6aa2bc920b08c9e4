"""The messages between the judge and a plugin's process; `docs/reference/protocol.md` describes them.

Rule: a message holds numbers, words and bytes, never an object. A plugin may write to the judge what it likes, so what
comes from its process is decoded by these schemas and by `PackedArray.unpack` alone. What it sends takes no more
memory here than a few times its bytes: lists and mappings, whose entries take more, have a longest length.
"""

import math
import re
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from contactverif.contract.errors import one_line

MOST_QUESTIONS = 128  # The number of questions in a message.
_MOST_NAMES = 256  # The number of arrays in an answer, and of methods.
_MOST_WORDS = 3  # A misuse has so many; other failures have one.
_LONGEST_REASON = 200  # Characters of what msgspec says of a message.
_DTYPE = re.compile(r"[<>|=][biufcS][1-9]\d{0,8}")  # Booleans, integers, real and complex numbers, and characters.
_USUAL = frozenset(np.dtype(kind).str for kind in (np.float64, np.int64, np.int32, np.complex128, np.bool_))
MOST_AXES = 8


class PackedArray(msgspec.Struct, array_like=True, frozen=True):
    """An array: its dtype as numpy writes it, its shape, and its entries in the order of C."""

    dtype: str
    shape: Annotated[tuple[int, ...], msgspec.Meta(max_length=MOST_AXES)]
    data: bytes  # A copy, for an array inside a message would not lie where compiled code wants it.

    @classmethod
    def pack(cls, values: Any, name: str = "an array") -> Self:
        """Return an array of numbers or characters, packed, or raise a ValueError that begins with its name."""
        if type(values) is np.ndarray and (text := values.dtype.str) in _USUAL and values.ndim <= MOST_AXES:
            return cls(text, values.shape, values.tobytes())
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


class MessageError(Exception):
    """A message is not what its schema says."""


class Load(msgspec.Struct, array_like=True, tag="load"):
    """Load the formulation of a name; or say what is installed under a name, loaded with its defaults."""

    question: int
    name: str
    survey: bool = False


class Make(msgspec.Struct, array_like=True, tag="make"):
    """Make the formulation with a penalty, and keep it under a number."""

    number: int
    penalty: float


class ShareInterface(msgspec.Struct, array_like=True, tag="interface"):
    """Keep an interface under a number."""

    number: int
    nodes: PackedArray
    slave: PackedArray
    master: PackedArray


class SharePairing(msgspec.Struct, array_like=True, tag="pairing"):
    """Keep a pairing, which the judge has changed or made, under a number."""

    number: int
    arrays: dict[str, PackedArray]


class Forget(msgspec.Struct, array_like=True, tag="forget"):
    """Forget what is kept under some numbers."""

    numbers: list[int]


class Ask(msgspec.Struct, array_like=True, tag="ask"):
    """Call a method of a formulation. A pairing that it returns is kept under the number of the question."""

    question: int
    method: str
    formulation: int
    interface: int
    pairing: int | None
    z: PackedArray | None
    timed: bool = False
    counted: bool = False  # The methods that run in the call are counted.


class Solve(msgspec.Struct, array_like=True, tag="solve"):
    """Let an engine solve a scene, whose arrays have names."""

    question: int
    arrays: dict[str, PackedArray]


class Solved(msgspec.Struct, array_like=True, tag="solved"):
    """The answer of an engine: its arrays by name, how it ended, and the time of the solution there."""

    question: int
    arrays: Annotated[dict[str, PackedArray], msgspec.Meta(max_length=_MOST_NAMES)]
    converged: bool
    iterations: int
    message: str
    seconds: float


class Answer(msgspec.Struct, array_like=True, tag="answer"):
    """The arrays of an answer by name, the time of the call there, and the number of methods that ran in it."""

    question: int
    arrays: Annotated[dict[str, PackedArray], msgspec.Meta(max_length=_MOST_NAMES)]
    seconds: float
    calls: int
    count: int = 0  # The number of multipliers.
    handle: bool = False  # The pairing has a handle.


class Failure(msgspec.Struct, array_like=True, tag="failure"):
    """The error of a call: its kind, what caused it, and its words."""

    question: int
    kind: Literal["plugin", "contract", "not finite", "misuse"]
    cause: str
    words: Annotated[tuple[str, ...], msgspec.Meta(max_length=_MOST_WORDS)]


class Loaded(msgspec.Struct, array_like=True, tag="loaded"):
    """A formulation that was loaded: its traits, and the optional methods that it has."""

    question: int
    traits: dict[str, Any]  # Anything at all, so a message of this kind must be short.
    provides: Annotated[list[str], msgspec.Meta(max_length=_MOST_NAMES)]


class Unloaded(msgspec.Struct, array_like=True, tag="unloaded"):
    """The reason why a formulation does not load."""

    question: int
    reason: str


class Wraps(msgspec.Struct, array_like=True, tag="wraps"):
    """The name needs another formulation or a file: its first line of documentation, and what a user writes."""

    question: int
    summary: str
    form: str


Request = Load | Make | ShareInterface | SharePairing | Forget | Ask  # An engine gets Load and Solve alone.
Reply = Answer | Solved | Failure | Loaded | Unloaded | Wraps

# A message, or several as a frame, as bytes; and the messages that the judge sent.
encode = msgspec.msgpack.Encoder().encode
decode_requests = msgspec.msgpack.Decoder(list[Request]).decode
_answers = msgspec.msgpack.Decoder(Annotated[list[Answer | Solved | Failure], msgspec.Meta(max_length=MOST_QUESTIONS)])
_loaded = msgspec.msgpack.Decoder(Annotated[list[Loaded | Unloaded | Wraps | Failure], msgspec.Meta(max_length=1)])


def join(messages: Sequence[bytes]) -> bytes:
    """Return the frame of messages that are encoded."""
    return encode([*map(msgspec.Raw, messages)])


def decode_replies(data: bytes, *, loading: bool = False) -> Sequence[Reply]:
    """Return the messages that a plugin's process sent, or raise a MessageError if they are none.

    Only while it loads may it say what it is, and then it says nothing else.
    """
    try:
        replies: Sequence[Reply] = (_loaded if loading else _answers).decode(data)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as error:
        raise MessageError(f"a message that cannot be read: {one_line(str(error), _LONGEST_REASON)}") from error
    return replies
