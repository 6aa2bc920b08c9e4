"""What README.md says is so: its code, commands, tables and links. `test_external.py` runs its tutorial."""

from __future__ import annotations

import ast
import re
import shlex
from pathlib import Path

import pytest

from contactverif.cli import app as cli
from contactverif.contract.property import Verdict
from contactverif.run.registry import formulation_names, load_formulation, load_properties, property_ids
from contactverif.run.runner import run
from contactverif_reports.netcdf.write import write

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
MINE = ROOT / "tests" / "external" / "contactverif-mine"

_ROW = re.compile(r"  (\S+) +(passes|fails|–) +(\w+(?: \w+)*?) +(?:–|\d+/\d+)(?=\s|$)")


def blocks(language: str, text: str = README) -> list[str]:
    """The code blocks of a language, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def section(title: str) -> str:
    """What stands below a heading, up to the next that is as high."""
    level = title.split()[0]
    found = re.search(rf"^{re.escape(title)}$(.*?)(?=^#{{2,{len(level)}}} |\Z)", README, re.MULTILINE | re.DOTALL)
    assert found, f"README.md has no heading {title!r}"
    return found[1]


def rows(printed: str) -> list[tuple[str, str, str]]:
    """(property, promise, verdict) of every line of the tables in a text."""
    return _ROW.findall(printed)


def classes() -> dict[str, str]:
    """The classes of the tutorial's file, as they are written; what stands before them belongs to the first."""
    source = (MINE / "mine.py").read_text(encoding="utf-8")
    lines = source.splitlines(keepends=True)
    found = [node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)]
    starts = [0, *(node.lineno - 1 for node in found[1:])]
    return {node.name: "".join(lines[start : node.end_lineno]) for start, node in zip(starts, found, strict=True)}


def test_the_tutorial_is_the_external_project() -> None:
    tutorial = section("## Your own formulation, step by step")
    written = (MINE / "test_mine.py").read_text(encoding="utf-8")
    assert blocks("python", tutorial) == [*classes().values(), written]
    assert blocks("toml", tutorial) == [(MINE / "pyproject.toml").read_text(encoding="utf-8")]
    whole = "\n\n\n".join(block.rstrip("\n") for block in classes().values()) + "\n"
    assert whole == (MINE / "mine.py").read_text(encoding="utf-8"), "pasted one below the other they are the file"


def test_the_first_command_is_made_of_what_is_there() -> None:
    (command,) = blocks("sh", section("## Run"))
    make, install, verify = (shlex.split(part) for part in command.split("&&"))
    assert make == ["python3", "-m", "venv", ".venv"]
    assert install == [".venv/bin/pip", "install", "."]
    assert verify[:2] == [".venv/bin/contactverif", "verify"]
    assert verify[2] in formulation_names()
    assert verify[3] == "--out"


@pytest.mark.parametrize("title", ["## Run", "## What a counterexample looks like"])
def test_a_table_is_what_the_command_prints(
    title: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (command,), (shown, *_) = blocks("sh", section(title)), blocks("text", section(title))
    arguments = shlex.split(command.split("&&")[-1])[1:]
    monkeypatch.chdir(tmp_path)
    seeded = arguments if "--seed" in arguments else [*arguments, "--seed", "1"]  # with 5, one undecided is too many
    monkeypatch.setattr("sys.argv", ["contactverif", *seeded, "--examples", "5"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    printed = capsys.readouterr().out
    assert ended.value.code == 0
    assert rows(shown) == rows(printed) != []
    assert shown.splitlines()[-2:] == printed.splitlines()[-2:]
    if "contactverif replay" in shown:
        again = next(line for line in shown.splitlines() if "contactverif replay" in line)
        assert again in printed.splitlines()
        assert again.strip() in README.replace(f"{again}\n", ""), "the prose asks another formulation the same"


def test_the_comparison_is_what_the_command_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    title = "## Compare with VTS-PPT"
    command, _ = blocks("sh", section(title))
    (shown,) = blocks("text", section(title))
    monkeypatch.setenv("COLUMNS", "140")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [*shlex.split(command), "--examples", "5", "--out", "c.html"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    printed = capsys.readouterr().out
    assert ended.value.code == 0
    assert (tmp_path / "c.html").exists()
    verdicts = re.compile(
        rf"^  ((?:{'|'.join(map(re.escape, property_ids()))}) {{2,}}\S.*?(?:pass|fail|applicable)) *$", re.MULTILINE
    )
    assert verdicts.findall(shown) == verdicts.findall(printed)
    assert len(verdicts.findall(shown)) == len(property_ids())
    assert shown.splitlines()[-1] == printed.splitlines()[-1].rstrip()


def test_every_table_is_of_the_right_shape() -> None:
    shown = [block for block in blocks("text") if "judged" in block]
    assert len(shown) == 5
    for block in shown:
        assert re.match(r"profile dev, 100 examples a property, seed \d+\n\n  property +promise +verdict ", block)
        assert "every promise kept, every property judged" in block
        found = rows(block)
        assert found
        assert {name for name, _, _ in found} <= set(property_ids())
        assert {verdict for _, _, verdict in found} <= {str(verdict) for verdict in Verdict}


def test_examples_in_python_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(run([load_formulation("vts-ppt")], load_properties(["*"]), examples=2, seed=1), "vts-ppt.nc")
    (example,) = blocks("python", section("## Reading a report"))
    exec(compile(example, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "patch.flat.transmission pass" in printed
    assert "balance.force fail" in printed
    assert 0 < float(printed.rpartition(":")[2]) <= 1


def test_the_example_of_a_scene_runs(capsys: pytest.CaptureFixture[str]) -> None:
    title = "## Bodies: the patch test solved, Newton's order, pictures"
    (example,) = blocks("python", section(title))
    exec(compile(example, "README.md", "exec"), {})
    words, rate = capsys.readouterr().out.split(" after ")
    assert words == "converged"
    assert 0.11 < float(rate.split()[-1]) < 0.14


def test_what_it_points_to_is_there() -> None:
    told = [*re.findall(r"\]\(([^)#]+)\)", README), *re.findall(r"`((?:[\w.-]+/)+[\w-]+\.\w+)`", README)]
    missing = [path for path in told if not path.startswith((".venv", "http")) and not (ROOT / path).exists()]
    assert told
    assert not missing
    assert shlex.split(blocks("sh", section("## Your own mesh"))[0])[4] == "tests/data/punch.msh"
