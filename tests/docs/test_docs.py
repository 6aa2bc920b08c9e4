"""README.md and the pages of the site say what is so: their commands, quotations, Python, links and names are true.

`test_tutorial.py` runs the tutorial, and `tests/examples` the scripts.
"""

import re
import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import typer.main
from quotes import DOCS, PICTURES, README, ROOT, blocks, commands, excerpt, outputs, pages, quotes, source_block, unlike

import contactverif
from contactverif.cli.app import app
from contactverif.plugins.registry import formulation_names, property_ids

TUTORIAL = DOCS / "tutorial"
QUOTING = [page for page in pages() if any(quote.kind == "output" and not quote.foreign for quote in quotes(page))]
# How commands begin that are shown because they fail, by page.
FAILING = {"docs/concepts/signs.md": "contactverif verify negated"}


def label(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", [page for page in QUOTING if page.parent != TUTORIAL], ids=label)
def test_a_quoted_output_is_what_the_command_prints(page: Path, tmp_path: Path) -> None:
    results = outputs(page, tmp_path)
    for command, finished in results.items():
        fails_again = "replay" in command and re.search(r"now +\S+ +fail", finished.stdout)
        fails = fails_again or command.startswith(FAILING.get(label(page), "never"))
        assert finished.returncode == (1 if fails else 0), f"{command}\n{finished.stdout}{finished.stderr}"
    for quote in (quote for quote in quotes(page) if quote.command):
        assert not unlike(quote.block, excerpt(results[quote.command].stdout, quote.argument))


@pytest.mark.parametrize("page", [page for page in pages() if list(quotes(page))], ids=label)
def test_a_quotation_from_elsewhere_is_the_same_there(page: Path) -> None:
    for quote in quotes(page):
        assert quote.block.strip(), "empty: python tests/docs/quotes.py writes it"
        if quote.kind == "source":
            assert quote.block == source_block(quote.argument)
        elif quote.foreign:
            originals = [other for source in QUOTING for other in quotes(source) if other.command == quote.command]
            lines = {line for other in originals for line in other.block.splitlines()}
            assert set(quote.block.splitlines()) <= lines | {"…", "  …"}


@pytest.mark.parametrize("page", [page for page in pages() if "contactverif " in page.read_text()], ids=label)
def test_every_command_exists_with_its_options(page: Path) -> None:
    group = typer.main.get_command(app)
    for line in commands(page.read_text(encoding="utf-8")):
        for part in line.split("&&"):
            words = shlex.split(part)
            if words and words[0].endswith("contactverif"):
                command = group.commands[words[1]]  # type: ignore[attr-defined]
                command.make_context(words[1], words[2:]).close()


@pytest.mark.parametrize("page", pages(), ids=label)
def test_every_link_leads_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    targets = [target for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text) if not target.startswith("http")]
    generated = ("reference/", "paper/", "project/")  # The site makes these pages; its build checks them.
    missing = [
        target
        for target in targets
        if not (file := (page.parent / target).resolve()).exists()
        and not (DOCS in file.parents and file.relative_to(DOCS).as_posix().startswith(generated))
    ]
    assert not missing


def test_every_path_in_the_text_exists() -> None:
    for page in pages():
        named = re.findall(r"`((?:examples|tests|docs|reports|plugins|properties)/[\w./-]*)`", page.read_text())
        assert not [path for path in named if not (ROOT / path).exists()], page


def test_the_readme_is_short_and_shows_the_mesh_the_class_and_both_commands_first() -> None:
    text = README.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150
    screen = text[: text.index("## What it does")]
    (class_text,) = blocks("python", screen)
    assert "slave   ●" in screen
    assert len(class_text.splitlines()) <= 18
    assert len(blocks("sh", screen)) == 2
    assert "docs/pictures/vts-me.svg" in text


def test_the_first_command_is_made_of_what_is_there() -> None:
    command = blocks("sh", README.read_text(encoding="utf-8"))[0]
    make, install, verify = (shlex.split(part) for part in command.split("&&"))
    assert make == ["python3", "-m", "venv", ".venv"]
    assert install == [".venv/bin/pip", "install", ".[box]"]
    assert verify[:2] == [".venv/bin/contactverif", "verify"]
    assert verify[2] in formulation_names()


