"""`free_end` of VTS-PPT acts at free ends of the master only; everywhere else Box 3 stands as printed.

It once cut the part of an interior segment, too, where the foot of a virtual slave node lies past the segment's end:
1.9 % of the force on a random bent surface with n = 3.
"""

from typing import Any

import numpy as np
import pytest
from subjects import judge_as, load_property, load_subject
from surfaces import complex_step, contact_forces, make_bent, make_closed, make_flat

from contactverif import Case, Interface, Verdict, named_case
from contactverif_nts import vts_ppt, vts_ppt_balanced

PENALTY = 8.0
VALLEY = [[2.0, 1.0], [0.0, 0.0], [-2.0, 1.0]]  # both feet of a point below its vertex lie past the segments' ends


def test_a_foot_past_the_end_of_an_interior_segment_leaves_box_3_as_printed() -> None:
    """The area of competence begins behind the first segment's end, so that a > 1 and the segment pulls."""
    slave = np.array([[-0.04, -0.2], [0.06, -0.2]])
    interface = Interface.from_chains(slave, VALLEY)
    formulation = vts_ppt(penalty=PENALTY, n=1)
    pairing = formulation.pair(interface, interface.nodes.ravel())
    assert pairing["active"].all()
    assert (pairing["master"], pairing["first"], pairing["last"]) == (0, 0, 1)
    forces = contact_forces(formulation, interface, interface.nodes.ravel())[2:]

    (x_1, x_2, x_3), (x_q, x_p) = np.array(VALLEY), slave
    t = (x_2 - x_1) / np.linalg.norm(x_2 - x_1)
    normal = np.array([t[1], -t[0]])
    gap = ((x_p + x_q) / 2 - x_1) @ normal
    lengths = (x_2 - x_1) @ t, (x_3 - x_2) @ t
    a, b = (x_p - x_1) @ t / lengths[0], (x_q - x_2) @ t / lengths[1]
    assert a > 1
    assert 0 < b < 1
    shares = [
        lengths[0] * ((1 - a) - (1 - a**2) / 2),
        lengths[0] * (1 - a**2) / 2 + lengths[1] * (b - b**2 / 2),
        lengths[1] * b**2 / 2,
    ]
    assert forces == pytest.approx(PENALTY * gap * np.outer(shares, normal), rel=1e-12)
    assert sum(shares) == pytest.approx((x_q - x_p) @ t)  # nothing is lost


def test_a_segment_seen_edge_on_is_no_free_end() -> None:
    """The walk stops before a step of the master; the slave presses on past it with its whole length."""
    slave, master = [[-0.4, -0.1], [1.4, -0.1]], [[3.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, -1.0]]
    interface = Interface.from_chains(slave, master)
    for free_end in ("truncate", "extend"):
        formulation = vts_ppt(penalty=PENALTY, n=1, free_end=free_end)
        pairing = formulation.pair(interface, interface.nodes.ravel())
        assert (pairing["first"], pairing["last"]) == (0, 1)
        forces = contact_forces(formulation, interface, interface.nodes.ravel())
        assert -forces[2:, 1].sum() == pytest.approx(PENALTY * 0.1 * 1.8)


def test_beside_a_step_of_the_master_a_node_is_pulled_so_vts_ppt_promises_no_push() -> None:
    """The walk stops before the step, 0.7 before a segment of 0.2, so that a < −1 on it."""
    slave, master = [[-0.4, -0.1], [1.4, -0.1]], [[3.0, 0.0], [0.5, 0.0], [0.3, 0.0], [0.3, -1.0]]
    interface = Interface.from_chains(slave, master)
    case = Case(interface, interface.nodes.ravel(), PENALTY)
    question = load_property("nodal-push")
    for name in ("vts-ppt:n=1", "vts-ppt-balanced:n=1,free_end=truncate"):
        judge_as(Verdict.FAIL, question, case, load_subject(name))
        assert load_subject(name).traits.promises.nodes_push is None
    judge_as(Verdict.PASS, question, case, load_subject("vts-ppt-balanced:n=1"))


@pytest.mark.parametrize("name", ["nts", "vts-ppt", "vts-ppt-basic", "vts-ppt-balanced", "chen-hisada"])
def test_an_open_gap_may_be_closed_where_feet_count_far_past_a_free_end(name: str) -> None:
    promises = [load_subject(f"{name}:tau={tau}").traits.promises.opens_at_ends for tau in (0.05, 0.06)]
    assert promises == [True, None]


