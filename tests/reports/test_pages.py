"""Pages: self-contained, escaped, the same bytes for the same content, and written whole or not at all."""

import os
import re
from dataclasses import replace
from html import unescape
from pathlib import Path
from xml.etree import ElementTree

import jinja2
import numpy as np
import pytest
from handmade_report import small_run
from markupsafe import Markup
from matplotlib.figure import Figure
from page_reader import Page, complaints

from contactverif.contract.errors import MisuseError
from contactverif.contract.result import OPPOSITE_SIGN, percent
from contactverif_reports.html import pages
from contactverif_reports.html import report_page as report_page_module
from contactverif_reports.html.pages import Axis, number, render, strip, svg_inline, ticks, write_page
from contactverif_reports.html.report_page import report_page
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.write import write

EVIL = "<script>alert(1)</script> & \"'"


def figure(title: str = "a title") -> Figure:
    """Return a figure with all that an SVG refers to by an id: a clip path, a marker, a hatch."""
    drawing = Figure(figsize=(3.0, 2.0))
    axes = drawing.add_subplot()
    axes.plot([0, 1, 2], [1, 3, 2], "o-")
    axes.fill_between([0, 1], [1, 1], [2, 2], hatch="//")
    axes.set_title(title)
    return drawing


def page(tmp_path: Path, run: object, name: str = "report.nc") -> str:
    path = tmp_path / name
    write(run, path)  # type: ignore[arg-type]
    return report_page(read_run(path), path)


@pytest.fixture
def child(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add a template that extends the base to the real ones."""
    blocks = "{% block title %}{{ name }}{% endblock %}{% block content %}{{ svgs }}{% endblock %}"
    text = '{% extends "base.html.j2" %}' + blocks
    environment = pages._environment().overlay()
    loaders = [jinja2.DictLoader({"child.html.j2": text}), environment.loader]
    environment.loader = jinja2.ChoiceLoader(loaders)  # type: ignore[arg-type]
    monkeypatch.setattr(pages, "_environment", lambda package: environment)


def test_an_svg_reaches_no_further_than_itself() -> None:
    svg = svg_inline(figure(), "what it shows")
    root = ElementTree.fromstring(svg)
    assert root.tag == "svg"
    assert root.attrib["viewBox"] == "0 0 216 144"
    assert (root.attrib["width"], root.attrib["role"], root.attrib["aria-label"]) == ("100%", "img", "what it shows")
    assert "height" not in root.attrib
    assert not {"style", "metadata", "script"} & {element.tag for element in root.iter()}, "they would touch the page"
    used = set(re.findall(r'(?:url\(|href=")#([^)"]+)', svg))
    assert used == set(re.findall(r'\bid="([^"]+)"', svg)), "every id is referred to, and every reference has its id"
    assert len(used) >= 3
    assert "http" not in svg


def test_the_same_figure_gives_the_same_bytes_and_another_one_other_ids() -> None:
    first, again, other = svg_inline(figure()), svg_inline(figure()), svg_inline(figure("another"))
    assert first == again
    ids = [set(re.findall(r'\bid="([^"]+)"', svg)) for svg in (first, other)]
    assert not ids[0] & ids[1]


def test_text_of_a_figure_is_text_and_escaped() -> None:
    svg = svg_inline(figure(EVIL), EVIL)
    assert "<script" not in svg
    assert EVIL in "".join(ElementTree.fromstring(svg).itertext())


@pytest.mark.usefixtures("child")
def test_a_figure_that_is_there_twice_has_ids_of_its_own_each_time() -> None:
    svg = svg_inline(figure(), "twice")
    html = render("child.html.j2", name=EVIL, svgs=svg + svg)
    assert not complaints(html)
    assert html.count("<svg") == 2
    assert "<script>" not in html
    assert html == render("child.html.j2", name=EVIL, svgs=svg + svg)


@pytest.mark.usefixtures("child")
def test_a_name_that_is_missing_is_an_error() -> None:
    with pytest.raises(jinja2.UndefinedError, match="svgs"):
        render("child.html.j2", name="x")


def test_numbers_as_one_writes_them() -> None:
    values = (1.0, -2.5e-7, 1e-12, 1e100, np.nan, np.inf)
    assert list(map(number, values)) == ["1", "−2.5e−7", "1e−12", "1e100", "–", "∞"]
    assert number(6967.0, 2) == "7e3"


def test_a_page_is_written_whole(tmp_path: Path) -> None:
    target = tmp_path / "page.html"
    write_page(target, "<p>ε̂ ≤ 1</p>\n")
    assert target.read_bytes() == "<p>ε̂ ≤ 1</p>\n".encode()
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]


def test_a_page_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "folder.html").mkdir()
    for name, needed in (
        ("page.pdf", "a name that ends in .html or .htm"),
        ("nowhere/page.html", "a folder that exists"),
        ("folder.html", "the name of a file, FILE.html"),
    ):
        with pytest.raises(MisuseError, match=f"^--page: .*{re.escape(needed)}"):
            write_page(os.fspath(tmp_path / name), "", "--page")


def test_every_template_can_be_read() -> None:
    environment = pages._environment()
    names = environment.list_templates()
    assert {"base.html.j2", "parts.html.j2", "report.html.j2"} <= set(names)
    for name in names:
        environment.get_template(name)


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Return the folder of a report with failures, and its page."""
    folder = tmp_path_factory.mktemp("failing")
    return folder, page(folder, small_run())


def test_the_page_of_a_report_is_sound(failing: tuple[Path, str]) -> None:
    folder, html = failing
    assert not complaints(html)
    path = folder / "report.nc"
    assert html == report_page(read_run(path), path), "the same report gives the same bytes"


def test_the_page_says_what_failed(failing: tuple[Path, str]) -> None:
    text = Page(failing[1]).text
    assert "✗ 1 crash, 1 plugin not loaded. 2 formulations, 3 properties, 13 of 14 random cases decided." in text
    assert "vts-me:n=4 , objectivity: crashed" in text
    assert "mine : not loaded . ModuleNotFoundError: No module named 'mine'" in text.replace("mine: ", "mine : ")
    assert "ZeroDivisionError: at residual" in text
    assert f"--case {'vts-me_n_4.patch.flat.transmission'}" in text


def test_the_page_of_a_run_that_passed(tmp_path: Path) -> None:
    html = page(tmp_path, small_run(passing=True))
    assert not complaints(html)
    text = Page(html).text
    assert "✓ Every promise is kept and every property was judged." in text
    assert "What went wrong" not in text
    assert "smallest meshes" not in text
    assert 'class="matrix"' not in html  # There is one formulation.


def test_numbers_agree_with_the_file(failing: tuple[Path, str]) -> None:
    folder, html = failing
    run = read_run(folder / "report.nc")
    tables = [table for table in Page(html).tables if table.caption.startswith("What ")]
    assert len(tables) == len(run.formulations)
    for name, table in zip(run.formulations, tables, strict=True):
        for line in table.rows[1:]:
            if not any(line[1:]):  # A remark stands below its line.
                assert line[0]
                continue
            row = run.row_of[name, line[0]]
            assert line[2].endswith(str(row.result))
            assert line[3] == (f"{row.judged}/{row.planned}" if row.planned else "–")
            assert line[4] == ("–" if row.contact_share is None else percent(row.contact_share))
            closest = row.closest.number if row.closest is not None else None
            assert line[6:8] == (
                [number(closest.value, 2), f"{closest.sign} {number(closest.tolerance, 2)}"] if closest else ["", ""]
            )


def test_evil_words_stay_words(tmp_path: Path) -> None:
    run = small_run()
    rows = [replace(row, formulation=f"{row.formulation} {EVIL}", reason=EVIL, known=EVIL) for row in run.rows]
    hostile = replace(run, rows=tuple(rows), provided={}, provenance={"command": EVIL, "seed": "1"})
    html = page(tmp_path, hostile)
    assert "<script" not in html
    assert not complaints(html)
    assert EVIL in Page(html).text


def test_many_formulations_are_folded_and_few_counterexamples_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report_page_module, "MOST_FIGURES", 2)
    row = next(row for row in small_run().rows if row.shrunk is not None)
    rows = tuple(replace(row, formulation=f"mine:n={n}") for n in range(9))
    html = page(tmp_path, replace(small_run(), rows=rows, provided={}, not_loaded=()))
    contents = Page(html)
    assert not complaints(html)
    assert "2 of 9 counterexamples are drawn as figures" in contents.text
    assert html.count("data-figure=") == 2
    assert html.count("<pre>") == 7, "the others are drawn in text"
    assert not any(tag == "details" and "open" in attrs for tag, attrs in contents.tags), "nothing of it was unexpected"


