"""The compiled files of a plugin, which its process may not write."""

import sys
from importlib.util import cache_from_source
from pathlib import Path

import pytest

from contactverif.plugins.registry import _compile_once


def test_a_plugin_is_compiled_and_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    monkeypatch.syspath_prepend(tmp_path)
    package, module = tmp_path / "own_springs", tmp_path / "own_module.py"
    package.mkdir()
    for source in (package / "__init__.py", package / "part.py", module):
        source.write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    (tmp_path / "own_mistake.py").write_text("no python\n")
    _compile_once(frozenset({"own_springs", "own_module", "own_mistake", "not_there"}))
    for source in (package / "__init__.py", package / "part.py", module):
        assert Path(cache_from_source(source)).exists()
    assert not (tmp_path / "ran").exists()
