"""Numbers in sentences are those of the stored files. A number that is changed, on either side, is found."""

import re
from pathlib import Path

import netCDF4
import prose
import pytest
from quotes import ROOT, pages, quotes, unlike

# Numbers to change, each in a stored file: a text and another one; or a group, a variable and an index.
STORED = (
    ("bench/kernels.csv", "\nvts-ppt,10000,0.8748,0.9294", "\nvts-ppt,10000,0.8748,0.9394"),
    ("bench/faces.csv", "\nipctk on faces,10000,24.34,25.06", "\nipctk on faces,10000,24.34,25.16"),
    ("bench/steps.csv", "pattern of the tangent,0.2234,0.1924", "pattern of the tangent,0.2234,0.2924"),
    ("bench/fine_waves.csv", "sts,512,0,475,211668,5", "sts,512,0,475,211668,6"),
    ("bench/scene_work.csv", "accuracy.wavy,4,8,", "accuracy.wavy,4,9,"),
    ("bench/bench.nc", "timing/evaluation_seconds", (17, 5, 0)),
    ("paper/paper.nc", "fig30_convergence/iterations", (0, 0, 1)),
    ("paper/paper.nc", "fig30_convergence/iterations", (3, 1, 1)),
    ("stability/stability.nc", "stability/sweep/value", (0, 7, 0)),
    ("bench/kernels.csv", "\nsts,1000000,1.034,1.253", "\nsts,1000000,1.034,1.553"),
    ("findings/hertz.csv", "soft,nts-ar,2.774e-02", "soft,nts-ar,2.874e-02"),
    ("findings/engines.csv", "engine.mirror,BROKEN PROMISE,94,72,", "engine.mirror,BROKEN PROMISE,94,73,"),
)


def label(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", prose.PAGES, ids=label)
def test_a_number_in_prose_is_that_of_its_source(page: Path) -> None:
    assert not prose.differences(page), "python tests/docs/prose.py writes them"


def test_every_stored_table_names_its_commit() -> None:
    tables = {path.relative_to(prose.REPORTS).as_posix() for path in prose.REPORTS.glob("*/*.csv")}
    named = set(prose.read("commits.csv").table)
    assert {name for name in tables if not name.endswith("_before.csv")} <= named
    for path in prose.REPORTS.glob("*/*.nc"):
        with netCDF4.Dataset(path) as data:
            assert re.fullmatch("[0-9a-f]{40}", data.commit)


@pytest.mark.parametrize(("file", "old", "new"), STORED)
def test_a_stored_number_that_changes_is_found(
    file: str, old: str, new: str | tuple[int, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for path in (*prose.REPORTS.rglob("*.csv"), *prose.REPORTS.glob("*/*.nc")):
        copy = tmp_path / path.relative_to(prose.REPORTS)
        copy.parent.mkdir(exist_ok=True)
        copy.write_bytes(path.read_bytes())
    changed = tmp_path / file
    if isinstance(new, str):
        text = changed.read_text(encoding="utf-8")
        assert text.count(old) == 1
        changed.write_text(text.replace(old, new), encoding="utf-8")
    else:
        with netCDF4.Dataset(changed, "r+") as data:
            data[old][new] = 100 * data[old][new]
    monkeypatch.setattr(prose, "REPORTS", tmp_path)
    assert [line for page in prose.PAGES for line in prose.differences(page)]


def other(text: str) -> str:
    """Return a text whose last digit is another one; a text without digits becomes another word."""
    if not re.search(r"\d", text):
        return f"{text}s"
    return re.sub(r"\d(?=\D*$)", lambda digit: str((int(digit[0]) + 1) % 10), text)


def test_a_number_in_prose_that_changes_is_found() -> None:
    numbers = [
        (page, match) for page in prose.PAGES for match in prose.NUMBER.finditer(page.read_text(encoding="utf-8"))
    ]
    assert len(numbers) >= 10
    for page, match in numbers[:: len(numbers) // 10]:
        text = page.read_text(encoding="utf-8")
        changed = text[: match.start()] + other(match[1]) + text[match.end(1) :]
        assert changed != text == prose.renew(changed)


def test_a_number_on_a_quoted_screen_that_changes_is_found() -> None:
    blocks = [quote.block for page in pages() for quote in quotes(page) if quote.kind == "output"]
    assert len(blocks) >= 10
    for block in blocks:
        *_, number = re.finditer(r"(?<!-)\b\d+(?=\b(?! ?(?:µs|ms|s)\b))", block)
        assert unlike(block, block[: number.start()] + "7" + block[number.start() :])
