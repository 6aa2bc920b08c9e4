"""No property accuses a right formulation of breaking what it promises; `tox -e trust` asks many more cases."""

from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from gauss_springs import RIGHT, GaussSprings
from hard_strangers import PointSprings, Softened, simpson, trapezoid
from planned_cases import draw_cases
from subjects import judge_as, load_property, load_subject, with_promises
from textbook_cells import ClippedCells, WeightedGaps
from textbook_springs import CentredSprings, NodalMultipliers, QuadraticSprings
from zoo.at_points import NearbyOnly, PointsFirst, SlaveNormalAtGaussPoints, TurnedFrame
from zoo.on_strips import CommonPlane, OnePoint, SegmentPenalty, SimpsonPoints
from zoo.right import STRANGERS

from contactverif import Case, Interface, Promises, Property, Rules, Subject, Traits, Verdict, judge_case
from contactverif.plugins.registry import property_ids

NORMAL, SINGLE, NODAL, PUBLISHED = (f"patch.flat.{name}" for name in ("normal", "single", "nodal", "published"))
ALL = 10**6  # More cases than a list has.
MOST_UNDECIDED = 50  # Among all cases that a formulation of the zoo is asked.


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


GAUSS = {name: partial(GaussSprings, way=way, before=before) for name, (way, before) in RIGHT.items()}
ON_FLAT_MESHES: dict[str, tuple[Subject, tuple[str, ...]]] = {  # {name: (formulation, ids)}
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
    **{f"Gauss springs, {name}": (with_promises(make, normal=True), (NORMAL,)) for name, make in GAUSS.items()},
}
MASTER, SLAVE = ({"force_along": f"{side} normal", "local": True} for side in ("master", "slave"))
EXACT: dict[str, Any] = {"integrates_linear_gap": True, "translation_stable": True, "gap": "closest point"}
TILTED = {
    **{
        make.__name__: with_promises(make, **(SLAVE if make.traits.rules.gap == "slave normal" else MASTER))
        for make in (PointsFirst, TurnedFrame, SlaveNormalAtGaussPoints, NearbyOnly)
    },
    **{f"Gauss springs, {name}": with_promises(make, **EXACT, **MASTER) for name, make in GAUSS.items()},
    "textbook springs about the mean of all nodes": with_promises(CentredSprings, integrates_linear_gap=True, **MASTER),
    "textbook cells": with_promises(ClippedCells, integrates_linear_gap=True, **SLAVE),
    "textbook mortar": with_promises(WeightedGaps, **SLAVE),
}
SECOND_ORDER = {
    "textbook springs of second order": Subject("quadratic", QuadraticSprings),
    "textbook nodal multipliers": Subject("multipliers", NodalMultipliers),
}
ON_PLANES = {"common planes": Subject("common planes", CommonPlane)}
AT_POINTS = {
    name: Subject(name, make)
    for name, make in {
        "quarter points": PointSprings,
        "the last of equals": partial(PointSprings, last=True),
        "nodes": trapezoid,
        "nodes with a wide tolerance": partial(trapezoid, last=True, tau=0.05),
        "Simpson's rule": partial(simpson, tau=0.01),
        "Simpson's rule, the last of equals": partial(simpson, last=True),
        "no traits": partial(simpson, stated=False),
        "quarter points without traits": partial(PointSprings, stated=False),
        "a law that is not linear": Softened,
    }.items()
}
TEXTBOOK = {
    make.__name__: Subject(make.__name__, make)
    for make in (CentredSprings, QuadraticSprings, NodalMultipliers, ClippedCells, WeightedGaps)
}
OF_STATES = [question.id for question in map(load_property, property_ids()) if not question.bodies]
# Those of rounding, projection, hard cases and memory. The meshes of two of them are large for loops.
FOR_LOOPS = [
    name
    for name in property_ids()
    if name.split(".")[0] in ("stability", "projection", "hard")
    or name in ("purity", "units", "objectivity", "unilateral", "tangent.directional")
]
# Formulations, ids, the seed, the number of cases, and the least share of them that is decided.
GROUPS = (
    *(({name: subject}, ids, f"{seed}", 30, 0.8) for name, (subject, ids) in ON_FLAT_MESHES.items() for seed in (0, 1)),
    (TILTED, ("patch.tilted.resultant", "patch.tilted.nodal", "locality.bend"), "straight/{}", 8, 1.0),
    (TILTED | SECOND_ORDER, ("mirror", "renumbering", "remote"), "same/{}", 10, 0.0),
    (AT_POINTS, [name for name in OF_STATES if name.startswith("hard.")], "", ALL, 0.9),
    (AT_POINTS, ("total-stiffness",), "", ALL, 1.0),
    # Ties between equally near middles, decided by number, are undecided in a mirror image, and nothing else is.
    (ON_PLANES, ("mirror", "renumbering"), "planes/{}", 60, 0.95),
    (ON_PLANES, ("balance.force", "balance.moment", "objectivity", "remote", "unilateral"), "planes/{}", 10, 0.9),
    (TEXTBOOK, [name for name in FOR_LOOPS if name not in ("hard.touch", "hard.contrast")], "textbook/{}", 8, 0.0),
)
ROWS = [
    (name, subject, property_id, *others)
    for subjects, ids, *others in GROUPS
    for name, subject in subjects.items()
    for property_id in ids
]


