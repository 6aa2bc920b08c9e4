"""The lines of a plain text file with their numbers, so that an error names the line, what is there and what is needed.

Comments begin with `#`. Empty lines and comments are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from contactverif.contract.errors import MisuseError
from contactverif.isolation.ordinary import check_ordinary

MOST_BYTES = 1 << 30  # A million queries have 100 MB.
_LONGEST = 60  # The number of characters of a line that an error shows.


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a file."""

    place: str  # The file and the number of the line, in words.
    words: list[str]

    def error(self, needed: str) -> MisuseError:
        """Return the error that says what was needed instead of this line."""
        text = " ".join(self.words)
        return MisuseError(self.place, repr(text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"), needed)

    def integer(self, place: int, *, low: int, high: int | None = None) -> int:
        """Return a word as an integer between two limits."""
        needed = f"an integer of at least {low}" if high is None else f"an integer from {low} to {high}"
        word = self.words[place]
        try:
            value = int(word)
        except ValueError:
            raise MisuseError(self.place, repr(word), needed) from None
        if value < low or (high is not None and value > high):
            raise MisuseError(self.place, repr(word), needed)
        return value

    def real(self, place: int) -> float:
        """Return a word as a number, which may be infinite or not a number."""
        try:
            return float(self.words[place])
        except ValueError:
            raise MisuseError(self.place, repr(self.words[place]), "a number") from None

    def finite(self, place: int) -> float:
        """Return a word as a finite number."""
        value = self.real(place)
        if not math.isfinite(value):
            raise MisuseError(self.place, repr(self.words[place]), "a finite number")
        return value

    def fraction(self, place: int) -> Fraction:
        """Return a word `p/q` or `p` as a rational number."""
        try:
            return Fraction(self.words[place])
        except (ValueError, ZeroDivisionError):
            raise MisuseError(self.place, repr(self.words[place]), "a rational number P/Q") from None


class TextLines:
    """The lines of a text, one after the other."""

    def __init__(self, name: str, text: str) -> None:
        self.name, self._lines, self._next = name, text.splitlines(), 0
        self.comments: list[Line] = []

    @classmethod
    def read(cls, path: Path) -> TextLines:
        """Return the lines of a file."""
        size = check_ordinary(path, "FILE", "a text file that can be read").st_size
        if size > MOST_BYTES:
            raise MisuseError("FILE", f"{path} of {size} bytes", f"a text file of at most {MOST_BYTES}")
        try:
            return cls(str(path), path.read_text(encoding="utf-8"))
        except OSError as error:
            raise MisuseError(str(path), error.strerror or "no file", "a text file that can be read") from error
        except UnicodeDecodeError as error:
            raise MisuseError(str(path), "bytes that are no UTF-8 text", "a plain text file") from error

    def next(self, needed: str, *, length: int | None = None) -> Line:
        """Return the next line; raise a MisuseError if there is none, or not of that many words."""
        for line in self.rest():
            if length is not None and len(line.words) != length:
                raise line.error(needed)
            return line
        raise MisuseError(f"{self.name}, line {len(self._lines) + 1}", "the end of the file", needed)

    def rest(self) -> Iterator[Line]:
        """Yield the lines that are left; comments go to `comments`."""
        while self._next < len(self._lines):
            text = self._lines[self._next].strip()
            self._next += 1
            place = f"{self.name}, line {self._next}"
            if text.startswith("#"):
                self.comments.append(Line(place, text.lstrip("# \t").split()))
            elif text:
                yield Line(place, text.split())

    def expect_end(self) -> None:
        """Raise a MisuseError if there is another line."""
        for line in self.rest():
            raise line.error("the end of the file")
