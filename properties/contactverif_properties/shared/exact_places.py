"""The contact points that a formulation reports, beside what is exact at their places.

A point is formed in rationals from the stored nodes of its slave segment and the reported c. Its reported position is
rounded at its distance from the origin, and serves for nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases, random_source
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Interface
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.oracle.exact_points import ExactPoints, Lattice, View, closest_view, run_against, slave_normal_view
from contactverif.strategies import general_cases, tie_cases
from contactverif.strategies.projection_situations import KINDS, projection_states, projections_by_kind
from contactverif_properties.shared.any_state import any_cases, freeze_state
from contactverif_properties.shared.passes import Pass, split_passes
from contactverif_properties.shared.roundoff import rounding_distance

LARGER_MESHES = ("larger random mesh", "larger mesh, exact ties")
PROJECTED_KINDS = (*KINDS, *LARGER_MESHES)
CLOSEST = "closest point"
CELLS = ("cells", "cells and nodes")

LOCAL_REASON = (
    "A gap is a difference of the lengths L of both segments and |P − A|, each rounded a few times; along the slave's "
    "normal over the cosine. A kernel that centres its coordinates rounds them at D; X takes the place of D where the "
    "traits do not promise `translation_stable`."
)
FOOT_REASON = LOCAL_REASON + " Rounding the ends of a segment turns it by uD/ℓ, which moves a foot by |gap| uD/ℓ."


@dataclass(frozen=True, slots=True, eq=False)
class Reported:
    """The answers of a formulation in a state."""

    state: Case  # With multipliers, if the formulation has any.
    forces: FloatArray  # The position rows of the residual, of shape (n_nodes, dim).
    points: ContactPoints
    traits: Traits

    @classmethod
    def from_case(cls, case: Case, subject: Subject) -> Reported:
        """Ask a formulation about a case without multipliers."""
        frozen = freeze_state(case, subject)
        forces, points = frozen.formulation.answers([frozen.call("residual"), frozen.call("contact_points")])
        return cls(
            frozen.case, forces[: case.interface.n_unknowns].reshape(case.positions.shape), points, subject.traits
        )

    @property
    def passes(self) -> Iterator[Pass]:
        """The points by pass."""
        return split_passes(self.state, self.points)

    @property
    def distant(self) -> float:
        """The length Z at which a point may be rounded."""
        return rounding_distance(self.state, self.traits)


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """The points of a pass that name a place on a slave segment and a master segment.

    A scale is the length of which rounding is a share: L + |P − A|, plus D or X, at which a point may be rounded, over
    the cosine; infinite where the rule sees nothing of the segment.
    """

    interface: Interface  # In the roles of the pass.
    lattice: Lattice
    reported: ContactPoints
    exact: ExactPoints
    view: View  # Of the reported master segment, by the rule of the formulation.
    scale: FloatArray  # (n_points,), as are the others.
    gap_scale: FloatArray  # Past an end of the master segment by ξ', its ends are extrapolated: D ξ' is added.
    # Rounding its ends at D turns the segment of length ℓ whose normal is taken by uD/ℓ, which moves the foot by
    # |gap| uD/ℓ. So |gap| D/ℓ is added too.
    foot_scale: FloatArray
    facing: BoolArray  # True where the slave segment and the master segment run against each other.

    @classmethod
    def from_pass(cls, each: Pass, rule: str | None, distant: float) -> Places:
        """Return the places of a pass; `rule` is the trait `gap`, `distant` where points may be rounded, a length."""
        points = each.points.select(name_places(each.points) & (each.points.master_segment >= 0))
        lattice = Lattice.from_state(each.interface, each.z)
        exact = ExactPoints.at(lattice, points.slave_segment, points.c)
        look = closest_view if rule == CLOSEST else slave_normal_view
        view = look(lattice, exact, points.master_segment)
        with np.errstate(divide="ignore"):
            over, xi = np.where(view.cosine > 0, 1 / np.abs(view.cosine), np.inf), view.xi.floats()
        carrier = view.master_length if rule == CLOSEST else view.slave_length
        size = view.lengths + distant
        gap_size = size + distant * np.maximum(0, np.maximum(-xi, xi - 1))
        foot_size = gap_size + distant * np.abs(view.gap.floats()) / carrier
        scales = (size * over, gap_size * over, foot_size * over)
        facing = run_against(lattice, exact, points.master_segment)
        return cls(each.interface, lattice, points, exact, view, *scales, facing)


def name_places(points: ContactPoints) -> BoolArray:
    """Return which points (n_points,) name a place on their surface."""
    placed = np.isfinite(points.slave_shape).all(axis=1) if points.slave_shape.shape[1] else np.isfinite(points.c)
    return np.asarray((points.slave_segment >= 0) & placed)


@random_source("contactverif_properties.shared.exact_places.projected_cases")
def projected_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case]:
    """Return {kind: strategy} of `PROJECTED_KINDS`, or one strategy for states of a given interface."""
    if interface is not None:
        return st.one_of(projection_states(interface), any_cases(interface))
    return projections_by_kind() | dict(zip(LARGER_MESHES, (general_cases(), tie_cases()), strict=True))


def largest(values: FloatArray) -> float:
    """Return the largest of some values ≥ 0; NaN if one is NaN, 0 if there are none."""
    return float(np.max(values, initial=0.0))


define_projection = partial(
    Property.define,
    family="projection",
    cases=Cases.by_kind(projected_cases),
    kinds=PROJECTED_KINDS,
    promise=lambda traits: True,
    needs=frozenset({"contact_points"}),
)
