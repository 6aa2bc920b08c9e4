"""Each mistake that a rule knows is named, and no right formulation hears anything."""

from typing import Any

import numpy as np
import pytest
from killing import properties
from strangers import STRANGERS
from subjects import load_subject, plane_names
from wrong import MUTANTS
from wrong_springs import FORCES, TANGENTS, Right

from contactverif.contract.interface import Interface
from contactverif.contract.result import Run
from contactverif.contract.subject import Subject
from contactverif.contract.traits import PatchPromises, Promises, Rules, Traits
from contactverif.diagnosis.diagnose import diagnose
from contactverif.diagnosis.flat_state import flat_state
from contactverif.oracle import uniform_pressure_weights
from contactverif.run.run import run

TANGENT, PATCH = "tangent.directional", "patch.flat.transmission"
# Mutants of the included formulations, each with the words that name its mistake.
KNOWN = {
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
}


def test_the_state_has_the_exact_forces() -> None:
    state = flat_state()
    along = state.case.positions[:, 0]
    pressure = state.case.penalty * -state.case.positions[0, 1]
    assert state.exact == pytest.approx(pressure * uniform_pressure_weights(state.case.interface, along))


@pytest.mark.parametrize("name", FORCES)
def test_a_mistake_in_the_forces_is_named(name: str) -> None:
    make, words = FORCES[name]
    assert words in diagnose(Subject(name, make), PATCH)


@pytest.mark.parametrize("name", TANGENTS)
def test_a_mistake_in_the_tangent_is_named(name: str) -> None:
    make, words = TANGENTS[name]
    assert words in diagnose(Subject(name, make), TANGENT)


@pytest.mark.parametrize("name", KNOWN)
def test_a_mistake_in_an_included_formulation_is_named(name: str) -> None:
    (mutant,) = [mutant for mutant in MUTANTS if mutant.name == name]
    assert KNOWN[name] in diagnose(Subject(name, mutant.make), mutant.caught_by)


@pytest.mark.parametrize("name", STRANGERS)
def test_nothing_is_said_of_a_right_formulation_of_a_stranger(name: str) -> None:
    subject = Subject(name, STRANGERS[name])
    assert [diagnose(subject, property_id) for property_id in ("balance.force", "units", TANGENT)] == [""] * 3


@pytest.mark.parametrize("name", plane_names())
def test_nothing_is_said_of_an_included_formulation(name: str) -> None:
    subject = load_subject(name)
    assert [diagnose(subject, property_id) for property_id in ("balance.force", "units", TANGENT)] == [""] * 3


class Nodes:
    """Nodes of the slave against the nearest segment of the master, with areas; some places have no force."""

    traits = Traits(
        promises=Promises(patch=PatchPromises(normal=True)), rules=Rules(area="reference", penalty="distributed")
    )
    first_xi = 0.0
    n_left_out = 0

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
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
            forces[a] -= ((1 - xi) * force).sum() * normal
            forces[b] -= (xi * force).sum() * normal
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


def judge_patch(make: type[Right]) -> Run:
    questions = [question for question in properties() if question.id == PATCH]
    return run([Subject("mine", make)], questions, examples=3, seed=1, shrink="none")


def test_a_run_says_it_of_what_fails_alone() -> None:
    make, words = FORCES["twice"]
    assert isinstance(make, type)
    assert words in judge_patch(make).diagnoses["mine"]
    assert not judge_patch(Right).diagnoses


class Linear:
    """Forces that are linear in the positions, to the last bit, and a tangent with two wrong numbers."""

    traits = Right.traits

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        return z @ np.tri(z.size)

    def tangent(self, interface: Interface, pairing: Any, z: Any) -> Any:
        return np.tri(z.size).T + np.diag([1.0, 2.0], z.size - 2)


def test_a_wrong_tangent_of_linear_forces_is_none_of_differences() -> None:
    text = diagnose(Subject("linear", Linear), TANGENT)
    assert text
    assert "differences" not in text
