"""The items on Section 6.3: the inf-sup condition, and locking."""

import numpy as np
import pytest

from contactverif_paper import inf_sup_condition, locking, paper_formulations
from contactverif_paper.figure_style import render_figure
from contactverif_paper.paper_item import Agreement


@pytest.fixture(scope="module")
def constants() -> inf_sup_condition.Constants:
    return inf_sup_condition.compute(lambda _: None)


@pytest.fixture(scope="module")
def result() -> locking.Locking:
    return locking.compute(lambda _: None)


def test_mortar_and_nts_are_stable_and_vts_ppt_is_not(constants: inf_sup_condition.Constants) -> None:
    stable = {row for row in inf_sup_condition.FORMULATIONS if constants.stable(row)}
    assert stable == {inf_sup_condition.NTS, inf_sup_condition.MORTAR, inf_sup_condition.DUAL}
    (row,) = inf_sup_condition.statements(constants)
    assert row.agreement is Agreement.DIFFERS
    assert "falls like h to the power 1.00" in row.result
    assert "33% of all pressures move nothing" in row.result


def test_the_table_shows_both_reasons(constants: inf_sup_condition.Constants) -> None:
    (table,) = inf_sup_condition.tables(constants)
    coarser, finer = table.rows[0][1:3]
    assert coarser.details == ("slope 1.00", "0% move nothing")
    assert finer.details == ("slope 0.00", "33% move nothing")
    assert {cell.tone for cell in table.rows[inf_sup_condition.FORMULATIONS.index(inf_sup_condition.MORTAR)][1:]} == {
        "n good"
    }


def test_segment_to_segment_locks_and_mortar_does_not(result: locking.Locking) -> None:
    rough, smooth = (contact.pressure for contact in result.contacts)
    assert all(contact.converged for contact in result.contacts)
    assert rough.min() == 0
    assert 10 < rough.max() < 20
    assert smooth.min() > 0.4
    assert smooth.max() < 1.6
    (row,) = locking.statements(result)
    assert "34% (VTS-PPT), 34% (segment-to-segment) and 34% (two-pass NTS-AR)" in row.result
    assert np.abs(result.drift[locking.FORMULATIONS.index(paper_formulations.NTS_AR)]).max() < 0.001


def test_the_figures_have_their_panels(constants: inf_sup_condition.Constants, result: locking.Locking) -> None:
    for item, data, count in ((inf_sup_condition.ITEM, constants, 3), (locking.ITEM, result, 2)):
        figure = render_figure(item.figures[0], data)
        assert len(figure.axes) == count
        assert all(axes.lines for axes in figure.axes)
        assert item.groups(data)
