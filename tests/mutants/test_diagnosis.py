"""Each mistake that is put into right springs is caught and named, and no right formulation hears anything."""

import csv
import re
from pathlib import Path
from typing import ClassVar

import bugs_campaign
import numpy as np
import pytest
from subjects import Changed, load_subject
from zoo.killing import MUTANTS, MUTANTS_IN_SPACE
from zoo.right import STRANGERS
from zoo.springs import EVERY, FORCES, FRESH, KNOWN, NOT_NAMED, TANGENTS, Springs

from contactverif import Run, Subject, load_properties
from contactverif.contract.arrays import dense
from contactverif.contract.result import OF_TANGENT
from contactverif.contract.traits import PatchPromises, Promises, Rules, Traits
from contactverif.diagnosis.diagnose import diagnose
from contactverif.diagnosis.flat_state import SLAVE, flat_state
from contactverif.oracle.flat_answers import uniform_pressure_weights
from contactverif.plugins.registry import standalone_names
from contactverif.run.run import run

TANGENT, PATCH = "tangent.directional", "patch.flat.transmission"
# What `verify` asks first, and the patch test of nodes and the tangent, which catch what those leave.
QUESTIONS = (
    *("purity", "unilateral", "units", "balance.force", "balance.moment", "patch.flat.resultant"),
    *(PATCH, "patch.flat.nodal", TANGENT, "hard.touch", "remote"),
)
CAUGHT = [name for name in EVERY if name != "averaged-gaps-as-nodal"]  # It converges, and breaks no promise.
# Mutants of the included formulations, each with the words that name its mistake.
IN_INCLUDED = {
    "pushes the wrong way": "the sign",
    "penalty squared": "every node has 1024 times",
    "pushes where the gap is open": "no force at all",
    "Δn missing": "the part of δn, in t–n on the columns of the master, is missing",
    "ΔS missing": "the part of δξ, in n–t on the master's rows",
    "Δl_AB missing": "the part of the length of the slave's segments, in n–t on the slave's columns",
    "tangent symmetrised": "the symmetric part of the derivative",
    "small forces dropped": "look for an absolute length",
    "shortest length allowed, absolute": "look for an absolute length",
    "all signs of a mortar method turned round": "the sign",
    # Patterns on states that are changed.
    "neighbour taken by its number": "if its segments stand in another order",
    "last node of the last chain forgotten": "beside one more pair of the same kind",
    "wrong above 100 segments": "beside 40 more pairs",
    "activity of the neighbour": "beside a pair that is apart",
    "area measured elsewhere than the trait says": "though areas are current ones",
    "normal along the axis": "if all is turned by 180°",
    "equal stiffness at nodes said to be that of areas": "to the power 1, and should like 3: is a length missing",
    "slave and master forces of the printed algorithm": "of a tilted slave do not balance: the master gets",
    "ξ set to one half": "of a flat state balance, and their moments do not",
    "area of competence cut at the wrong node": "where the slave reaches past both ends of the master",
    "area of competence over many segments left out": "where a slave segment faces 12 master segments",
    "slave thicker by a millionth of a segment": "the gap that counts is off by 1.04e-06",
    "barrier that stops growing at 1e-7 of its reach": "do not grow where a gap of 2^-24",
    # In space.
    "triangles around the first corner of a cell": "if its faces begin at another corner",
    "last face taken unchecked for a node that faces none": "past an end of the master",
    "force along z": "if all is turned by 37°",
    "clip that loses a corner": "their sum is 0.9057 times",
    "penetrations below 1e-9 left open": "look for an absolute length",
    "no turn of the normal in the tangent": "the part of δn, in t–n on the columns of the slave, is missing",
    "no slide of the foot in the tangent": "the part of δξ, in n–t on the master's rows",
    "no change of the gap in the tangent": "the material part, in n–n, is wrong",
    "shape functions of the slave one corner on": "right on parallelograms, and wrong on other quadrilaterals",
}
TABLE = Path(__file__).parents[2] / "reports" / "trust" / "bugs.csv"
with TABLE.open(encoding="utf-8", newline="") as stream:
    STORED = {line["formulation"]: line for line in csv.DictReader(stream)}


