"""The desk of a plugin's process: which requests have a reply, and which never do."""

from __future__ import annotations

import numpy as np
import pytest

from contactverif import named_case
from contactverif.isolation.messages import (
    Answer,
    Ask,
    Failure,
    Forget,
    Load,
    Make,
    MessageError,
    Request,
    Share,
    SharePairing,
    decode_replies,
    encode,
    pack_array,
    unpack_array,
)
from contactverif.isolation.worker import Desk

INTERFACE = named_case("c").interface
Z = named_case("c").z
LOAD = Load("contactverif.run.registry:load_formulation", "vts-ppt")


def share(nodes: np.ndarray) -> Share:
    return Share(2, pack_array(nodes), pack_array(INTERFACE.slave.segments), pack_array(INTERFACE.master.segments))


@pytest.mark.parametrize(
    "request_",
    [
        Make(1, float("nan")),
        Share(2, ("<f8", (3,), b"12345"), ("<i8", (1,), b"1"), ("no", (), b"")),
        SharePairing(3, {"a": ("<f8", (1,), b"12345678")}),
        Forget([1, 2, 3]),
    ],
)
def test_what_has_no_reply_never_gets_one_even_if_it_fails(request_: Request) -> None:
    assert Desk().reply(request_) is None


def test_an_error_waits_for_the_question_that_needs_what_is_missing() -> None:
    desk = Desk()
    desk.reply(LOAD)
    desk.reply(Make(1, 10.0))
    desk.reply(Share(2, ("<f8", (3,), b"12345"), ("<i8", (1,), b"1"), ("no", (), b"")))
    reply = desk.reply(Ask("pair", 1, 2, None, pack_array(Z), 3))
    assert isinstance(reply, Failure)
    desk.reply(share(INTERFACE.nodes))
    assert isinstance(desk.reply(Ask("pair", 1, 2, None, pack_array(Z), 3)), Answer)


@pytest.mark.parametrize(
    "packed",
    [
        ("|O", (1,), b"12345678"),
        ("<f8", (2,), b"12345678"),
        ("<f8", (-1,), b"12345678"),
        ("<f8", (1, -1), b"12345678"),
        ("<f8", (10**12,), b""),
        ("<f8", (0,) * 9, b""),
        ("<f8", (-1, 0), b""),
    ],
)
def test_an_array_that_lies_is_no_array(packed: tuple[str, tuple[int, ...], bytes]) -> None:
    with pytest.raises(MessageError):
        unpack_array(packed)


@pytest.mark.parametrize("dtype", [np.float64, np.complex128, np.longdouble, np.clongdouble, np.int64, np.int32, bool])
@pytest.mark.parametrize("shape", [(), (0,), (3, 0), (2, 3)])
def test_an_array_that_travels_is_what_it_was(dtype: type, shape: tuple[int, ...]) -> None:
    array = np.ones(shape, dtype)
    there = unpack_array(pack_array(array))
    assert (there.dtype, there.shape) == (array.dtype, array.shape)
    assert np.array_equal(there, array)
    assert not there.flags.writeable


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x93\x00\x01\x02", b"\x91" * 100_000, encode([Forget([1])])])
def test_rubbish_is_no_reply(data: bytes) -> None:
    with pytest.raises(MessageError):
        decode_replies(data)
