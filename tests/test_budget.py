"""The brake: what the project may weigh, package by package and in sum.

Rule for the next editor: a row is raised only if another is lowered in the same commit, and SUM only by an issue that
says so. When a package has become lighter, lower its row: `python tests/test_budget.py` prints the table as it weighs.
"""

import ast
import io
import os
import re
import subprocess
import sys
import tokenize
from pathlib import Path
from typing import NamedTuple

from test_house import PACKAGES, ROOT


class Weight(NamedTuple):
    """The size of some files. A line of code is one that is neither blank nor all comment or docstring."""

    files: int = 0
    lines: int = 0
    code: int = 0


# {package: its folders}
FOLDERS = {
    "contract": ("contactverif/contract",),
    "mechanics": ("contactverif/mechanics", "contactverif/meshes"),
    "cases": ("contactverif/oracle", "contactverif/problems", "contactverif/strategies", "contactverif/sampling"),
    "properties": ("properties",),
    "run": ("contactverif/run", "contactverif/plugins"),
    "isolation": ("contactverif/isolation",),
    "explain": ("contactverif/diagnosis", "contactverif/explanations"),
    "results": ("reports/contactverif_reports", "contactverif/studies"),
    "entry": ("contactverif/cli", "contactverif/api", "contactverif/testing", "contactverif"),
    "compiled": ("contactverif/geometry", "contactverif/autodiff", "contactverif/compiler"),
    "formulations": ("plugins/contactverif_nts", "plugins/contactverif_mortar", "plugins/contactverif_surfaces"),
    "foreign": ("plugins/contactverif_foreign", "plugins/contactverif_engines"),
    "paper": ("reports/contactverif_paper",),
}
# {package: what it may weigh}
BUDGET = {
    "contract": Weight(14, 4941, 2800),
    "mechanics": Weight(20, 4340, 2899),
    "cases": Weight(48, 10430, 6816),
    "properties": Weight(21, 9654, 5852),
    "run": Weight(19, 4238, 3055),
    "isolation": Weight(14, 2846, 2011),
    "explain": Weight(10, 1748, 1341),
    "results": Weight(35, 6582, 4969),
    "entry": Weight(27, 4529, 3219),
    "compiled": Weight(6, 1132, 690),
    "formulations": Weight(25, 7948, 5511),
    "foreign": Weight(20, 3009, 2113),
    "paper": Weight(13, 3203, 2448),
}
SUM = Weight(272, 64600, 43724)
TESTS = 51341  # Lines of tests and evidence.
COMMANDS = 14
WORDS = 40000  # Words of Markdown, without the changelog and the stored results under reports/.
SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


def weigh(path: Path) -> Weight:
    text = path.read_text(encoding="utf-8")
    code = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in SILENT
        for line in range(token.start[0], token.end[0] + 1)
    }
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Module(body=[first, *_]) | ast.ClassDef(body=[first, *_]) | ast.FunctionDef(body=[first, *_]):
                match first:
                    case ast.Expr(value=ast.Constant(value=str())):
                        code -= {*range(first.lineno, (first.end_lineno or 0) + 1)}
    return Weight(1, len(text.splitlines()), len(code))


def total(weights: list[Weight]) -> Weight:
    return Weight(*map(sum, zip(*weights, strict=True))) if weights else Weight()


def package_of(path: Path) -> str:
    """Return the package of a file: that of the longest folder that it lies in."""
    place = path.relative_to(ROOT).as_posix()
    folders = [
        (folder, row) for row, folders in FOLDERS.items() for folder in folders if place.startswith(f"{folder}/")
    ]
    return max(folders, key=lambda pair: len(pair[0]))[1]


def weigh_packages() -> dict[str, Weight]:
    weights: dict[str, list[Weight]] = {row: [] for row in FOLDERS}
    for package in PACKAGES:
        for path in sorted(package.rglob("*.py")):
            weights[package_of(path)].append(weigh(path))
    return {row: total(files) for row, files in weights.items()}


def weigh_tests() -> int:
    return total([weigh(path) for folder in ("tests", "evidence") for path in (ROOT / folder).rglob("*.py")]).lines


def count_words() -> int:
    """Return the words of all Markdown that is kept: they have a letter or a digit. A link to a file counts once."""
    names = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    paths = [ROOT / name for name in names.splitlines() if not name.startswith("reports/") and name != "CHANGELOG.md"]
    texts = [path.read_text(encoding="utf-8") for path in paths if not path.is_symlink()]
    return sum(1 for text in texts for word in text.split() if re.search(r"\w", word))


def too_heavy(weight: Weight, most: Weight) -> bool:
    return any(number > bound for number, bound in zip(weight, most, strict=True))


def test_no_package_is_heavier_than_its_row() -> None:
    heavy = [
        f"{row}: {weight} is more than {BUDGET[row]}"
        for row, weight in weigh_packages().items()
        if too_heavy(weight, BUDGET[row])
    ]
    assert not heavy, f"{heavy}; lower another row in this commit, or make it lighter"


def test_the_rows_add_up_to_no_more_than_the_sum() -> None:
    assert not too_heavy(total([*BUDGET.values()]), SUM)


def test_tests_and_evidence_keep_their_budget() -> None:
    assert weigh_tests() <= TESTS


def test_there_are_few_commands() -> None:
    command = [sys.executable, "-m", "contactverif", "--help"]
    text = subprocess.run(
        command, capture_output=True, text=True, check=True, env=os.environ | {"COLUMNS": "80"}
    ).stdout
    assert 0 < len(re.findall(r"^│ ([a-z]+) ", text.partition("Commands")[2], re.MULTILINE)) <= COMMANDS


def test_the_documents_keep_their_budget() -> None:
    if (ROOT / ".git").exists():
        assert count_words() <= WORDS


def test_a_line_of_code_is_one_that_does_something(tmp_path: Path) -> None:
    file = tmp_path / "a.py"
    file.write_text(
        '"""Doc.\n\nMore.\n"""\n\n# Why.\nx = """a\n\nb"""\n\n\ndef f() -> int:\n    """Doc."""\n    return 1\n'
    )
    assert weigh(file) == Weight(1, 14, 5)


if __name__ == "__main__":
    table = weigh_packages()
    for name, weight in table.items():
        print(f'    "{name}": Weight{tuple(weight)},')
    print(f"SUM = Weight{tuple(total([*table.values()]))}\nTESTS = {weigh_tests()}\nWORDS = {count_words()}")
