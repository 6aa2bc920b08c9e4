"""Frames of bytes over a socket: four bytes of length, then the bytes.

Rule for the next editor: the other end may send anything, or nothing, or a byte now and then. So a frame has a deadline
for all of it, and no memory is taken before its bytes have come.
"""

from __future__ import annotations

import socket
import struct
from time import monotonic

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
        self._end, self._largest = end, largest
        self._rest = b""

    def send(self, *frames: bytes, seconds: float | None = None) -> None:
        """Send some frames.

        Raises
        ------
        ClosedError
            If the other end is closed.
        TooLateError
            If the other end does not read for so many seconds.
        """
        self._end.settimeout(seconds)
        try:
            self._end.sendall(b"".join(part for frame in frames for part in (_LENGTH.pack(len(frame)), frame)))
        except TimeoutError:
            raise TooLateError from None
        except OSError:
            raise ClosedError from None

    def receive(self, seconds: float | None = None) -> bytes:
        """Return the next frame.

        Raises
        ------
        ClosedError
            If the other end is closed.
        TooLateError
            If the whole frame is not there within so many seconds.
        TooLargeError
            If the frame is too long.
        """
        data = self._rest
        if not data:
            self._end.settimeout(seconds)
            data = self._read(_PIECE)
        end = _LENGTH.size + _LENGTH.unpack_from(data)[0] if len(data) >= _LENGTH.size else 1 << 63
        if end > len(data):
            return self._receive_in_pieces(data, None if seconds is None else monotonic() + seconds)
        self._rest = data[end:]  # All of it came at once, as nearly always.
        return data[_LENGTH.size : end]

    def _receive_in_pieces(self, data: bytes, deadline: float | None) -> bytes:
        parts, have = [data], len(data)
        while have < _LENGTH.size:
            parts.append(self._read_before(deadline, _PIECE))
            have += len(parts[-1])
        head = b"".join(parts)
        length = int(_LENGTH.unpack_from(head)[0])
        if length > self._largest:
            raise TooLargeError(f"{length} bytes")
        whole = _LENGTH.size + length
        parts, have = [head], len(head)
        while have < whole:
            parts.append(self._read_before(deadline, min(max(whole - have, _PIECE), _LARGEST_PIECE)))
            have += len(parts[-1])
        together = b"".join(parts)
        self._rest = together[whole:]
        return together[_LENGTH.size : whole]

    def _read_before(self, deadline: float | None, size: int) -> bytes:
        if deadline is not None:
            left = deadline - monotonic()
            if left <= 0:
                raise TooLateError
            self._end.settimeout(left)
        return self._read(size)

    def _read(self, size: int) -> bytes:
        try:
            data = self._end.recv(size)
        except TimeoutError:
            raise TooLateError from None
        except OSError:
            data = b""
        if not data:
            raise ClosedError
        return data

    def close(self) -> None:
        """Close this end."""
        self._end.close()
