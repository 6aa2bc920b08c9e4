"""Every notebook in `examples/` runs from above to below and shows what it says; it is stored without outputs."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples").glob("*.ipynb"))
# {notebook: patterns that what it shows must match}
PROMISES = {
    "compare_two_formulations": [
        r"patch\.flat\.transmission\s+fails as stated\s+pass",
        r"vts-me: largest error \de\+\d\d tolerances",
        r"vts-ppt: largest error \de-\d\d tolerances",
    ],
    "mend_a_formulation": [
        r"Draft: .*shape functions",
        r"force of the formulation(?s:.*)Mended: 2 pass",
    ],
}
# A process of its own: the libraries of Jupyter warn, and here every warning is an error.
EXECUTE = """
import sys, nbformat
from nbclient import NotebookClient
notebook = nbformat.read(sys.argv[1], as_version=4)
NotebookClient(notebook, timeout=240, kernel_name="python3", resources={"metadata": {"path": "."}}).execute()
nbformat.write(notebook, "executed.ipynb")
"""


def read(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def texts(notebook: Any) -> str:
    """Return what the cells of a notebook show, as words or as HTML."""
    words = []
    for cell in notebook["cells"]:
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            words += [
                "".join(output.get("text", "")),
                *("".join(data.get(f"text/{kind}", "")) for kind in ("plain", "html")),
            ]
    return "\n".join(words)


def test_each_notebook_has_a_promise() -> None:
    assert {path.stem for path in NOTEBOOKS} == set(PROMISES)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_shows_what_it_says(path: Path, tmp_path: Path) -> None:
    finished = subprocess.run(
        [sys.executable, "-c", EXECUTE, str(path)], cwd=tmp_path, capture_output=True, encoding="utf-8", timeout=500
    )
    assert finished.returncode == 0, finished.stderr
    words = texts(read(tmp_path / "executed.ipynb"))
    for pattern in PROMISES[path.stem]:
        assert re.search(pattern, words), f"{pattern!r} is not in:\n{words}"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_stored_without_outputs_and_uses_public_names(path: Path) -> None:
    cells = read(path)["cells"]
    codes = [cell for cell in cells if cell["cell_type"] == "code"]
    assert "".join(cells[0]["source"]).startswith("# ")
    assert not [cell for cell in codes if cell["outputs"] or cell["execution_count"] is not None]
    modules = re.findall(r"^(?:from|import) (contactverif\S*)", "\n".join("".join(c["source"]) for c in codes), re.M)
    assert set(modules) == {"contactverif"}
