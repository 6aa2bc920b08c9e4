"""A line between two processes: frames come whole, late ones are not lost, and nobody takes memory for a promise."""

import socket
import struct
from collections.abc import Iterator

import pytest

from contactverif.isolation.child import Channel, ClosedError, TooLargeError, TooLateError

Ends = tuple[socket.socket, socket.socket]


@pytest.fixture
def ends() -> Iterator[Ends]:
    near, far = socket.socketpair()
    with near, far:
        yield near, far


def test_a_frame_that_comes_in_pieces_is_not_lost_when_it_is_late(ends: Ends) -> None:
    near, far = ends
    channel, frame = Channel(near), struct.pack("<Q", 6) + b"answer"
    for piece in (frame[:3], frame[3:10]):
        far.sendall(piece)
        with pytest.raises(TooLateError):
            channel.receive(0.01)
    far.sendall(frame[10:] + frame)
    assert [channel.receive(1.0) for _ in range(2)] == [b"answer", b"answer"]
    far.close()
    with pytest.raises(ClosedError):
        channel.receive(1.0)


def test_a_promise_of_too_much_is_refused_before_it_comes(ends: Ends) -> None:
    near, far = ends
    far.sendall(struct.pack("<Q", 1 << 60))
    with pytest.raises(TooLargeError):
        Channel(near, largest=1000).receive(1.0)


def test_whoever_does_not_read_is_not_waited_for(ends: Ends) -> None:
    with pytest.raises(TooLateError):
        Channel(ends[0]).send(b"x" * (1 << 24), seconds=0.01)
