"""The compiled code in a plugin's process, as the system shows it: no plugin can say otherwise. Linux only."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from stat import S_ISREG

from contactverif.contract.foreign_text import one_line

_DIGITS = 16
_MOST = 500  # The number of files that are read.
_LARGEST = 1 << 25  # Bytes. A compiler such as LLVM has more, which would take a third of a second.


def list_libraries(files: Iterable[Path]) -> list[str]:
    """Return name and digest of each of the files whose code this process does not run."""
    paths = sorted({*files} - {*mapped_files("self")})
    return [f"{one_line(path.name)} {_digest(path)}" for path in paths[:_MOST]]


def mapped_files(pid: int | str) -> Iterator[Path]:
    """Yield the files from which a process has mapped code."""
    with suppress(OSError):  # It has ended, or the system has no such folder.
        for line in os.fsdecode(Path(f"/proc/{pid}/maps").read_bytes()).split("\n"):
            _, rights, *_, name = line.split(maxsplit=5) or ("", "", "")
            if "x" in rights and name.startswith("/"):
                yield Path(name)


@cache
def _digest(path: Path) -> str:
    """Return the digest of a file, the size of a large one, or that it is gone."""
    try:
        # A plugin names the file. One that nobody writes to, such as a pipe, would not be read to its end.
        number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW)
    except OSError:
        return "which is gone"
    with os.fdopen(number, "rb") as file:
        facts = os.fstat(number)
        if not S_ISREG(facts.st_mode):
            return "which is no file"
        if facts.st_size > _LARGEST:
            return f"of {facts.st_size} bytes"
        return sha256(file.read(_LARGEST)).hexdigest()[:_DIGITS]
