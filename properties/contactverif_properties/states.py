"""A formulation in one state, on a pairing that stays frozen: what the properties ask it there, and its points by pass.

A formulation with multipliers is asked about a state with random multipliers that press. No body gives a unit of
pressure there. The harness chooses one in which c = 1 and multipliers are as large as penetrations would be, so that
forces, constraints and all parts of a tangent have one size and one unit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import Array, FloatArray, IntArray, dense
from contactverif.contract.case import Case, random_source
from contactverif.contract.formulation import ContactPoints, Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.subject import Call, CheckedFormulation, Subject, lazy
from contactverif.strategies import general_cases, tie_cases


@dataclass(frozen=True, slots=True, eq=False)
class Pass:
    """The points of one pass, with the interface and the positions in the roles of that pass."""

    interface: Interface  # The interface in which the points lie on the slave.
    z: FloatArray  # (n_unknowns,) The current positions, flat, in the order of its nodes; no multipliers.
    points: ContactPoints  # The points.
    numbers: IntArray  # (n_nodes,) The number that each node of `interface` has in the interface of the case.
    second: bool  # True for the second pass, in which the roles are exchanged.

    @property
    def positions(self) -> FloatArray:
        """The current positions (n_nodes, dim)."""
        return self.z.reshape(self.interface.nodes.shape)


def split_passes(case: Case, points: ContactPoints) -> Iterator[Pass]:
    """Yield the points of the slave, and those of a second pass if there are any."""
    interface, numbers = case.interface, np.arange(case.interface.n_nodes)
    for second in (False, True):
        mask = points.on_master == second
        if second:
            if not mask.any():
                return
            interface, numbers = interface.swap_roles(), np.roll(numbers, -interface.n_slave_nodes)
        z = case.positions[numbers].reshape(-1)
        yield Pass(interface, z, points if mask.all() else points.select(mask), numbers, second)


def nearest_sum(points: ContactPoints, force: float) -> float:
    """Return the sum of pressure × weight over active points that is nearer to a force on the slave.

    In two passes the points of both surfaces push both bodies. In half passes those of the slave push the slave alone.
    """
    pushes = np.where(points.active, points.pressure * points.weight, 0.0)
    sums = float(pushes[~points.on_master].sum()), float(pushes.sum())
    return min(sums, key=lambda total: abs(total - force))


@dataclass(frozen=True, eq=False)
class FrozenState:
    """A formulation in one state, on a frozen pairing."""

    formulation: CheckedFormulation
    case: Case  # The state, with its multipliers if there are any.
    pairing: Pairing | None

    @classmethod
    def at(cls, formulation: CheckedFormulation, case: Case) -> FrozenState:
        """Return a state with its own pairing."""
        return cls(formulation, case, formulation.pair(case.interface, case.z))

    @classmethod
    def with_multiplier(cls, formulation: CheckedFormulation, case: Case, multiplier: float) -> FrozenState:
        """Return a state with its own pairing, in which all multipliers, if there are any, are alike."""
        count = formulation.n_multipliers(case.interface)
        return cls.at(formulation, case.with_multipliers(np.full(count, multiplier)))

    def call(self, method: str) -> Call:
        """Return the call of a method at the state, for `CheckedFormulation.answers`."""
        return method, self.case.interface, self.pairing, self.case.z

    def residual_at(self, z: Array) -> Array:
        """Return the residuals (..., n) at other states z (..., n), on the pairing of this one."""
        return self.formulation.residual(self.case.interface, self.pairing, z)

    @lazy
    def residual(self) -> FloatArray:
        """The residual (n_unknowns + n_multipliers,)."""
        return self.residual_at(self.case.z)

    @property
    def forces(self) -> FloatArray:
        """The position rows of the residual, (n_nodes, dim): the forces that pull the nodes back."""
        return self.residual[: self.case.interface.n_unknowns].reshape(self.case.interface.nodes.shape)

    @lazy
    def tangent(self) -> FloatArray:
        """The tangent (n, n) with n = n_unknowns + n_multipliers."""
        return dense(self.formulation.tangent(self.case.interface, self.pairing, self.case.z))

    @property
    def has_points(self) -> bool:
        """True if the formulation reports contact points."""
        return "contact_points" in self.formulation.provides

    @lazy
    def points(self) -> ContactPoints:
        """The contact points."""
        return self.formulation.contact_points(self.case.interface, self.pairing, self.case.z)

    @property
    def passes(self) -> Iterator[Pass]:
        """The contact points by pass."""
        return split_passes(self.case, self.points)


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


def ask_forces_and_tangents(subject: Subject, *states: FrozenState) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the residuals (n,) of one formulation in some states, and its tangents (n, n) if it calls them exact.

    A tangent by differences is another one after any change, by more than roundoff makes of an exact one.
    """
    formulation, is_exact = states[0].formulation, subject.traits.promises.tangent == "exact"
    methods = ["residual", *(["tangent"] if is_exact and "tangent" in formulation.provides else [])]
    answers = formulation.answers([state.call(method) for method in methods for state in states])
    return answers[: len(states)], [dense(tangent) for tangent in answers[len(states) :]]


def random_moves(seed: int, count: int, size: int) -> FloatArray:
    """Draw vectors (count, size) whose entries are uniform in [−1, 1]."""
    return np.random.default_rng(seed).uniform(-1, 1, (count, size))


def random_directions(seed: int, count: int, size: int) -> FloatArray:
    """Draw directions (count, size): random moves, each divided by its largest entry, which becomes ±1."""
    moves = random_moves(seed, count, size)
    return np.asarray(moves / np.abs(moves).max(axis=1, keepdims=True))
