"""The origin of a run: the commit is that of the code that runs, or nobody says one."""

import subprocess
from importlib import metadata
from pathlib import Path

import pytest

from contactverif.plugins import provenance


@pytest.mark.parametrize("is_working_copy", [True, False])
def test_the_commit_is_that_of_the_working_copy_of_the_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_working_copy: bool
) -> None:
    def git(*words: str) -> str:
        names = ("-c", "user.name=A", "-c", "user.email=a@example.org")
        return subprocess.run(
            ["git", "-C", str(tmp_path), *names, *words], check=True, capture_output=True, text=True
        ).stdout.strip()

    def fail(name: str) -> metadata.Distribution:
        raise metadata.PackageNotFoundError(name)

    git("init", "--quiet")
    (tmp_path / ("pyproject.toml" if is_working_copy else "another.toml")).touch()
    git("add", "--all")
    git("commit", "--quiet", "--message", "Begin")
    monkeypatch.setattr(provenance, "__file__", str(tmp_path / "contactverif" / "run" / "provenance.py"))
    monkeypatch.setattr(metadata, "distribution", fail)
    commit = provenance.collect_provenance(profile="dev", examples=1, seed=1)["commit"]
    assert commit == (git("rev-parse", "HEAD") if is_working_copy else "unknown")


def test_a_run_knows_the_library_that_a_name_loads(tmp_path: Path) -> None:
    library = tmp_path / "mine.so"
    library.write_bytes(b"one")
    name = f"uel:file={library},nodes=3"
    first = provenance.code_digests([name], [])
    assert {f"{provenance.CODE}mine.so", f"{provenance.CODE}contactverif_foreign"} <= first.keys()
    library.write_bytes(b"two")
    changed = {key for key, digest in provenance.code_digests([name], []).items() if digest != first[key]}
    assert changed == {f"{provenance.CODE}mine.so"}
