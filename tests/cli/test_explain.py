"""The command `explain`: every property and every term in 80 columns, as on the site, with the numbers of a case."""

import re
from pathlib import Path

import pytest
from asking import Ask, check_mistake
from rich.cells import cell_len
from subjects import load_property

from contactverif import Traits
from contactverif.cli.console import QuietConsole
from contactverif.cli.explain import TerminalMarkdown
from contactverif.cli.run_screen import COLUMNS as HEADS
from contactverif.contract.result import Result
from contactverif.explanations.property_text import planted_mistakes, smallest_mesh, stated_failures
from contactverif.explanations.terms import symbol_meanings, term_text, term_texts
from contactverif.plugins.registry import load_formulations, property_ids

COLUMNS = 80
INSTALLED = load_formulations()
HOOKS = Path(__file__).parents[2] / "docs" / "hooks"
PARTS = ("Question.", "Why it matters.", "How it is judged.", "Undecided.", "Source.", "Promised by:", "Usual causes:")
WORDS = ("promise", "witness", "kink", "undecided", "idle", "locking", "patch test", "trait", "residual", "NTS")
HEAD_OF_NAME = {  # {name: the head of what it finds}
    **dict.fromkeys(("Traits", "promises", "WITNESSES"), "Trait, promise, witness"),
    "kinks": "Kink",
    "Patch tests": "Patch test",
    "two-passes": "One pass and two passes",
    "Inf-Sup": "inf_sup",
    "Balance.Force": "balance.force",
    "properties": "Property",
    "border": "Free end and border",
    "crossed-diagonals": "crossed-diagonals: 2 slave on 2 master triangles, in space",
}


@pytest.fixture(autouse=True)
def load_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contactverif.cli.explain.load_formulations", lambda limits: INSTALLED)


def words(text: str) -> list[str]:
    return re.sub("[•]", "", text).split()


def in_terminal(markdown: str) -> str:
    console = QuietConsole(COLUMNS)
    with console.capture() as capture:
        console.print(TerminalMarkdown(markdown))
    return capture.get()


@pytest.fixture
def page_of(monkeypatch: pytest.MonkeyPatch):  # type: ignore[no-untyped-def]
    monkeypatch.syspath_prepend(str(HOOKS))
    from property_pages import property_page

    return property_page


@pytest.mark.parametrize("name", property_ids())
def test_a_property_explains_itself_in_80_columns_as_its_page_does(name: str, ask: Ask, page_of) -> None:  # type: ignore[no-untyped-def]
    answer = ask("explain", name)  # Text is folded at 80 columns in a wider terminal, too.
    assert (answer.status, answer.err) == (0, "")
    assert max(map(cell_len, answer.out.splitlines())) <= COLUMNS
    flat = " ".join(words(answer.out))
    assert [part for part in PARTS if part not in flat] == []
    page = page_of(load_property(name), INSTALLED).partition("\n## See also\n")[0]
    page = re.sub(r"\[([\w/-]+)\]\((?:\.\./)+[\w/-]+\.md\)", r"`docs/\1.md`", page)
    assert words(in_terminal(page)) == words(answer.out)


@pytest.mark.parametrize("name", [*WORDS, *HEADS, *(str(result) for result in Result), *symbol_meanings()])
def test_a_word_of_the_screen_is_a_term(name: str, ask: Ask) -> None:
    answer = ask("explain", name, columns=COLUMNS)
    assert answer.status == 0
    assert words(answer.out) == words(in_terminal(term_text(name)))
    assert len(words(answer.out)) > 5


@pytest.mark.parametrize(("name", "head"), HEAD_OF_NAME.items())
def test_a_name_is_found_in_the_plural_and_in_capitals(name: str, head: str, ask: Ask) -> None:
    assert ask("explain", name).out.partition("\n")[0] == head


def test_every_term_has_a_text_in_80_columns_that_ends_like_a_sentence() -> None:
    for name, text in term_texts().items():
        lines = in_terminal(text).rstrip().splitlines()
        assert max(map(cell_len, lines)) <= COLUMNS
        assert lines[-1].rstrip().endswith("."), name
        assert "](" not in "".join(lines), name


