"""The compiled code in a plugin's process, as the system shows it: no plugin can say otherwise. Linux only."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

_DIGITS = 16
_LARGEST = 1 << 25  # Bytes. A compiler such as LLVM has more, which would take a third of a second.


def list_libraries(pid: int) -> list[str]:
    """Return name and digest of each file whose code a process runs, and this process does not."""
    paths = sorted({*_mapped_files(pid)} - {*_mapped_files("self")})
    return [f"{path.name} {_digest(path)}" for path in paths]


def _mapped_files(pid: int | str) -> Iterator[Path]:
    """Yield the files from which a process has mapped code."""
    with suppress(OSError):  # It has ended, or the system has no such folder.
        for line in Path(f"/proc/{pid}/maps").read_text(errors="replace").splitlines():
            _, rights, *_, name = line.split(maxsplit=5)
            if "x" in rights and name.startswith("/"):
                yield Path(name)


@cache
def _digest(path: Path) -> str:
    """Return the digest of a file, the size of a large one, or that it is gone."""
    try:
        if (size := path.stat().st_size) > _LARGEST:
            return f"of {size} bytes"
        return sha256(path.read_bytes()).hexdigest()[:_DIGITS]
    except OSError:
        return "which is gone"
