"""Frames of bytes over a socket: eight bytes of length, little-endian, then the bytes.

Rule: the other end may send anything, or nothing, or a byte now and then. So a frame has a deadline for all of it, and
no memory is taken before its bytes have come.
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
    """One end of a socket, which takes frames of at most `largest` bytes."""

    def __init__(self, end: socket.socket, largest: int = 1 << 62) -> None:
        end.setblocking(False)
        self._end, self._largest = end, largest
        self._file = end.fileno()
        self._rest = b""
        self._polls = {event: select.poll() for event in (select.POLLIN, select.POLLOUT)}
        for event, poll in self._polls.items():
            poll.register(self._file, event)

    def send(self, frame: bytes, seconds: float = inf) -> None:
        """Send a frame, or raise a ClosedError, or a TooLateError if the other end does not read all of it in time."""
        data = memoryview(_LENGTH.pack(len(frame)) + frame)
        deadline = perf_counter() + seconds
        while data:
            try:
                data = data[os.write(self._file, data[:_LARGEST_PIECE]) :]
            except BlockingIOError:
                self._wait(select.POLLOUT, deadline)
            except OSError:
                raise ClosedError from None

    def receive(self, seconds: float = inf, largest: int | None = None) -> bytes:
        """Return the next frame, or raise one of the errors above. What has come too late is kept for the next call.

        `largest` is a limit of bytes for this frame, where it is less than that of all.
        """
        deadline = perf_counter() + seconds
        data = self._rest or self._read(_PIECE, deadline)
        end = _LENGTH.size + _LENGTH.unpack_from(data)[0] if len(data) >= _LENGTH.size else 1 << 63
        if end > len(data):
            head = self._gather(data, _LENGTH.size, deadline)
            length = int(_LENGTH.unpack_from(head)[0])
            if length > (most := min(self._largest, largest or self._largest)):
                raise TooLargeError(f"{length} bytes; needed at most {most}")
            end = _LENGTH.size + length
            data = self._gather(head, end, deadline)
        self._rest = data[end:]
        return data[_LENGTH.size : end]

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
