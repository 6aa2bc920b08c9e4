"""Damaged files: bytes that are changed on the way, and what a command makes of the file.

Rule for the next editor: everything follows from a seed, so that a file that does harm can be made again.
"""

from __future__ import annotations

import io
import os
import random
import re
import resource
import selectors
import signal
import sys
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass

SECONDS = 60.0  # Far beyond the time that a command takes for a whole file.
MEGABYTES = 1500  # More than twice what a command takes for a whole file.
ENDINGS = ("as before", "other numbers", "one line", "noise", "traceback", "crash", "hang", "memory")
NOTICES = ("Warning: ", "the report names ")  # meshio says what it skips, and `replay` what it runs.
GOOD = frozenset(ENDINGS[:3])


@dataclass(frozen=True)
class Ending:
    """The end of a command."""

    status: int  # Negative for a signal
    output: str
    errors: str
    seconds: float
    megabytes: int  # The most memory that it had

    def word(self, undamaged: Ending) -> str:
        """Return one of `ENDINGS`, beside what the command made of the undamaged file."""
        if self.status == -signal.SIGKILL:
            return "hang"
        if self.status < 0:
            return "crash"
        if "Traceback" in self.errors or "Error: " in self.errors.split("contactverif: ")[0]:
            return "traceback"
        if self.megabytes > MEGABYTES:
            return "memory"
        if self.status == 2:
            lines = [line for line in self.errors.splitlines() if not line.startswith(NOTICES)]
            clear = len(lines) == 1 and lines[0].startswith("contactverif: ") and "; needed " in lines[0]
            return "one line" if clear and len(lines[0]) < 2000 else "noise"
        expected = all(line.startswith(NOTICES) for line in self.errors.splitlines())
        if not expected or re.search(r"[\x00-\x08\x0b-\x1f\x7f]", self.output.replace("\r\n", "\n")):
            return "noise"
        return "as before" if (self.status, self.output) == (undamaged.status, undamaged.output) else "other numbers"


def run_command(arguments: Sequence[str], seconds: float = SECONDS, main: Callable[[], object] | None = None) -> Ending:
    """Run a command line, or a function, in a fork of this process, which has imported everything."""
    receive, send = os.pipe()
    start = time.monotonic()
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        os.close(receive)
        _run(arguments, send, main)
    os.close(send)
    content = b""
    with selectors.DefaultSelector() as selector:
        selector.register(receive, selectors.EVENT_READ)
        while True:
            left = start + seconds - time.monotonic()
            if left <= 0 or not selector.select(left):
                os.kill(child, signal.SIGKILL)
                break
            chunk = os.read(receive, 1 << 20)
            if not chunk:
                break
            content += chunk
    os.close(receive)
    _, waited, usage = os.wait4(child, 0)
    status = os.waitstatus_to_exitcode(waited)
    output, _, errors = content.decode(errors="replace").partition("\x1e")
    return Ending(status, output, errors, time.monotonic() - start, usage.ru_maxrss >> 10)


def _run(arguments: Sequence[str], send: int, main: Callable[[], object] | None) -> None:
    """Run the command, send what it writes, and end with its status."""
    if main is None:
        from contactverif.cli.app import main
    status, output, errors = 1, io.StringIO(), io.StringIO()
    try:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        sys.argv = ["contactverif", *arguments]
        with redirect_stdout(output), redirect_stderr(errors):
            try:
                main()
                status = 0
            except SystemExit as end:
                status = end.code if isinstance(end.code, int) else 1
            except BaseException:
                traceback.print_exc()
        view = memoryview(f"{output.getvalue()}\x1e{errors.getvalue()}".encode(errors="replace"))
        while view:
            view = view[os.write(send, view) :]
    finally:
        os._exit(status)


def flip_bit(whole: bytes, chance: random.Random) -> bytes:
    """Return the bytes with one bit changed."""
    return flip_bits(whole, chance, 1)


def flip_bits(whole: bytes, chance: random.Random, count: int = 20) -> bytes:
    """Return the bytes with some bits changed."""
    damaged = bytearray(whole)
    for _ in range(count):
        damaged[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
    return bytes(damaged)


def set_byte(whole: bytes, chance: random.Random) -> bytes:
    """Return the bytes with one byte at the least or the largest, as in numbers that lie."""
    place = chance.randrange(len(whole))
    return whole[:place] + chance.choice([b"\x00", b"\x7f", b"\x80", b"\xff"]) + whole[place + 1 :]


def cut(whole: bytes, chance: random.Random) -> bytes:
    """Return the beginning: often a whole number of blocks of a disk."""
    place = chance.randrange(len(whole))
    return whole[: place - place % chance.choice([1, 1, 512, 4096])]


def blank(whole: bytes, chance: random.Random) -> bytes:
    """Return the bytes with a block of zeros or of ones."""
    size = min(chance.choice([8, 64, 512, 4096]), len(whole))
    place = chance.randrange(len(whole) - size + 1)
    return whole[:place] + chance.choice([b"\x00", b"\xff"]) * size + whole[place + size :]


def swap_blocks(whole: bytes, chance: random.Random) -> bytes:
    """Return the bytes with two blocks exchanged."""
    size = min(chance.choice([8, 64, 512]), len(whole) // 2)
    first, second = sorted(chance.randrange(len(whole) // size) * size for _ in range(2))
    damaged = bytearray(whole)
    damaged[first : first + size], damaged[second : second + size] = (
        whole[second : second + size],
        whole[first : first + size],
    )
    return bytes(damaged[: len(whole)])


def insert(whole: bytes, chance: random.Random) -> bytes:
    """Return the bytes with some more in the middle, or some less."""
    place, size = chance.randrange(len(whole)), chance.choice([1, 8, 300])
    return whole[:place] + (chance.randbytes(size) + whole[place:] if chance.random() < 0.5 else whole[place + size :])


BYTES: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "one bit": flip_bit,
    "twenty bits": flip_bits,
    "one byte": set_byte,
    "cut": cut,
    "a blank block": blank,
    "blocks exchanged": swap_blocks,
    "bytes more or less": insert,
}


class Table:
    """The counts: for each kind of damage how often a command ended how, in one of some words."""

    def __init__(self, head: str = "damage", endings: Sequence[str] = ENDINGS) -> None:
        self.head, self.endings = head, endings
        self.counts: dict[str, Counter[str]] = defaultdict(Counter)

    def add(self, kind: str, word: str) -> None:
        """Count an ending."""
        self.counts[kind][word] += 1

    def text(self) -> str:
        """Return the table in Markdown."""
        lines = [f"| {self.head} | {' | '.join(self.endings)} |", "|---|" + "---:|" * len(self.endings)]
        total: Counter[str] = sum(self.counts.values(), Counter())
        for kind, counts in {**self.counts, "all": total}.items():
            lines.append(f"| {kind} | {' | '.join(str(counts[word] or '') for word in self.endings)} |")
        return "\n".join(lines)
