"""Cases for questions that make sense in any state, and the formulation with a complete state to ask them about.

A formulation with multipliers is asked about a state with random multipliers that press. No body gives a unit of
pressure there. The harness chooses one in which c = 1 and multipliers are as large as penetrations would be, so that
forces, constraints and all parts of a tangent have one size and one unit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.interface import Interface
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.strategies import general_cases, tie_cases
from contactverif_properties.shared.frozen_state import FrozenState

SMALLEST, LARGEST = 0.125, 0.25  # The range of random multipliers over the shortest segment.


@random_source("contactverif_properties.shared.any_state.any_cases")
def any_cases(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Return a strategy of random meshes and states, exact ties among them."""
    if interface is not None:
        return general_cases(interface)
    return st.one_of(general_cases(), general_cases(), tie_cases())


def prepare_state(case: Case, subject: Subject) -> tuple[CheckedFormulation, Case]:
    """Return the formulation with the penalty of the case, and the case with multipliers if the formulation has any."""
    formulation = subject.for_case(case)
    if not formulation.n_multipliers(case.interface):
        return formulation, case
    low, high = (share * case.resolution for share in (SMALLEST, LARGEST))
    formulation = subject.with_penalty(1.0)
    random = np.random.default_rng([case.seed, 1])  # Other numbers than those that the property draws for itself.
    multipliers = random.uniform(low, high, formulation.n_multipliers(case.interface))
    return formulation, replace(case, penalty=1.0).with_multipliers(multipliers)


def move_state(case: Case, shift: FloatArray) -> Case:
    """Return the case with state and reference moved by a vector (dim,), a length each.

    The move is exact where every coordinate and its sum with the vector have at most 53 bits; the caller sees to that.
    """
    positions = (case.positions + shift).reshape(-1)
    interface = case.interface.at(case.interface.nodes + shift)
    return replace(case, interface=interface, z=np.concatenate([positions, case.multipliers]))


def freeze_state(case: Case, subject: Subject) -> FrozenState:
    """Return what `prepare_state` does, with the pairing of the state."""
    return FrozenState.at(*prepare_state(case, subject))


def ask_forces_and_tangents(*states: FrozenState) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the residuals (n,) and the tangents (n, n), if there are any, of one formulation in some states."""
    formulation = states[0].formulation
    methods = ["residual", *(["tangent"] if "tangent" in formulation.provides else [])]
    answers = formulation.answers([state.call(method) for method in methods for state in states])
    return answers[: len(states)], [dense(tangent) for tangent in answers[len(states) :]]


def random_moves(seed: int, count: int, size: int) -> FloatArray:
    """Draw vectors (count, size) whose entries are uniform in [−1, 1]."""
    return np.random.default_rng(seed).uniform(-1, 1, (count, size))


def random_directions(seed: int, count: int, size: int) -> FloatArray:
    """Draw directions (count, size): random moves, each divided by its largest entry, which becomes ±1."""
    moves = random_moves(seed, count, size)
    directions: FloatArray = moves / np.abs(moves).max(axis=1, keepdims=True)
    return directions