@cache
def cases_of(question: Property, seed: str, examples: int) -> tuple[Any, ...]:
    listed = question.cases(None)
    if isinstance(listed, tuple):
        return listed[:: max(1, len(listed) // examples)]
    return draw_cases(listed, seed=seed.format(question.id), examples=examples).cases


def count_undecided(question: Property, subject: Subject, cases: tuple[Any, ...]) -> int:
    """Judge a right formulation; fail if it is accused of anything."""
    outcomes = [judge_case(question, case, subject) for case in cases]
    for outcome in outcomes:
        assert not outcome.breach
        assert outcome.verdict in (Verdict.PASS, Verdict.UNDECIDED), f"{question.id}: {outcome.reason}"
    return sum(not outcome.decided for outcome in outcomes)


@pytest.mark.parametrize(("name", "subject", "property_id", "seed", "examples", "least"), ROWS)
def test_a_right_formulation_is_not_accused(
    name: str, subject: Subject, property_id: str, seed: str, examples: int, least: float
) -> None:
    question = load_property(property_id)
    if question.promise(subject.traits) is not True or question.refusal_of(subject):
        return
    if name in TEXTBOOK and (question.bodies or isinstance(question.cases(None), tuple)):
        examples = 2  # They loop.
    cases = cases_of(question, seed, examples)
    assert count_undecided(question, subject, cases) <= (1 - least) * len(cases)


def test_what_is_asked_on_flat_meshes_is_promised() -> None:
    assert all(load_property(each).promise(subject.traits) for subject, ids in ON_FLAT_MESHES.values() for each in ids)


@pytest.mark.parametrize("name", STRANGERS)
def test_a_right_formulation_from_a_paper_is_not_accused_of_anything(name: str) -> None:
    subject, undecided = Subject(name, STRANGERS[name]), 0
    for question in map(load_property, OF_STATES):
        is_promised = question.promise(subject.traits) is True and not question.refusal_of(subject)
        if is_promised and not question.needs - subject.provides:
            undecided += count_undecided(question, subject, cases_of(question, "strangers/{}", 50)[:50])
    assert undecided <= MOST_UNDECIDED


@pytest.mark.parametrize("name", ["the trapezoidal rule, points first", "quarter points in a turned frame"])
def test_scenes_leave_nothing_to_roundoff(name: str) -> None:
    """Neither has a tolerance past a free end. In turned scenes one would be lost if both surfaces ended together."""
    subject, ids = ON_FLAT_MESHES[name]
    question = load_property(f"{ids[-1]}.solve")
    for case in question.cases(None):
        judge_as(Verdict.PASS, question, case, subject)


@pytest.mark.parametrize("property_id", ["tangent.directional", "tangent.sparsity"])
def test_dust_at_a_node_that_a_strip_reaches_by_a_rounding_is_no_wrong_row(property_id: str) -> None:
    """The tangent said 0 and the derivative 1e-18, or the reverse, where the shape of a node is 0 but for roundoff."""
    question, subject = load_property(property_id), Subject("Simpson", SimpsonPoints)
    for number in range(1, 40):
        slave = np.array([[0.0, -0.63], [1.0, -0.44], [4.0, 0.12]]) + [number / 112, 0.0]
        interface = Interface.from_chains(slave, master=[[x, 0.0] for x in (6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0)])
        judge_as(Verdict.PASS, question, Case(interface, interface.nodes.reshape(-1), 1.0), subject)


@pytest.mark.parametrize("make", [SegmentPenalty, OnePoint])
def test_a_body_behind_that_of_the_slave_is_no_partner(make: Any) -> None:
    """The slave reaches past the master, and there its normal meets another body, 64 diameters behind its own."""
    interface = Interface.from_chains([[1 / 112, -0.375], [113 / 112, -0.125]], [[1.0, 0.0], [0.0, 0.0]])
    case = Case(interface, interface.nodes.reshape(-1), 1.0, seed=359)
    judge_as(Verdict.PASS, load_property("remote"), case, Subject("strips", make))
