"""Campaigns that damage files: bytes that are changed on the way, what a command makes of a file, and the table.

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
import tempfile
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

sys.path += [str(Path(__file__).parents[1] / "trust"), str(Path(__file__).parents[2] / "tests")]

from tables import markdown

SECONDS = 60.0  # Far beyond the time that a command takes for a whole file.
MEGABYTES = 1500  # More than twice what a command takes for a whole file.
ENDINGS = ("as before", "other numbers", "one line", "noise", "traceback", "crash", "hang", "memory")
NOTICES = ("Warning: ", "the report names ")  # meshlane says what it skips, and `replay` what it runs.
GOOD = frozenset(ENDINGS[:3])


@dataclass(frozen=True)
class Ending:
    """The end of a command."""

    status: int = 0  # Negative for a signal
    output: str = ""
    errors: str = ""
    megabytes: int = 0  # The most memory that it had

    def word(self, undamaged: Ending) -> str:
        """Return one of `ENDINGS`, beside what the command made of the undamaged file."""
        if self.status < 0:
            return "hang" if self.status == -signal.SIGKILL else "crash"
        if "Traceback" in self.errors or "Error: " in self.errors.split("contactverif: ")[0]:
            return "traceback"
        if self.megabytes > MEGABYTES:
            return "memory"
        lines = [line for line in self.errors.splitlines() if not line.startswith(NOTICES)]
        if self.status == 2:
            clear = len(lines) == 1 and lines[0].startswith("contactverif: ") and "; needed " in lines[0]
            return "one line" if clear and len(lines[0]) < 2000 else "noise"
        if lines or re.search(r"[\x00-\x08\x0b-\x1f\x7f]", self.output.replace("\r\n", "\n")):
            return "noise"
        return "as before" if (self.status, self.output) == (undamaged.status, undamaged.output) else "other numbers"


def run_command(arguments: Sequence[str], seconds: float = SECONDS, main: Callable[[], object] | None = None) -> Ending:
    """Run a command line, or a function, in a fork of this process, which has imported everything."""
    receive, send = os.pipe()
    start, content = time.monotonic(), b""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        os.close(receive)
        _run(arguments, send, main)
    os.close(send)
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
    output, _, errors = content.decode(errors="replace").partition("\x1e")
    return Ending(os.waitstatus_to_exitcode(waited), output, errors, usage.ru_maxrss >> 10)


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
    blocks = whole[second : second + size], whole[first : first + size]
    damaged[first : first + size], damaged[second : second + size] = blocks
    return bytes(damaged[: len(whole)])


def insert(whole: bytes, chance: random.Random) -> bytes:
    """Return the bytes with some more in the middle, or some less."""
    place, size = chance.randrange(len(whole)), chance.choice([1, 8, 300])
    return whole[:place] + (chance.randbytes(size) + whole[place:] if chance.random() < 0.5 else whole[place + size :])


BYTES: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "one bit": lambda whole, chance: flip_bits(whole, chance, 1),
    "twenty bits": flip_bits,
    "one byte": set_byte,
    "cut": cut,
    "a blank block": blank,
    "blocks exchanged": swap_blocks,
    "bytes more or less": insert,
}


class Campaign:
    """Attacks of some kinds in a folder, and how they ended, in one of some words."""

    head, endings, harmful = "damage", ENDINGS, frozenset(ENDINGS) - GOOD
    kinds: Iterable[str]

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.counts: dict[str, Counter[str]] = defaultdict(Counter)

    def attack(self, kind: str, chance: random.Random, name: str = "") -> str:
        """Attack once, count the ending and return it; the name is that of a copy of what does harm."""
        raise NotImplementedError  # Each campaign has an attack of its own.

    def add(self, kind: str, word: str) -> str:
        """Count an ending."""
        self.counts[kind][word] += 1
        return word

    def begin(self) -> None:
        """Attack in the ways that follow from no seed."""

    def harm(self) -> int:
        """Return the number of attacks that did harm."""
        return sum(counts[word] for counts in self.counts.values() for word in self.harmful)

    def text(self) -> str:
        """Return the table in Markdown."""
        total: Counter[str] = sum(self.counts.values(), Counter())
        rows = [
            [kind, *(str(counts[word] or "") for word in self.endings)]
            for kind, counts in {**self.counts, "all": total}.items()
        ]
        return markdown([self.head, *self.endings], rows, "---:").rstrip()

    def judge_file(self, kind: str, ending: Ending, undamaged: Ending, title: str, name: str, content: bytes) -> str:
        """Count how a command ended on a damaged file; keep the file in the folder damaged/ if that did harm."""
        word = self.add(kind, ending.word(undamaged))
        if word in self.harmful:
            print(f"{word}: {kind} {title}\n{ending.errors[-3000:]}", flush=True)
            if name and content:
                copy = Path("damaged") / name
                copy.parent.mkdir(exist_ok=True)
                copy.write_bytes(content)
        return word


def main(make: Callable[[Path], Campaign], count: int = 1000, seed: int = 1) -> None:
    """Run a campaign of COUNT attacks with SEED from the command line; the exit status is 1 if it did harm."""
    count, seed = [*map(int, sys.argv[1:]), *(count, seed)[len(sys.argv) - 1 :]]
    with tempfile.TemporaryDirectory() as folder:
        campaign = make(Path(folder))
        kinds = list(campaign.kinds)
        try:
            campaign.begin()
            for number in range(count):
                campaign.attack(kinds[number % len(kinds)], random.Random(f"{seed}/{number}"), f"{number}-{seed}")
        finally:  # Where Ctrl-C ends it, too.
            print(campaign.text(), flush=True)
    sys.exit(int(bool(campaign.harm())))
