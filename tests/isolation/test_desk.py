"""The desk of a plugin's process: which requests have a reply, and which never do."""

import numpy as np
import pytest

from contactverif import load_formulation, named_case
from contactverif.isolation.wire import (
    Answer,
    Ask,
    Failure,
    Forget,
    Load,
    Make,
    MessageError,
    PackedArray,
    Request,
    ShareInterface,
    SharePairing,
    decode_replies,
    encode,
)
from contactverif.isolation.worker import RequestHandler

INTERFACE = named_case("c").interface
Z = named_case("c").z
LOAD = Load(1, "vts-ppt")
CUT = PackedArray("<f8", (3,), b"12345")


def share(nodes: PackedArray) -> ShareInterface:
    return ShareInterface(2, nodes, *(PackedArray.pack(side.segments) for side in (INTERFACE.slave, INTERFACE.master)))


@pytest.mark.parametrize(
    "request_",
    [
        Make(1, float("nan")),
        share(CUT),
        SharePairing(3, {"a": PackedArray("<f8", (1,), b"12345678")}),
        Forget([1, 2, 3]),
    ],
)
def test_what_has_no_reply_never_gets_one_even_if_it_fails(request_: Request) -> None:
    assert RequestHandler(load_formulation, load_formulation).reply(request_) is None


def test_an_error_waits_for_the_question_that_needs_what_is_missing() -> None:
    desk = RequestHandler(load_formulation, load_formulation)
    desk.reply(LOAD)
    desk.reply(Make(1, 10.0))
    desk.reply(share(CUT))
    ask = Ask(3, "pair", 1, 2, None, PackedArray.pack(Z))
    reply = desk.reply(ask)
    assert isinstance(reply, Failure)
    assert reply.question == 3
    desk.reply(share(PackedArray.pack(INTERFACE.nodes)))
    assert isinstance(desk.reply(ask), Answer)


@pytest.mark.parametrize(
    "packed",
    [
        ("|O", (1,), b"12345678"),
        ("<f8", (2,), b"12345678"),
        ("<f8", (-1,), b"12345678"),
        ("<f8", (1, -1), b"12345678"),
        ("<f8", (10**12,), b""),
        ("<f8", (-1, 0), b""),
        ("<f8", (0, 2**62), b""),
        ("<f8", (2**62, 2**62), bytes(16)),
        ("nonsense", (2,), b""),
        ("<f3", (1,), b"123"),
        ("<f8", (-1, -2), bytes(16)),
    ],
)
def test_an_array_that_lies_is_no_array(packed: tuple[str, tuple[int, ...], bytes]) -> None:
    with pytest.raises(ValueError, match=r"array"):
        PackedArray(*packed).unpack()


@pytest.mark.parametrize("dtype", [np.float64, np.complex128, np.longdouble, np.clongdouble, np.int64, np.int32, bool])
@pytest.mark.parametrize("shape", [(), (0,), (3, 0), (2, 3)])
def test_an_array_that_travels_is_what_it_was(dtype: type, shape: tuple[int, ...]) -> None:
    array = np.ones(shape, dtype)
    there = PackedArray.pack(array).unpack()
    assert (there.dtype, there.shape) == (array.dtype, array.shape)
    assert np.array_equal(there, array)
    assert not there.flags.writeable


def test_an_array_of_too_many_axes_does_not_travel() -> None:
    with pytest.raises(ValueError, match="'active' of 9 axes; needed at most 8"):
        PackedArray.pack(np.zeros((1,) * 9), "'active'")


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x93\x00\x01\x02", b"\x91" * 100_000, encode([Forget([1])])])
def test_rubbish_is_no_reply(data: bytes) -> None:
    with pytest.raises(MessageError):
        decode_replies(data)