def test_without_a_name_the_terms_are_listed(ask: Ask) -> None:
    out = ask("explain", columns=COLUMNS).out
    assert all(word in out.lower() for word in ("witness", "kink", "idle", "ε̂", "conserves_force"))


def test_the_failures_that_are_known_come_from_traits_and_from_the_tables_of_planted_mistakes() -> None:
    assert not [name for name in property_ids() if not planted_mistakes(name)]
    assert "penalty squared" in planted_mistakes("patch.flat.transmission")
    assert smallest_mesh("balance.force").startswith("1 slave segment on 1 of the master, for the mistake “")
    assert smallest_mesh("total-stiffness") == ""
    assert "`vts-me` (`c-prime`)" in stated_failures(load_property("patch.flat.transmission"), INSTALLED)
    assert "No installed" in stated_failures(load_property("purity"), INSTALLED)


def test_the_list_and_an_explanation_say_dimensions(ask: Ask) -> None:
    words = " ".join(ask("list").out.split())
    assert " nts-3d 3-D fails exact tangent" in words
    assert " nts 2-D fails exact tangent" in words
    assert " hard.c 2-D Cases C" in words
    assert " balance.force 2-D, 3-D The forces" in words
    assert "Dimensions: in the plane, and in space, where a segment is a face" in ask("explain balance.force").out
    assert "Dimensions: in the plane\n" in ask("explain hard.c").out


@pytest.fixture
def report(ask: Ask, tmp_path: Path) -> Path:
    path = tmp_path / "nts.nc"
    ask("verify nts -p patch.flat.transmission -p swap -p purity --seed 1 --examples 3 --out", path)
    return path


def test_the_numbers_of_a_case_stand_in_the_tolerance(report: Path, ask: Ask) -> None:
    answer = ask("explain patch.flat.transmission --report", report, columns=COLUMNS)
    flat = " ".join(words(answer.out))
    assert "0.25, must be at most u(8X/|g| + 4N + 128) = 1.11e-16·(8·4/|0.0625| + 4·3 + 128) = 7.24e-14. " in flat
    assert "The worst place: slave node 0" in flat
    assert "slave ●─────2─────●" in flat
    assert f"contactverif replay {report} --case nts.patch.flat.transmission.witness" in answer.out
    by_case = ask("explain --case nts.patch.flat.transmission.witness --report", report, columns=COLUMNS)
    assert by_case == answer


def test_the_screen_of_a_run_says_how_to_have_a_row_explained(report: Path, ask: Ask) -> None:
    out = ask("report", report, columns=COLUMNS).out
    (line,) = [line for line in out.splitlines() if "contactverif explain" in line]
    assert line == f"to have a row explained: contactverif explain patch.flat.transmission --report {report}"
    assert ask(line.partition("contactverif ")[2]).status == 0
    assert "contactverif explain" not in ask("verify nts -p purity --examples 2 --seed 1").out


def test_a_mistake_is_answered_with_what_is_needed(report: Path, ask: Ask) -> None:
    failing = r"needed one of which \S+ has a counterexample: .*swap.*"
    for arguments, message in (
        ("total-stiffness", rf"NAME: found 'total-stiffness'; {failing}"),
        ("", rf"NAME: found nothing; {failing}"),
        ("swap --case nts.swa", r"--case: found 'nts.swa'; needed an id like nts.swap.*"),
        ("kink --case nts.swap.witness", r"NAME: found 'kink'; needed swap, the .*"),
    ):
        check_mistake(ask(f"explain {arguments} --report", report), message)


def test_a_trait_is_explained_by_the_words_of_its_group(ask: Ask) -> None:
    answer = ask("explain", "flat=True", columns=COLUMNS)
    assert answer.status == 0
    assert "Traits(promises=Promises(patch=PatchPromises(flat=" in answer.out
    assert "the master covers the slave" in " ".join(answer.out.split())
    assert all(ask("explain", name).status == 0 for name in Traits().by_name())


def test_a_row_without_a_counterexample_is_explained_with_its_result(report: Path, ask: Ask) -> None:
    answer = ask("explain", "purity", "--report", report)
    assert (answer.status, "\nnts: pass\n" in answer.out) == (0, True)
