"""Names, messages and files of strangers in the terminal: nothing of them is obeyed, in tables, errors or bars."""

import io
import json
from dataclasses import replace
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from asking import Answer, Ask
from foreign_texts import TEXTS, hidden_characters
from handmade_run import run_with
from rich.progress import Progress

from contactverif import Case, Interface
from contactverif.cli import console
from contactverif.cli.progress import Bar
from contactverif_reports.netcdf.write import write
from contactverif_reports.tables import Column, Table

PLUGIN = """
import json, pathlib
import numpy as np
TEXTS = json.loads(pathlib.Path(__file__).with_suffix(".json").read_text())

class Loud:
    def __init__(self, *, penalty): self.penalty = penalty
    def residual(self, interface, pairing, z): raise NotImplementedError

def make(name):
    def factory(*, penalty, word: str = "a"):
        loud = Loud(penalty=penalty)
        loud.residual = lambda interface, pairing, z: fail(name)
        return loud
    return factory

def fail(name):
    kind = TEXTS[name].replace("\\0", "0").encode("ascii", "backslashreplace").decode()
    raise type(kind[:50], (Exception,), {})(TEXTS[name])

""" + "".join(f"loud_{name} = make({name!r})\n" for name in TEXTS)


@pytest.fixture
def strangers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Install plugins that raise each of the texts, one whose name is an escape sequence, and one that cannot load."""
    (tmp_path / "loud_plugin.py").write_text(PLUGIN)
    (tmp_path / "loud_plugin.json").write_text(json.dumps(TEXTS))
    info = tmp_path / "loud-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: loud\nVersion: 1.0\n")
    entries = [f"loud-{name} = loud_plugin:loud_{name}" for name in TEXTS]
    entries += ["loud-\x1b[31m = loud_plugin:loud_escape", "a[/bold]loud = loud_plugin:loud_markup"]
    entries += ["loud-absent = loud_plugin:\x1b[31m"]
    (info / "entry_points.txt").write_text("[contactverif.formulations]\n" + "\n".join(entries) + "\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))


def _check(answer: Answer) -> None:
    assert not hidden_characters(answer.out), ascii(answer.out)[:500]
    assert not hidden_characters(answer.err), ascii(answer.err)[:500]
    assert not answer.out.startswith("Every promise is kept")
    assert len(answer.out) + len(answer.err) < 200_000
    assert "Traceback" not in answer.err


@pytest.mark.usefixtures("strangers")
def test_the_list_shows_hostile_names_and_reasons_escaped(ask: Ask) -> None:
    for answer in (ask("list"), ask("list --traits", columns=20)):
        _check(answer)
        assert answer.status == 0
        assert r"loud-\x1b[31m" in answer.out.replace("\n", "")


@pytest.mark.usefixtures("strangers")
def test_messages_of_exceptions_are_shown_escaped_and_cut(ask: Ask, tmp_path: Path) -> None:
    answer = ask("verify", *[f"loud-{name}" for name in TEXTS], "-p", "balance.force", "--examples", "2",
                 "--out", tmp_path / "a.html", "--pictures", tmp_path / "pictures")  # fmt: skip
    _check(answer)
    assert answer.status == 1
    assert r"\x1b[31mred" in answer.out
    assert "[bold red]a[/x]" in answer.out
    assert ":warning:" in answer.out
    assert "(300000 characters)" in " ".join(answer.out.split())
    page = (tmp_path / "a.html").read_bytes().decode("utf-8")
    assert not hidden_characters(page)
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert" in page


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_an_error_is_one_clean_line_whatever_the_user_typed(ask: Ask, text: str) -> None:
    words = {
        "verify": (text, f"vts-me:n={text}", f"vts-me:{text}=1", f"two-pass/{text}"),
        "verify nts -p": (text,),
        "verify nts --out": (f"{text}.xyz", f"no/{text}.nc"),
        "verify nts --scene": (text,),
        "verify nts --profile": (text,),
        "verify nts --known": (f"{text}=1",),
        "verify nts": (f"--{text}",),
        "replay": (text,),
        "report": (f"{text}.nc",),
        "draw --scene": (text,),
        "": (text,),
    }
    for line, typed in ((line, word) for line, each in words.items() for word in each):
        answer = ask(line, typed)
        _check(answer)
        assert answer.status == 2, line
        assert answer.err.count("\n") == 1, line
        assert len(answer.err) < 2500


def _loud_report(path: Path, text: str) -> None:
    """Write a report, then put the text into its attributes and strings as a stranger's program may."""
    interface = Interface.from_chains(slave=[[0, 0], [1, 0]], master=[[2, 0], [-1, 0]])
    case = Case(interface, np.array([0, -0.1, 1, -0.1, 2, 0, -1, 0]), penalty=100.0)
    run = run_with(case, "nts", "balance.force")
    write(replace(run, provenance={**run.provenance, "profile": "dev", "examples": "1"}), path)
    with netCDF4.Dataset(path, "a") as file:
        for name in ("command", "seed", "profile", "examples", "platform"):
            file.setncattr(name, text)
        file["summary"]["reason"][0, 0] = text


@pytest.mark.parametrize("name", ["escape", "lines", "markup", "html", "formula"])
def test_a_report_with_hostile_attributes_is_shown_escaped(ask: Ask, tmp_path: Path, name: str) -> None:
    _loud_report(tmp_path / "loud.nc", TEXTS[name])
    _check(ask("report", tmp_path / "loud.nc"))
    _check(ask("replay", tmp_path / "loud.nc"))
    _check(ask("report", tmp_path / "loud.nc", "--out", tmp_path / "loud.html"))
    page = (tmp_path / "loud.html").read_bytes().decode("utf-8")
    assert not hidden_characters(page)
    assert "<script>alert" not in page
    _check(ask("draw", tmp_path / "loud.nc", "--case", "nts.balance.force", "--out", tmp_path / "a.svg"))


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_the_last_guard_escapes_what_came_another_way(
    text: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    table = Table([Column(text)], text)
    table.add(text)
    console.show(table.terminal(), text)
    console.show_verbatim(console.Text(text))
    console.echo(text)
    assert not hidden_characters(capsys.readouterr().out)


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_a_progress_bar_neither_obeys_nor_interprets_a_name(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with Bar() as bar:
        screen = io.StringIO()
        columns = bar._progress.columns
        bar._progress = Progress(*columns, console=console.Console(file=screen, force_terminal=False, width=400))
        bar.update(text, 1, 2)
        bar._progress.console.print(bar._progress.get_renderable())
    line = screen.getvalue()
    assert not hidden_characters(line)
    if text == TEXTS["markup"]:
        assert "[bold red]a[/x]" in line