def test_the_stored_screens_are_short_and_name_the_mistakes_that_they_say() -> None:
    right, *mistakes = bugs_campaign.RIGHT, *bugs_campaign.ASKED
    assert list(STORED) == [right, *mistakes]
    assert (STORED[right]["status"], STORED[right]["diagnosis"], int(STORED[right]["lines"]) <= 25) == ("0", "", True)
    assert max(int(STORED[name]["lines"]) for name in mistakes) <= 60
    page = TABLE.with_suffix(".md").read_text(encoding="utf-8")
    for words, names, least in (("the twelve", KNOWN, 11), ("the eight", FRESH, 5)):
        n_named = sum(STORED[name]["named"] == "yes" for name in names)
        assert n_named >= least
        assert f"Of {words}, {n_named} are named" in page


@pytest.mark.parametrize("name", [name for name, line in STORED.items() if line["diagnosis"]])
def test_a_stored_diagnosis_that_names_the_mistake_has_its_words(name: str) -> None:
    words, line = EVERY[name][1], STORED[name]
    assert line["named"] != "yes" or words == NOT_NAMED or re.search(words, line["diagnosis"])


def judge(name: str, make: type[Springs]) -> Run:
    return run([Subject(name, make)], load_properties(QUESTIONS), examples=10, seed=1, shrink="none")


def test_the_right_springs_keep_their_promises_and_hear_nothing() -> None:
    result = judge("right", Springs)
    assert result.promises_kept
    assert not result.diagnoses


@pytest.mark.parametrize("name", CAUGHT)
def test_each_mistake_is_caught_and_named(name: str) -> None:
    make, words = EVERY[name]
    result = judge(name, make)
    assert not result.promises_kept
    assert words == NOT_NAMED or re.search(words, result.diagnoses.get(name, "")), result.diagnoses


def test_the_state_has_the_exact_forces() -> None:
    state = flat_state()
    along = state.case.positions[:, 0]
    pressure = state.case.penalty * -state.case.positions[0, 1]
    assert state.exact == pytest.approx(pressure * uniform_pressure_weights(state.case.interface, along))


@pytest.mark.parametrize(
    ("property_id", "name"), [(PATCH, name) for name in FORCES] + [(TANGENT, name) for name in TANGENTS]
)
def test_a_mistake_is_named_by_one_property(property_id: str, name: str) -> None:
    make, words = (FORCES if property_id == PATCH else TANGENTS)[name]
    assert words in diagnose(Subject(name, make), property_id)


@pytest.mark.parametrize("name", IN_INCLUDED)
def test_a_mistake_in_an_included_formulation_is_named(name: str) -> None:
    mutant = next(mutant for mutant in (*MUTANTS, *MUTANTS_IN_SPACE) if mutant.name == name)
    assert IN_INCLUDED[name] in diagnose(Subject(name, mutant.make), mutant.caught_by)


@pytest.mark.parametrize("name", [*STRANGERS, *standalone_names()])
def test_nothing_is_said_of_a_right_formulation(name: str) -> None:
    subject = Subject(name, STRANGERS[name]) if name in STRANGERS else load_subject(name)
    assert {diagnose(subject, property_id) for property_id in ("balance.force", "units", "purity", TANGENT)} == {""}


class Nodes:
    """Nodes of the slave against the nearest segment of the master, with areas; some places have no force."""

    traits = Traits(
        promises=Promises(patch=PatchPromises(normal=True)), rules=Rules(area="reference", penalty="distributed")
    )
    first_xi = 0.0
    n_left_out = 0
    add = staticmethod(np.sum)

    def __init__(self, *, penalty):
        self.penalty = penalty

    def residual(self, interface, pairing, z):
        x, n = z.reshape(-1, 2), interface.n_slave_nodes
        forces = np.zeros_like(x)
        areas = interface.slave.lengths(interface.nodes).repeat(2) / 2
        area = np.bincount(interface.slave.segments.reshape(-1), areas, n)
        for a, b in interface.master.segments[: len(interface.master) - self.n_left_out]:
            along = x[b] - x[a]
            normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
            xi, gap = (x[:n] - x[a]) @ along / (along @ along), (x[:n] - x[a]) @ normal
            acts = (xi >= self.first_xi) & (xi < 1) & (gap < 0)
            force = np.where(acts, self.penalty * gap * area, 0.0)
            forces[:n] += force[:, None] * normal
            forces[a] -= self.add((1 - xi) * force) * normal
            forces[b] -= self.add(xi * force) * normal
        return forces.reshape(-1)


