"""A formulation in one state, on a pairing that stays frozen: what the properties ask it there.

Each answer at the state itself is asked for once, when it is first used.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import Array, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.lazy import lazy
from contactverif.contract.pairing import Pairing
from contactverif.contract.subject import Call, CheckedFormulation
from contactverif_properties.shared.passes import Pass, split_passes


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
