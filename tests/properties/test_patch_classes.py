"""The patch tests of classes of meshes, of nodal springs and of stated forces: `patch.flat.normal` to `published`."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from gauss_springs import RIGHT, GaussSprings
from strangers import NearbyOnly, PointsFirst, SlaveNormalAtGaussPoints, TurnedFrame
from strangers.segment_penalty import SegmentPenalty
from subjects import load_property, load_subject, with_promises
from textbook_cells import ClippedCells, WeightedGaps
from textbook_springs import CentredSprings

from contactverif import Case, PatchPromises, Promises, Rules, Subject, Traits, Verdict, judge_case
from contactverif.contract.published_forces import parse_forces
from contactverif.problems.catalogue import load_scene_case
from contactverif.problems.named_states import FLAT_NAMES, named_case
from contactverif.run.run import run
from contactverif.sampling.draw import draw_cases
from contactverif_nts import force_tables
from contactverif_properties.patch_flat import LOST_END

NORMAL, SINGLE, NODAL, PUBLISHED = (f"patch.flat.{name}" for name in ("normal", "single", "nodal", "published"))
EXAMPLES = 30


class LoopOfNodes:
    """A spring at each slave node, on the segment whose middle is nearest: a residual and nothing else."""

    traits = Traits(rules=Rules(penalty="nodal"))
    sides = (("slave", "master"),)

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, forces = z.reshape(-1, 2), np.zeros((interface.n_nodes, 2))
        for near, far in self.sides:
            segments = getattr(interface, far).segments
            first, along = x[segments[:, 0]], x[segments[:, 1]] - x[segments[:, 0]]
            for node in np.unique(getattr(interface, near).segments):
                places = ((x[node] - first) * along).sum(axis=1) / (along**2).sum(axis=1)
                best = int(np.abs(places - 0.5).argmin())
                if -1e-6 <= places[best] <= 1 + 1e-6:
                    normal = np.array([along[best, 1], -along[best, 0]]) / np.hypot(*along[best])
                    force = self.penalty * min((x[node] - first[best]) @ normal, 0.0) * normal
                    forces[[node, *segments[best]]] += np.outer([1, places[best] - 1, -places[best]], force)
        return forces.reshape(-1)


class LoopOfAllNodes(LoopOfNodes):
    """Such springs at the nodes of both surfaces, each with half the penalty."""

    traits = Traits(promises=Promises(unbiased=True), rules=Rules(penalty="nodal"))
    sides = (("slave", "master"), ("master", "slave"))

    def __init__(self, *, penalty: float) -> None:
        super().__init__(penalty=penalty / 2)


RIGHT_ONES: dict[str, tuple[Subject, tuple[str, ...]]] = {
    "the trapezoidal rule, points first": (with_promises(PointsFirst, normal=True), (NORMAL,)),
    "Gauss points along the slave's normal": (with_promises(SlaveNormalAtGaussPoints, normal=True), (NORMAL,)),
    "Gauss points about the mean of all nodes": (with_promises(CentredSprings, normal=True), (NORMAL,)),
    "quarter points in a turned frame": (with_promises(TurnedFrame, single=True), (NORMAL, SINGLE)),
    "four points that look around": (with_promises(NearbyOnly, single=True), (NORMAL, SINGLE)),
    "textbook cells": (with_promises(ClippedCells), (NORMAL, SINGLE)),
    "textbook mortar": (with_promises(WeightedGaps), (NORMAL, SINGLE)),
    "a loop of nodes": (with_promises(LoopOfNodes), (NODAL,)),
    "a loop of the nodes of both sides": (with_promises(LoopOfAllNodes), (NODAL,)),
    "two passes of two passes": (load_subject("two-pass/two-pass/nts"), (NODAL, PUBLISHED)),
    **{
        f"Gauss springs, {name}": (with_promises(partial(GaussSprings, way=way, before=before), normal=True), (NORMAL,))
        for name, (way, before) in RIGHT.items()
    },
}


def draw(property_id: str, seed: int = 0, examples: int = EXAMPLES) -> list[Case]:
    cases = load_property(property_id).cases(None)
    return list(cases if isinstance(cases, tuple) else draw_cases(cases, seed=f"{seed}", examples=examples).cases)


@pytest.mark.parametrize("name", RIGHT_ONES)
@pytest.mark.parametrize("seed", [0, 1])
def test_what_a_stranger_writes_rightly_is_not_accused(name: str, seed: int) -> None:
    subject, ids = RIGHT_ONES[name]
    for property_id in ids:
        question = load_property(property_id)
        assert question.promise(subject.traits)
        outcomes = [judge_case(question, case, subject) for case in draw(property_id, seed)]
        assert {outcome.verdict for outcome in outcomes} <= {Verdict.PASS, Verdict.UNDECIDED}, [
            outcome.reason for outcome in outcomes
        ]
        assert sum(outcome.decided for outcome in outcomes) >= 0.8 * len(outcomes)


@pytest.mark.parametrize("name", ["the trapezoidal rule, points first", "quarter points in a turned frame"])
def test_scenes_leave_nothing_to_roundoff(name: str) -> None:
    """Neither has a tolerance past a free end. In turned scenes one would be lost if both surfaces ended together."""
    subject, ids = RIGHT_ONES[name]
    question = load_property(f"{ids[-1]}.solve")
    outcomes = [judge_case(question, case, subject) for case in question.cases(None)]
    assert {outcome.verdict for outcome in outcomes} == {Verdict.PASS}, [outcome.reason for outcome in outcomes]


@pytest.mark.parametrize("name", ["nts-ar:tau=0", "nts-lm:tau=0"])
def test_only_an_end_that_roundoff_loses_is_undecided(name: str) -> None:
    question, subject = load_property(NORMAL), load_subject(name)
    outcomes = [judge_case(question, case, subject) for case in draw(NORMAL, examples=100)]
    reasons = {outcome.reason for outcome in outcomes if not outcome.decided}
    assert reasons == {LOST_END}
    assert Verdict.FAIL not in {outcome.verdict for outcome in outcomes}


class ProductsOfPositions:
    """Exact segments, whose gaps are wrong by what overhangs times the distance from the origin, as in D x − M x."""

    traits = Traits(Promises(patch=PatchPromises(flat=True)), Rules(penalty="distributed", area="current"))

    def __init__(self, *, penalty: float) -> None:
        self.springs = SegmentPenalty(penalty=penalty)
        self.pair = self.springs.pair

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, forces = z.reshape(-1, 2), self.springs.residual(interface, pairing, z).reshape(-1, 2)
        along = np.diff(x[interface.slave.segments[0]], axis=0)[0]
        slave, master = np.split(x @ (along / np.linalg.norm(along)), [interface.n_slave_nodes])
        overhang = max(0.0, slave.max() - master.max(), master.min() - slave.min())
        forces[0] += self.springs.penalty * overhang * np.abs(x).max() * forces[0] / np.linalg.norm(forces[0])
        return forces.reshape(z.shape)


@pytest.mark.parametrize(("stable", "verdict"), [(None, Verdict.UNDECIDED), (True, Verdict.FAIL)])
def test_what_overhangs_by_a_rounding_excuses_an_error_of_that_size(stable: bool | None, verdict: Verdict) -> None:
    subject = with_promises(ProductsOfPositions, translation_stable=stable)
    question = load_property("patch.flat.transmission")
    verdicts = {judge_case(question, case, subject).verdict for case in draw("patch.flat.transmission", examples=200)}
    assert verdicts == {Verdict.PASS, verdict}


def test_a_force_lost_elsewhere_is_a_failure_though_an_end_is_lost_too() -> None:
    class Forgetful(PointsFirst):
        """It leaves out every point on a master node."""

        def contact_points(self, *arguments: Any) -> Any:
            points = super().contact_points(*arguments)
            off = np.minimum(np.abs(points.xi), np.abs(1 - points.xi)) > 1e-6
            return replace(points, active=points.active & off, pressure=np.where(off, points.pressure, 0.0))

    question, subject = load_property(NORMAL), with_promises(Forgetful, normal=True)
    masters = ((case, case.interface.master.segments) for case in draw(NORMAL))
    cases = [case for case, segments in masters if np.intersect1d(*segments.T).size]
    assert len(cases) > 5
    assert {judge_case(question, case, subject).verdict for case in cases} == {Verdict.FAIL}


@pytest.mark.parametrize("exponent", [-6, -9, -12])
@pytest.mark.parametrize("quantity", ["gap", "pressure"])
def test_what_is_reported_may_not_be_off_by_little(quantity: str, exponent: int) -> None:
    class Boaster(TurnedFrame):
        def contact_points(self, *arguments: Any) -> Any:
            points = super().contact_points(*arguments)
            changed: Any = {quantity: getattr(points, quantity) * (1 + 10.0**exponent)}
            return replace(points, **changed)

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return TurnedFrame(penalty=self.penalty).residual(interface, pairing, z)

    question, subject = load_property(SINGLE), with_promises(Boaster, single=True)
    verdicts = [judge_case(question, case, subject).verdict for case in draw(SINGLE)]
    assert Verdict.FAIL in verdicts


@pytest.mark.parametrize("name", ["nts", "nts-ar", "vts-g"])
def test_the_single_class_tells_vts_me_from_the_others(name: str) -> None:
    for property_id in (SINGLE, f"{SINGLE}.solve"):
        question = load_property(property_id)
        case = load_scene_case("b") if question.bodies else named_case("b")
        assert judge_case(question, case, load_subject(name)).verdict is Verdict.FAIL
        assert judge_case(question, case, load_subject("vts-me")).verdict is Verdict.PASS


def test_who_promises_a_larger_class_promises_the_smaller_ones() -> None:
    promises = [load_property(property_id).promise for property_id in (NORMAL, SINGLE)]
    assert [promise(Traits(promises=Promises(patch=PatchPromises(flat=True)))) for promise in promises] == [True, True]
    assert [promise(Traits(promises=Promises(patch=PatchPromises(single=True)))) for promise in promises] == [
        True,
        True,
    ]
    assert [promise(Traits(promises=Promises(patch=PatchPromises(normal=True)))) for promise in promises] == [
        True,
        None,
    ]
    assert [promise(Traits(promises=Promises(patch=PatchPromises(flat=False)))) for promise in promises] == [None, None]


def test_scenes_of_another_class_are_not_asked_about() -> None:
    normal, single = (load_property(f"{property_id}.solve").cases for property_id in (NORMAL, SINGLE))
    assert normal(load_scene_case("b")) is None
    assert single(load_scene_case("b")) is not None
    assert normal(load_scene_case("a2-graded")) is not None
    assert single(load_scene_case("c")) is None
    assert single(load_scene_case("dead-zone")) is None


# Stated forces


def _by_hand(name: str, rule: Callable[[list[Fraction]], list[tuple[Fraction, Fraction]]]) -> Any:
    """Return forces on slave and master: `rule` gives places and forces on the slave from the places of its nodes."""
    case = named_case(name)
    sides = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    slave, master = (sorted(Fraction(float(x)).limit_denominator(100) for x in side) for side in sides)
    points = rule(slave)
    return tuple(tuple(_share(points, nodes)) for nodes in (slave, master))


def _share(points: list[tuple[Fraction, Fraction]], nodes: list[Fraction]) -> list[Fraction]:
    """Share forces at places between the nodes on their left and on their right by the lever rule."""
    shares = [Fraction(0)] * len(nodes)
    for place, force in points:
        right = next(number for number, node in enumerate(nodes) if node >= place)
        left = max(right - 1, 0)
        part = (place - nodes[left]) / (nodes[right] - nodes[left]) if right else Fraction(0)
        shares[left] += (1 - part) * force
        shares[right] += part * force
    return shares


def _units(nodes: list[Fraction]) -> list[tuple[Fraction, Fraction]]:
    return [(node, Fraction(1)) for node in nodes]


def _areas(nodes: list[Fraction]) -> list[tuple[Fraction, Fraction]]:
    halves = [(b - a) / 2 for a, b in pairwise(nodes)]
    return [(node, a + b) for node, a, b in zip(nodes, [Fraction(0), *halves], [*halves, Fraction(0)], strict=True)]


def _quarters(nodes: list[Fraction]) -> list[tuple[Fraction, Fraction]]:
    return [(a + (b - a) * k / 4, (b - a) / 2) for a, b in pairwise(nodes) for k in (1, 3)]


@pytest.mark.parametrize(
    ("table", "rule"),
    [(force_tables.NTS, _units), (force_tables.NTS_AR, _areas), (force_tables.VTS_ME, _quarters)],
    ids=["NTS", "NTS-AR", "VTS-ME"],
)
def test_the_tables_are_what_the_lever_rule_gives_by_hand(table: Any, rule: Any) -> None:
    assert set(table) == set(FLAT_NAMES)
    for name, text in table.items():
        assert parse_forces(text) == _by_hand(name, rule)


def test_nested_passes_act_four_times() -> None:
    once, twice = (
        load_subject(f"{prefix}nts").traits.evidence.published_forces["b"] for prefix in ("", "two-pass/two-pass/")
    )
    here, _ = parse_forces(once)
    _, there = parse_forces(load_subject("nts").traits.evidence.published_forces["b-swapped"])
    expected = tuple(2 * (a + b) for a, b in zip(here, there, strict=True))
    assert parse_forces(twice)[0] == expected


@pytest.mark.parametrize(
    ("forces", "message"),
    [
        ({"d": "1 2 1; 2 2"}, "found d; needed names of flat cases: a1, "),
        ({"a1": "1 2; 2 2"}, "found 2 and 2 forces on a1; needed 3 on the slave nodes and 2 on the master nodes"),
    ],
)
def test_a_table_of_another_mesh_breaks_the_contract(forces: dict[str, str], message: str) -> None:
    subject = with_promises(PointsFirst, published_forces=forces)
    outcome = judge_case(load_property(PUBLISHED), named_case("a1"), subject)
    assert outcome.breach
    assert message in outcome.reason


def test_nothing_is_asked_where_nothing_is_known() -> None:
    subject = with_promises(PointsFirst, published_forces={"a1": "1 2 1; 2 2"})
    question = load_property(PUBLISHED)
    outcomes = {name: judge_case(question, named_case(name), subject) for name in ("a1", "b")}
    assert all(outcome.verdict is Verdict.PASS for outcome in outcomes.values())
    idle = {name: outcome.measurement is not None and outcome.measurement.idle for name, outcome in outcomes.items()}
    assert idle == {"a1": False, "b": True}
    (row,) = run([subject], [question]).rows
    assert (row.verdict, row.unexpected) == (Verdict.PASS, "")