@pytest.mark.parametrize(
    ("first_xi", "n_left_out", "words"),
    [
        (0.0, 0, ""),
        (0.0, 1, "slave nodes that face master segment 3 have no force"),
        (0.02, 0, "slave nodes that face master segment 1 between ξ = 0 and 0.024, or master segment 3 between"),
        (0.3, 0, "slave nodes have no force between ξ = 0 and 0.31 of a master segment"),
    ],
)
def test_places_without_force_are_named_where_only_matching_nodes_are_promised(
    first_xi: float, n_left_out: int, words: str
) -> None:
    make = type("Lost", (Nodes,), {"first_xi": first_xi, "n_left_out": n_left_out})
    text = diagnose(Subject("nodes", make), "balance.force")
    assert text.startswith(words)
    assert bool(text) == bool(words)


class LastAlone(Nodes):
    """The last of several points on a segment is added alone, as `forces[i] += …` does with equal indices."""

    traits = Nodes.traits.revise(conserves_force=True)
    add = staticmethod(lambda forces: forces[forces != 0][-1:].sum())


class Backwards(Nodes):
    def residual(self, interface, pairing, z):
        first, second = interface.master.segments[0]
        return super().residual(interface, pairing, z) * (np.nan if first > second else 1.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (LastAlone, r"gets 0\.\d+ times the force .* do several points add to one node \(`np.add.at`\)\?"),
        (Backwards, "not finite where nodes are numbered against the surfaces, and finite along them"),
    ],
)
def test_forces_that_are_lost_and_numbers_that_make_nan_are_named(make: type[Nodes], words: str) -> None:
    run_of_all = run([Subject("nodes", make)], load_properties(["balance.force"]), examples=3, seed=1, shrink="none")
    assert re.search(words, run_of_all.diagnoses["nodes"])


class ByNumbers(Springs):
    """Lengths of segments are kept in the process by how many there are."""

    lengths: ClassVar[dict[tuple[int, int], np.ndarray]] = {}

    def weights(self, length, slave_segment, n_segments):
        return self.lengths.setdefault((n_segments, len(length)), length.real) / 2


def test_what_is_kept_of_another_mesh_is_named() -> None:
    assert "something is kept by numbers" in diagnose(Subject("by numbers", ByNumbers), "patch.flat.resultant")


class Linear:
    """Forces that are linear in the positions, to the last bit, and a tangent with two wrong numbers."""

    traits = Springs.traits

    def __init__(self, *, penalty):
        self.penalty = penalty

    def residual(self, interface, pairing, z):
        return z @ np.tri(z.size)

    def tangent(self, interface, pairing, z):
        return np.tri(z.size).T + np.diag([1.0, 2.0], z.size - 2)


def make_flipped(*, penalty):
    """Return springs at nodes that state nothing, in whose tangent one entry of each has the opposite sign."""
    inner = load_subject("nts").with_penalty(penalty).plugin

    def tangent(interface, pairing, z):
        matrix, nodes = dense(inner.tangent(interface, pairing, z)), np.arange(len(SLAVE))
        matrix[2 * nodes, 2 * (2 * len(SLAVE) - 1 - nodes) + 1] *= -1
        return matrix

    return Changed(inner, tangent=tangent, traits=Traits())


def test_springs_that_state_nothing_hide_no_wrong_entry_of_a_tangent() -> None:
    forces, tangent = diagnose(Subject("flipped", make_flipped), "balance.force").split(OF_TANGENT)
    assert 'for nodal springs state penalty = "nodal"' in forces
    assert tangent == (
        "one entry of each slave node and its segment has the opposite sign, in row x of the slave node, "
        "column y of the first master node: AMATRX(1, 4) of a UEL"
    )


def test_a_wrong_tangent_of_linear_forces_is_none_of_differences() -> None:
    text = diagnose(Subject("linear", Linear), TANGENT)
    assert text
    assert "differences" not in text
