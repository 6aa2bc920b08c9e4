"""The compiled code of a process is listed whatever the process has named it."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from contactverif.isolation.process import mapped_files
from contactverif.isolation.remote import list_libraries

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux shows what a process has mapped")
MAPS = """
import mmap, sys

for name in sys.argv[1:]:
    with open(name, "r+b") as file:
        globals()[name] = mmap.mmap(file.fileno(), 4096, prot=mmap.PROT_READ | mmap.PROT_EXEC)
print("mapped", flush=True)
input()
"""


@pytest.fixture
def mapping(tmp_path: Path) -> Iterator[tuple[int, Path, Path]]:
    """Yield the number of a process that has mapped two files as code, and the files."""
    usual, odd = tmp_path / "usual.so", tmp_path / "a\x0bb\rc.so"
    for file in (usual, odd):
        file.write_bytes(b"x" * 4096)
    command = [sys.executable, "-c", MAPS, str(usual), str(odd)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"mapped\n"
        yield process.pid, usual, odd
        process.kill()


def test_a_name_may_have_any_characters(mapping: tuple[int, Path, Path]) -> None:
    pid, _, _ = mapping
    names = [line.split()[0] for line in list_libraries(mapped_files(pid)) if ".so" in line]
    assert {"usual.so", r"a\x0bb\rc.so"} <= set(names)


@pytest.mark.parametrize("kind", ["pipe", "endless"])
def test_what_has_no_end_is_not_read(mapping: tuple[int, Path, Path], kind: str) -> None:
    """A plugin may put a pipe, or a link to a device, where the file was."""
    pid, usual, _ = mapping
    usual.unlink()
    other = Path(f"{usual} (deleted)")  # So the system names the file that was deleted.
    if kind == "pipe":
        os.mkfifo(other)
    else:
        other.symlink_to("/dev/zero")
    (line,) = (line for line in list_libraries(mapped_files(pid)) if line.startswith("usual.so"))
    assert line in ("usual.so (deleted) which is no file", "usual.so (deleted) which is gone")
