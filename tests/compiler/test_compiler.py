"""The store of compiled kernels: what is damaged is compiled again, and where nothing can be written it works, too."""

import importlib.util
import os
import random
import shutil
import sys
from pathlib import Path
from typing import Any

import numba
import pytest
from numba.core import caching

from contactverif.compiler import ARE_KERNELS_COMPILED

pytestmark = pytest.mark.skipif(not ARE_KERNELS_COMPILED, reason="nothing is compiled")
SOURCE = """
from contactverif.compiler import compile_stored

def add(a, b):
    return a + b

add = compile_stored(add, nogil=True)
"""


def _load(folder: Path) -> Any:
    """Import the module anew, as another process would."""
    file = folder / "stored_kernel.py"
    if not file.exists():
        file.write_text(SOURCE)
    spec = importlib.util.spec_from_file_location("stored_kernel", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.add


def _hits(add: Any) -> int:
    assert add(1, 2) == 3
    return sum(add.stats.cache_hits.values())


def _files(folder: Path) -> list[Path]:
    return sorted((folder / "__pycache__").glob("*.nb[ci]"))


def test_a_whole_store_is_used(tmp_path: Path) -> None:
    assert [_hits(_load(tmp_path)) for _ in range(3)] == [0, 1, 1]
    assert len(_files(tmp_path)) == 2


def _truncate(file: Path) -> None:
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def _empty(file: Path) -> None:
    file.write_bytes(b"")


def _scribble(file: Path) -> None:
    content = bytearray(file.read_bytes())
    for place in random.Random(1).sample(range(len(content)), 20):
        content[place] ^= 0xFF
    file.write_bytes(bytes(content))


def _flip_one_bit(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(bytes(content))


def _remove(file: Path) -> None:
    file.unlink()


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_a_damaged_file_is_compiled_again_and_replaced(tmp_path: Path, suffix: str) -> None:
    _hits(_load(tmp_path))
    for damage in (_truncate, _empty, _scribble, _flip_one_bit, _remove):
        (file,) = [file for file in _files(tmp_path) if file.suffix == suffix]
        damage(file)
        assert [_hits(_load(tmp_path)) for _ in range(2)] == [0, 1], damage


def test_a_file_of_numba_without_a_digest_counts_as_absent(tmp_path: Path) -> None:
    _load(tmp_path)
    plain = SOURCE.replace("compile_stored(add, nogil=True)", "numba.njit(cache=True)(add)")
    (tmp_path / "stored_kernel.py").write_text("import numba" + plain)
    assert _hits(_load(tmp_path)) == 0
    (tmp_path / "stored_kernel.py").write_text(SOURCE)
    assert [_hits(_load(tmp_path)) for _ in range(2)] == [0, 1]


CALLED = """
from contactverif.compiler import compile_part

@compile_part
def double(a):
    return 2 * a
"""
CALLING = """
from called_kernel import double
from contactverif.compiler import compile_stored
from number_of_kernel import NUMBER

def _take_back(a):
    return a - NUMBER // 2

def add(a, b):
    return _take_back(double(a) + b)

add = compile_stored(add, nogil=True)
_take_back = compile_stored(_take_back)
"""


def test_a_kernel_is_compiled_again_where_what_it_calls_or_a_number_that_it_reads_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    called, number = tmp_path / "called_kernel.py", tmp_path / "number_of_kernel.py"

    def hits() -> int:
        for name in ("called_kernel", "number_of_kernel"):
            sys.modules.pop(name, None)
        return _hits(_load(tmp_path))

    (tmp_path / "stored_kernel.py").write_text(CALLING)
    called.write_text(CALLED)
    number.write_text("NUMBER = 2")
    assert [hits() for _ in range(2)] == [0, 1]
    called.write_text(CALLED.replace("2 * a", "a + a"))
    importlib.invalidate_caches()
    assert [hits() for _ in range(2)] == [0, 1]
    number.write_text("NUMBER = 3 ")
    assert [hits() for _ in range(2)] == [0, 1]


def test_without_a_folder_to_write_to_kernels_are_compiled_each_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(caching.CacheImpl, "_locator_classes", [])
    assert [_hits(_load(tmp_path)) for _ in range(2)] == [0, 0]
    assert not _files(tmp_path)


def test_a_store_that_cannot_be_written_later_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    add = _load(tmp_path)

    def refuse(*anything: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", refuse)
    assert _hits(add) == 0
    assert not _files(tmp_path)


def test_a_process_with_another_folder_reads_the_usual_store_and_writes_to_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, other = tmp_path / "source", tmp_path / "other"
    folder.mkdir()
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(other))
    assert _hits(_load(folder)) == 0
    assert not _files(folder)
    assert list(other.rglob("*.nbc"))
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    assert _hits(_load(folder)) == 0
    before = {file: file.read_bytes() for file in _files(folder)}
    shutil.rmtree(other)
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(other))
    assert _hits(_load(folder)) == 1
    assert not list(other.rglob("*.nbc"))
    assert {file: file.read_bytes() for file in _files(folder)} == before


def test_the_inside_of_this_numba_is_known() -> None:
    dispatcher = numba.njit(cache=True)(_hits)
    assert type(dispatcher._cache._cache_file) is caching.IndexDataCacheFile