def test_a_strip_tells_how_many_keep_the_tolerance() -> None:
    values = np.array([0.0, 1e-9, 0.5, 1.0, 2.0, 1e5, np.inf, np.nan])
    axis = Axis.from_margins([values])
    assert axis.most == 5
    numbers = axis.bins(values[:-1])
    tolerance = -pages.LEAST * 2
    assert (numbers < tolerance).tolist() == [True] * 4 + [False] * 3
    assert numbers[-1] == axis.n_bins - 1 > numbers[-2]
    root = ElementTree.fromstring(strip(values, axis))
    assert root.attrib["aria-label"] == "7 cases, median 1 times, worst infinitely the tolerance"
    kinds = [element.attrib["class"] for element in root.iter("rect")]
    assert kinds == ["within"] * len({*numbers[:4]}) + ["beyond"] * len({*numbers[4:]})


def test_a_strip_of_nothing_is_nothing() -> None:
    axis = Axis.from_margins([np.array([]), np.array([np.nan, 0.0])])
    assert strip(np.array([np.nan]), axis) == Markup("")
    assert axis.most == 2
    ElementTree.fromstring(ticks(axis))


def test_the_bodies_of_a_scene_are_drawn_without_solving_it() -> None:
    from contactverif.problems.catalogue import load_scene
    from contactverif_reports.plot.case_figures import make_outline_figure

    case = load_scene("c").case()
    svg = svg_inline(make_outline_figure(case, 5.4))
    words = "".join(ElementTree.fromstring(svg).itertext())
    assert all(word in words for word in ("slave", "master", "support", "load"))


def test_an_opposite_sign_stands_before_everything_else(tmp_path: Path) -> None:
    html = page(tmp_path, replace(small_run(), opposite_signs=("vts-ppt",)))
    assert OPPOSITE_SIGN in unescape(html)
    assert html.index("your forces have the opposite sign") < html.index("What went wrong")
    assert "1 formulation with the opposite sign" in html