def test_dual_shapes_push_across_an_open_gap_unless_gaps_have_standard_ones() -> None:
    """The gap of 0.02 + 0.48 s is −0.22 at the node that is not covered, ∫N of which is 1/8."""
    case = named_case("open-end")
    for name, force in (("mortar-dual", 0.22 / 8), ("mortar-dual:gap_shapes=standard", 0.0), ("mortar", 0.0)):
        formulation = load_subject(name).with_penalty(1.0)
        forces = formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)
        assert -forces.reshape(-1, 2)[:2].sum(axis=0) == pytest.approx([0.0, force], abs=1e-15)


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("free_end", ["truncate", "extend"])
def test_a_balanced_transmission_hands_on_the_whole_force_past_a_free_end(free_end: str, n: int) -> None:
    """With "truncate" the master once lost a quarter of it here: S was the sum of uncut parts."""
    interface, z = make_flat([4.0], [1.5, 1.375, 0.125], shift=0.5)  # the slave overhangs by 0.5 at either end
    forces = contact_forces(vts_ppt_balanced(penalty=PENALTY, n=n, free_end=free_end, tau=0.5), interface, z)
    assert forces[:2, 1].sum() == pytest.approx(4.0, rel=1e-14)
    assert -forces[2:, 1].sum() == pytest.approx(4.0, rel=1e-14)
    if free_end == "truncate" and n == 1:  # the master gets a uniform pressure on what is there
        assert -forces[2:, 1] * 3 / 4 == pytest.approx(np.array([0.0625, 0.75, 1.4375, 0.75]), rel=1e-14)


def test_the_tangent_of_a_truncated_area_over_many_segments_is_exact() -> None:
    """The free ends move the forces of all segments, also where each segment is a coupling of its own."""
    random = np.random.default_rng(0)
    along = np.linspace(3.5, 0.5, 41)
    master = np.column_stack([along, random.normal(scale=0.01, size=41)])
    interface = Interface.from_chains([[0.0, -0.25], [4.0, -0.125]], master)
    for transmission in (vts_ppt, vts_ppt_balanced):
        formulation = transmission(penalty=PENALTY, n=1, free_end="truncate")
        z = interface.nodes.ravel()
        pairing = formulation.pair(interface, z)
        assert (pairing["clip_p"], pairing["clip_q"], pairing["last"] - pairing["first"]) == (0, 1, 39)
        moved = complex_step(formulation, interface, pairing, z)
        tangent = formulation.tangent(interface, pairing, z).toarray()
        assert np.abs(moved - tangent).max() <= 1e-13 * np.abs(moved).max()


def has_overhang(interface: Interface, z: Any, n: int, pairing: Any) -> bool:
    """Return whether the area of competence of an active virtual slave node reaches past an end of the master chain."""
    x, master = z.reshape(-1, 2), interface.master.segments
    first_node, last_node = x[master[0, 0]], x[master[-1, 1]]
    for i in np.flatnonzero(pairing["active"]):
        x_a, x_b = x[interface.slave.segments[i // n]]
        c = -1 + (2 * (i % n) + 1) / n
        x_q, x_p = ((1 - end) / 2 * x_a + (1 + end) / 2 * x_b for end in (c - 1 / n, c + 1 / n))
        x_1, x_2 = x[master[pairing["master"][i]]]
        if (x_p - first_node) @ (x_2 - x_1) < 0 or (x_q - last_node) @ (x_2 - x_1) > 0:
            return True
    return False


@pytest.mark.parametrize("make", [vts_ppt, vts_ppt_balanced])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_where_nothing_overhangs_a_free_end_the_option_changes_nothing(make: Any, n: int) -> None:
    compared = differ = 0
    for seed in range(400):
        interface, z = make_bent(seed)
        truncate, extend = (make(penalty=PENALTY, n=n, free_end=word) for word in ("truncate", "extend"))
        pairing = truncate.pair(interface, z)
        forces = [contact_forces(formulation, interface, z) for formulation in (truncate, extend)]
        if has_overhang(interface, z, n, pairing):
            differ += not np.array_equal(*forces)
        else:
            compared += bool(pairing["active"].any())
            assert np.array_equal(*forces)
    assert compared > 100
    assert differ > 5


def test_a_closed_master_has_no_free_end() -> None:
    angle = np.linspace(0, 2 * np.pi, 8)[:-1]
    hole = np.column_stack([np.cos(angle), np.sin(angle)])[::-1]
    disk = 1.05 * np.column_stack([np.cos(angle + 0.3), np.sin(angle + 0.3)])
    interface = make_closed(disk, hole)
    for seed in range(50):
        z = (interface.nodes + np.random.default_rng(seed).normal(scale=0.05, size=(14, 2))).ravel()
        forces = [
            contact_forces(vts_ppt(penalty=PENALTY, n=3, free_end=word), interface, z)
            for word in ("truncate", "extend")
        ]
        assert forces[0].any()
        assert np.array_equal(*forces)
