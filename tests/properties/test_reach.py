"""Formulations that look no deeper behind a surface than their trait `reach` says."""

from typing import Any

import numpy as np
import pytest
from subjects import load_property
from zoo.at_points import GaussClosest
from zoo.on_strips import SegmentPenalty

from contactverif import Interface, Subject, Verdict, named_case
from contactverif.contract.errors import PluginError
from contactverif.contract.interface import find_depth
from contactverif.contract.property import TOO_DEEP
from contactverif.problems.flat_states import deep_face_states, deep_states
from contactverif.run.run import run

DEPTH = 0.5  # Each looks so far behind the segment in hand, in its own lengths.
POINTS = {"hard.deep", "patch.tilted.resultant", "patch.tilted.nodal", "projection.activity"}
STRIPS = {"patch.flat.transmission", "patch.flat.single", "accuracy.arc", "hard.deep", "continuity"}


class ShortPoints(GaussClosest):
    """Springs at Gauss points that leave open what is deeper than half a segment."""

    def pair(self, interface: Any, z: Any) -> Any:
        pairing = super().pair(interface, z)
        gap = self._kernel(self._corners(interface, pairing["master"], z.reshape(-1, 2)))[0]
        lengths = interface.master.lengths(interface.nodes)[pairing["master"]]
        return {**pairing, "active": pairing["active"] & (gap >= -DEPTH * lengths)}


class ShortStrips(SegmentPenalty):
    """Springs on strips, along the slave's normal, that leave open what is deeper than half a segment."""

    def pair(self, interface: Any, z: Any) -> Any:
        pairing = super().pair(interface, z)
        gap = self._at_points(self._corners(interface, pairing["strips"], z.reshape(-1, 2)))[0]
        lengths = interface.master.lengths(interface.nodes)[pairing["strips"][:, 1]]
        return {**pairing, "active": pairing["active"] & (gap >= -DEPTH * lengths[:, None])}


@pytest.mark.parametrize(("make", "accusing"), [(ShortPoints, POINTS), (ShortStrips, STRIPS)])
@pytest.mark.parametrize("reach", [DEPTH, 2.0, None])
def test_a_formulation_is_asked_down_to_the_depth_that_it_states(make: Any, accusing: set[str], reach: Any) -> None:
    class Short(make):  # type: ignore[misc]
        traits = make.traits.revise(reach=reach)

    ids = {*accusing, "remote", "unilateral", "hard.deep", "hard.search", "mirror"}
    rows = run([Subject("short", Short)], [load_property(each) for each in sorted(ids)], examples=30, seed=1).rows
    accused = {row.property_id for row in rows if row.unexpected}
    assert accused <= accusing
    assert bool(accused) is (reach != DEPTH)
    assert sum(row.foreign > 0 for row in rows) >= (0 if reach is None else 3)
    deep = next(row for row in rows if row.property_id == "hard.deep")
    if reach == DEPTH:  # All of its states are deeper.
        assert (deep.verdict, deep.foreign) == (Verdict.UNDECIDED, deep.planned)
        assert deep.reason == f"0 of 6 cases judged; too few are left because {TOO_DEEP}"


def test_a_batch_of_states_is_no_deeper_where_another_process_pairs_them() -> None:
    case = named_case("a1")
    subject = Subject("short", type("Short", (ShortStrips,), {"traits": ShortStrips.traits.revise(reach=DEPTH)}))
    formulation = subject.with_penalty(1.0)
    formulation._prefetching = formulation.plugin  # Then batches go out whole.
    lower = case.positions - np.where(np.arange(len(case.positions)) < case.interface.n_slave_nodes, 8.0, 0.0)[:, None]
    with pytest.raises(PluginError, match="deeper than the formulation looks") as caught:
        formulation.residual(case.interface, None, np.stack([case.z, lower.reshape(-1)]))
    assert caught.value.cause == "not asked"


def test_depths_are_measured_along_both_normals() -> None:
    for case in (*deep_states(), *deep_face_states(), named_case("a1")):
        edges = case.interface.nodes[case.interface.master.faces]
        unit = np.linalg.norm(np.roll(edges, -1, axis=1) - edges, axis=2).min()
        np.testing.assert_allclose(unit * find_depth(case.interface, case.positions), case.parameter("penetration"))
    pair = Interface.from_chains([[0.0, 0.0], [4.0, 0.0]], [[4.0, 0.0], [1.0, 0.0], [-1.0, 0.0]])
    for heights, depth in (((0.5, 0.25), 0.0), ((-3.0, 0.0), 1.875)):  # At 3:4 the slave sees 3 as 15/4, over 2.
        nodes = pair.nodes.copy()
        nodes[:2, 1] = heights
        assert find_depth(pair, nodes) == pytest.approx(depth)