# The pages whose Python runs as it stands, and what it prints.
PYTHON = {
    "how-to/jax.md": r"balance\.force pass\nbalance\.moment pass\n(?s:.*)symmetric pass\n(?s:.*)directional pass",
    "how-to/own-mesh.md": r"patch\.flat\.transmission fail",
    "how-to/own-scene.md": r"converged after \d iterations\n(?s:.*)converged after 1\d iterations, rate 0\.1[1-4]",
    "how-to/read-a-report.md": r"balance\.force fail\n(?s:.*)patch\.flat\.transmission pass\n(?s:.*): 0?\.\d",
    "how-to/verify-in-python.md": r"first failure: vts-me(?s:.*)force 0\.\d+, exact(?s:.*)fails as stated +pass",
    "how-to/write-a-property.md": r"",
    "how-to/write-a-problem.md": r"converged",
    "how-to/stability.md": r"",
    "concepts/promises.md": r"",
    "tutorial/faces.md": "balance.force pass\nbalance.moment pass\npatch.flat.nodal pass\n"
    "patch.flat.normal fail\npatch.flat.transmission fail",
}


@pytest.mark.parametrize("name", PYTHON)
def test_the_python_of_a_page_runs(name: str, tmp_path: Path) -> None:
    from quotes import call, prepare

    page = DOCS / name
    prepare(page, tmp_path)
    if name.endswith("read-a-report.md"):
        few = ("-p", "balance.*", "-p", "patch.flat.*", "-p", "projection.*", "--examples", "2")
        verify = ("verify", "vts-ppt", *few, "--seed", "1", "--out", "vts-ppt.nc")
        assert call("contactverif", *verify, folder=tmp_path).returncode == 0
    script = "\n".join(blocks("python", page.read_text(encoding="utf-8")))
    finished = call("python", "-c", script, folder=tmp_path)
    assert finished.returncode == 0, finished.stderr
    assert re.search(PYTHON[name], finished.stdout), finished.stdout


def test_the_property_of_the_how_to_catches_a_formulation_that_is_wrong(tmp_path: Path) -> None:
    page = DOCS / "how-to" / "write-a-property.md"
    namespace: dict[str, object] = {}
    exec(compile(blocks("python", page.read_text(encoding="utf-8"))[0], str(page), "exec"), namespace)
    question = namespace["frictionless"]
    assert isinstance(question, contactverif.Property)

    class Sticky:
        """Right forces, and a hundredth of each along the interface."""

        def __init__(self, *, penalty: float) -> None:
            self.right = contactverif.load_formulation("vts-me").with_penalty(penalty)

        def residual(self, interface, pairing, z):  # type: ignore[no-untyped-def]
            forces = self.right.residual(interface, self.right.pair(interface, z), z)
            across = forces.reshape(-1, 2)[:, ::-1] * [1, -1]
            return forces + 0.01 * across.reshape(-1)

    subjects = [contactverif.load_formulation("vts-me"), contactverif.Subject("sticky", Sticky)]
    right, wrong = contactverif.verify(subjects, [question], examples=10, seed=1).rows
    assert right.verdict is contactverif.Verdict.PASS
    assert wrong.verdict is contactverif.Verdict.FAIL


def test_every_public_name_has_its_place_in_the_reference() -> None:
    text = "\n".join(page.read_text(encoding="utf-8") for page in (DOCS / "reference" / "api").glob("*.md"))
    described = set(re.findall(r"^::: contactverif\.(\w+)$", text, re.MULTILINE))
    assert described == set(contactverif.__all__)


def test_the_page_of_every_property_says_what_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "hooks"))
    from property_pages import property_page

    pages_of = {question.id: property_page(question, ()) for question in contactverif.load_properties()}
    assert pages_of.keys() == set(property_ids())
    titles = ("**Question.**", "**Why it matters.**", "**How it is judged.**", "**Undecided.**")
    assert not [name for name, text in pages_of.items() if any(title not in text for title in titles)]
    assert not [name for name, text in pages_of.items() if "partial(func" in text]
    assert not [name for name, text in pages_of.items() if "**Promised by:** no trait" in text]


@pytest.mark.parametrize("picture", sorted(PICTURES.glob("*.svg")), ids=lambda path: path.stem)
def test_every_picture_is_shown_and_is_a_picture(picture: Path) -> None:
    assert any(f"pictures/{picture.name}" in page.read_text(encoding="utf-8") for page in pages())
    assert ET.parse(picture).getroot().tag.endswith("svg")
