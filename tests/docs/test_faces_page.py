"""The page "From segments to faces" quotes what its commands print; `test_docs.py` runs its Python."""

from pathlib import Path

from quotes import DOCS, blocks, excerpt, outputs, quotes

PAGE = DOCS / "tutorial" / "faces.md"


def test_the_counterexample_is_what_the_command_prints(tmp_path: Path) -> None:
    (quote,) = (quote for quote in quotes(PAGE) if quote.kind == "output")
    finished = outputs(PAGE, tmp_path, ("--examples", "5"))[quote.command]
    assert finished.returncode == 0, finished.stderr
    # Fewer cases show the same witness.
    assert quote.block == excerpt(finished.stdout, quote.argument)


def test_the_quoted_verdicts_are_those_that_its_python_must_print() -> None:
    from test_docs import PYTHON

    assert blocks("text", PAGE.read_text(encoding="utf-8"))[0].strip() == PYTHON["tutorial/faces.md"]
