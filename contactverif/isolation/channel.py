"""Frames of bytes over a socket: eight bytes of length, then the bytes.

Rule for the next editor: the other end may send anything, or nothing, or a byte now and then. So a frame has a deadline
for all of it, and no memory is taken before its bytes have come.
"""

from __future__ import annotations

import os
import select
import socket
import struct
from math import ceil, inf
from time import perf_counter

_LENGTH = struct.Struct("<Q")
_PIECE = 1 << 16
_LARGEST_PIECE = 1 << 22


class ClosedError(Exception):
    """The other end is closed."""


class TooLateError(Exception):
    """The deadline has passed."""


class TooLargeError(Exception):
    """A frame is longer than it may be."""


class Channel:
    """One end of a socket.

    Parameters
    ----------
    end : socket.socket
        The end, which belongs to the channel.
    largest : int
        The largest number of bytes of a frame that comes in.
    """

    def __init__(self, end: socket.socket, largest: int = 1 << 62) -> None:
        end.setblocking(False)
        self._end, self._largest = end, largest
        self._file = end.fileno()
        self._rest = b""
        self._polls = {event: select.poll() for event in (select.POLLIN, select.POLLOUT)}
        for event, poll in self._polls.items():
            poll.register(self._file, event)

    def send(self, frame: bytes, seconds: float = inf) -> None:
        """Send a frame.

        Raises
        ------
        ClosedError
            If the other end is closed.
        TooLateError
            If the other end does not read all of it within so many seconds.
        """
        data = memoryview(_LENGTH.pack(len(frame)) + frame)
        deadline = perf_counter() + seconds
        while data:
            try:
                data = data[os.write(self._file, data[:_LARGEST_PIECE]) :]
            except BlockingIOError:
                self._wait(select.POLLOUT, deadline)
            except OSError:
                raise ClosedError from None

    def receive(self, seconds: float = inf) -> bytes:
        """Return the next frame.

        Raises
        ------
        ClosedError
            If the other end is closed.
        TooLateError
            If the whole frame is not there within so many seconds. What has come is kept for the next call.
        TooLargeError
            If the frame is too long.
        """
        deadline = perf_counter() + seconds
        data = self._rest or self._read(_PIECE, deadline)
        end = _LENGTH.size + _LENGTH.unpack_from(data)[0] if len(data) >= _LENGTH.size else 1 << 63
        if end > len(data):
            return self._receive_in_pieces(data, deadline)
        self._rest = data[end:]  # All of it came at once, as nearly always.
        return data[_LENGTH.size : end]

    def _receive_in_pieces(self, data: bytes, deadline: float) -> bytes:
        head = self._gather(data, _LENGTH.size, deadline)
        length = int(_LENGTH.unpack_from(head)[0])
        if length > self._largest:
            raise TooLargeError(f"{length} bytes")
        whole = _LENGTH.size + length
        together = self._gather(head, whole, deadline)
        self._rest = together[whole:]
        return together[_LENGTH.size : whole]

    def _gather(self, data: bytes, size: int, deadline: float) -> bytes:
        """Return the data and what follows it, so many bytes at least."""
        parts, have = [data], len(data)
        while have < size:
            try:
                parts.append(self._read(min(max(size - have, _PIECE), _LARGEST_PIECE), deadline))
            except TooLateError:
                self._rest = b"".join(parts)
                raise
            have += len(parts[-1])
        return b"".join(parts)

    def _read(self, size: int, deadline: float) -> bytes:
        self._wait(select.POLLIN, deadline)
        try:
            data = os.read(self._file, size)
        except OSError:
            data = b""
        if not data:
            raise ClosedError
        return data

    def _wait(self, event: int, deadline: float) -> None:
        """Wait until the socket can be read or written."""
        left = None if deadline == inf else max(0, ceil(1000 * (deadline - perf_counter())))
        if not self._polls[event].poll(left):
            raise TooLateError

    def close(self) -> None:
        """Close this end."""
        self._end.close()
