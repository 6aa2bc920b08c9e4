"""Single items of the paper: numbers that the page states, each checked by itself, and an item that is made up here."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from contactverif.mechanics import newton
from contactverif.mechanics.newton import End
from contactverif.problems import catalogue
from contactverif.run.worker_pool import worker_pool
from contactverif_paper import (
    appendix_a,
    lagrange_multipliers,
    paper_formulations,
    patch_tests,
    tangents,
)
from contactverif_paper.example_2 import mesh_lines, thin_out
from contactverif_paper.figure_style import new_panels, render_figure
from contactverif_paper.items import ITEMS, compute, steps
from contactverif_paper.paper_formulations import subject_of
from contactverif_paper.paper_item import Agreement, Column, Item, PageTable, PaperFigure, Statement
from contactverif_paper.paper_page import tree_of, write

# --- A new item is one registration ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Eggs:
    count: Annotated[int, Column("", "1", "number of eggs", name="eggs")]


def plot_eggs(eggs: Eggs) -> Figure:
    figure, (axes,) = new_panels(2.0, 1)
    axes.plot([0, 1], [0, eggs.count])
    return figure


EGGS = Item(
    name="eggs",
    title="An item that a test made up",
    compute=lambda: Eggs(42),
    statements=lambda eggs: (
        Statement("Fig. 99", "there are 42 eggs", f"{eggs.count} eggs", Agreement.decide(eggs.count == 42), "fig99"),
        Statement("Fig. 99", "all are white", "one is not", Agreement.CONDITIONAL, "", "the brown one is not counted"),
    ),
    figures=(PaperFigure("fig99", "A figure that a test made up.", plot_eggs),),
    tables=lambda eggs: (PageTable.of_numbers("Eggs by colour", ("Colour", "Count"), [("white", str(eggs.count))]),),
    choices={"Eggs": "hard-boiled"},
)


def test_an_item_is_found_on_the_page_in_the_numbers_and_among_the_figures(tmp_path: Path) -> None:
    (with_code,) = [item for item in ITEMS if item.name == "case_a1"]
    items = (with_code, EGGS)  # The registration.
    reported: list[str] = []
    paths = write(compute(reported.append, items=items), tmp_path, reported.append)
    assert len(reported) == steps(items=items)
    assert {path.name for path in paths} == {"paper.nc", "fig09.svg", "fig10.svg", "fig99.svg", "paper.html"}
    tree = xr.open_datatree(tmp_path / "paper.nc").load()
    assert int(tree["eggs"]["eggs"]) == 42
    text = (tmp_path / "paper.html").read_text(encoding="utf-8")
    for words in (
        "An item that a test made up",
        "There are 42 eggs",
        "A figure that a test made up.",
        "Eggs by colour",
        "Hard-boiled",
        "the brown one is not counted",
        'id="fig99"',
    ):
        assert words in text


def test_no_generic_file_names_an_item() -> None:
    folder = Path(compute.__code__.co_filename).parent
    names = {item.name for item in ITEMS} | {figure.name for item in ITEMS for figure in item.figures}
    for path in ("paper_item.py", "paper_page.py", "templates/paper.html.j2"):
        text = (folder / path).read_text(encoding="utf-8")
        assert not {name for name in names if name in text}, path


def test_two_items_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="two items"):
        write(compute(items=(EGGS, EGGS)), tmp_path)


def test_a_condition_goes_with_its_verdict() -> None:
    with pytest.raises(ValueError, match="needs a condition"):
        Statement("Fig. 1", "claim", "result", Agreement.CONDITIONAL)
    assert not Statement("Fig. 1", "claim", "result", Agreement.AGREES, "", "on Sundays").condition


# --- Case A2, Figs. 21 and 22 -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["a2-uniform", "a2-graded"])
def test_case_a2_is_as_wide_as_the_printed_axis(name: str) -> None:
    nodes = catalogue.make_scene(name).interface.nodes[:, 0]
    assert (nodes.min(), nodes.max()) == (-5.0, 5.0)


def test_vts_me_cycles_on_case_c_and_converges_beside_it() -> None:
    ends = {}
    for name in patch_tests.SCENES:
        scene = catalogue.make_scene(name, penalty=patch_tests.PATCH_C.stiffness * patch_tests.YOUNG)
        ends[name] = newton.solve(scene, subject_of(paper_formulations.VTS_ME).for_case(scene.case())).end
    assert ends == {"c": End.CYCLE, "c-prime": End.CONVERGED}


# --- Fig. 30 ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def convergence() -> tangents.Convergence:
    return tangents.FIG_30.compute()


def test_rates_of_the_basic_version_are_the_known_ones(convergence: tangents.Convergence) -> None:
    assert np.abs(convergence.rate / convergence.radius - 1).max() < 0.06  # A rate of 0.03 leaves few residuals.
    assert (np.diff(convergence.radius) > 0).all()


def test_iterations_of_fig_30_by_stopping_rule(convergence: tangents.Convergence) -> None:
    basic = convergence.counts(paper_formulations.BASIC)
    assert basic[0].tolist() == [14, 15]  # Stopped at the residual's own roundoff.
    assert basic[:3].min() <= tangents.PRINTED_ITERATIONS <= basic[:3].max()
    assert (np.diff(basic[:3], axis=0) >= 0).all()
    assert convergence.counts(paper_formulations.VTS_PPT)[0].max() <= 5
    assert convergence.counts(paper_formulations.VTS_ME)[0].max() <= 5
    first, _, _ = tangents.FIG_30.statements(convergence)
    assert first.agreement is Agreement.CONDITIONAL
    assert "18 decades" in first.claim
    low, high = tangents.AXIS
    assert round(float(np.log10(high / low))) == 18


# --- Sections 6.2 and 6.3 ---------------------------------------------------------------------------------------


def test_tangents() -> None:
    result = tangents.SECTION_6_2.compute()
    rows = {formulation.name: row for row, formulation in enumerate(tangents.TANGENT_FORMULATIONS)}
    exact = [rows[name] for name in ("vts-me", "vts-ppt", "sts")]
    assert result.error[exact].max() <= 1e-14
    assert result.error[rows["vts-ppt-basic"]] > 1e-2
    assert result.order[exact] == pytest.approx(2, abs=0.02)
    assert result.order[rows["vts-ppt-basic"]] < 1.1
    assert result.asymmetry.min() > 1e-3


@pytest.mark.parametrize(
    ("name", "terms"), [("vts-me:n=1", [36, 36, 36]), ("vts-ppt-basic:n=1", [36] * 3), ("vts-ppt:n=1", [36, 45, 54])]
)
def test_terms_of_the_tangent(name: str, terms: list[int]) -> None:
    """Three of the four dyads for each of the 16 pairs of nodes A, B, 1, 2, less those without: t ⊗ t never occurs.

    Rows are forces along n; Δn adds t ⊗ n. The columns of A and B have n ⊗ n and n ⊗ t, and so have those of 1 and 2,
    which alone turn the normal.
    """
    formulation = next(row for row in tangents.TERM_FORMULATIONS if row.name == name)
    assert [tangents.count_terms(formulation, master) for master in tangents.MASTERS.values()] == terms


@pytest.fixture(scope="module")
def constants() -> lagrange_multipliers.Constants:
    return lagrange_multipliers.INF_SUP.compute()


def test_mortar_and_nts_are_stable_and_vts_ppt_is_not(constants: lagrange_multipliers.Constants) -> None:
    stable = {row for row in lagrange_multipliers.INF_SUP_FORMULATIONS if constants.stable(row)}
    assert stable == {lagrange_multipliers.NTS, lagrange_multipliers.MORTAR, lagrange_multipliers.DUAL}
    (row,) = lagrange_multipliers.INF_SUP.statements(constants)
    assert row.agreement is Agreement.DIFFERS
    assert "falls like h to the power 1.00" in row.result
    assert "33% of all pressures move nothing" in row.result


def test_the_table_and_the_figure_of_constants(constants: lagrange_multipliers.Constants) -> None:
    (table,) = lagrange_multipliers.INF_SUP.tables(constants)
    coarser, finer = table.rows[0][1:3]
    assert coarser.details == ("slope 1.00", "0% move nothing")
    assert finer.details == ("slope 0.00", "33% move nothing")
    mortar = table.rows[lagrange_multipliers.INF_SUP_FORMULATIONS.index(lagrange_multipliers.MORTAR)]
    assert {cell.tone for cell in mortar[1:]} == {"n good"}
    figure = render_figure(lagrange_multipliers.INF_SUP.figures[0], constants)
    assert len(figure.axes) == 3
    assert all(axes.lines for axes in figure.axes)


# --- Appendix A -------------------------------------------------------------------------------------------------


def test_every_formula_of_the_appendix_is_checked() -> None:
    numbers_ = {name for row in appendix_a.FORMULAS for name in row[0].replace("A7a, A7b", "A7").split()}
    assert numbers_ == {f"A{number}" for number in range(1, 29)}
    assert appendix_a.ITEM.compute().difference.max() <= appendix_a.TOLERANCE


@pytest.mark.parametrize("name", ["xi_m", "g", "l_first", "l_last", "n", "xi_a", "l_ab", "first_f", "last_n", "f_v"])
def test_a_wrong_formula_of_the_appendix_is_noticed(name: str) -> None:
    class Wrong(appendix_a.Increment):
        """The linearizations, one of them a thousandth too large."""

        def __init__(self, geometry: appendix_a.Geometry, d: np.ndarray) -> None:
            super().__init__(geometry, d)
            setattr(self, name, 1.001 * getattr(self, name))

    wrong = {row[3] for row, error in zip(appendix_a.FORMULAS, appendix_a.errors(Wrong), strict=True) if error > 1e-6}
    assert name in wrong


def test_the_state_of_the_appendix_covers_three_segments() -> None:
    geometry = appendix_a.Geometry(np.vstack([appendix_a.SLAVE, appendix_a.MASTER]))
    assert 0 < geometry.xi_m < 1
    assert 0 < geometry.xi < 1
    assert 0 < geometry.xi_a < 1
    assert geometry.g < 0


# --- Meshes -----------------------------------------------------------------------------------------------------


def test_lines_of_a_mesh_contain_each_edge_once() -> None:
    body = catalogue.make_scene("b").bodies[0]
    box = np.array([[-100.0, -100.0], [100.0, 100.0]])
    lines = mesh_lines(body, box, 0.0)
    length = sum(float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in lines)
    assert length == pytest.approx(3 * 12 + 5 * 4)  # Three levels of a width of 12, five columns of a height of 4.
    assert len(lines) == 8


def test_a_thinned_line_stays_within_the_tolerance() -> None:
    angle = np.linspace(0, np.pi, 200)
    arc = np.column_stack([np.cos(angle), np.sin(angle)])
    few = thin_out(arc, 1e-3)
    assert 10 < len(few) < 70
    assert few[0].tolist() == arc[0].tolist()
    assert few[-1].tolist() == arc[-1].tolist()
    radius = np.hypot(*((few[1:] + few[:-1]) / 2).T)
    assert 1 - radius.min() <= 1.1e-3


def test_two_processes_compute_the_same_numbers_and_sentences(tmp_path: Path) -> None:
    items = (*(item for item in ITEMS if item.name in ("case_a1", "case_c")), EGGS)
    reported: list[str] = []
    with worker_pool(2) as executor:
        shared = compute(reported.append, items=items, executor=executor)
    alone = compute(items=items)
    assert sorted(reported) == sorted(item.title for item in items)
    assert [result.item for result in shared.results] == list(items)
    assert shared.statements == alone.statements
    assert [result.tables for result in shared.results] == [result.tables for result in alone.results]
    ours, theirs = tree_of(shared), tree_of(alone)
    assert ours.keys() == theirs.keys()
    for path in ours:
        np.testing.assert_equal(asdict(ours[path]), asdict(theirs[path]))
