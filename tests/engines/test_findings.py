"""Every finding has the files that show it: a short script of the code alone, and a control."""

import ast
import re
import sys
from pathlib import Path

import pytest

FINDINGS = Path(__file__).parents[2] / "reports" / "findings"
PAGE = (FINDINGS / "README.md").read_text(encoding="utf-8")
SCRIPTS = re.findall(r"^\| shown by \| \[`\S+`\]\((\S+)\), control \[`\S+`\]\((\S+)\) \|$", PAGE, flags=re.MULTILINE)


def test_there_are_findings_and_each_says_how_it_is_shown() -> None:
    assert len(SCRIPTS) >= 2
    assert PAGE.count("| shown by |") == PAGE.count("| class |") == PAGE.count("| code |")


@pytest.mark.parametrize("name", [name for pair in SCRIPTS for name in pair])
def test_a_script_is_short_and_does_not_need_the_harness(name: str) -> None:
    text = (FINDINGS / name).read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 30
    imports = {node.module for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)}
    assert not [module for module in imports if module and module.startswith("contactverif")]
    for module in imports - {None} - set(sys.stdlib_module_names):
        assert ((FINDINGS / name).parent / f"{module}.py").is_file()


def test_a_shared_model_does_not_need_the_harness_either() -> None:
    for path in FINDINGS.rglob("*.py"):
        assert "contactverif" not in path.read_text(encoding="utf-8")
