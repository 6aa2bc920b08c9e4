"""Right formulations as a stranger might write them, from papers and textbooks: no code of a plugin is used.

Each promises what theory says of it, and no more. None may ever be accused. `STRANGERS` names all; a formulation of it
is a class or a factory `make(*, penalty)` with traits.
"""

from collections.abc import Callable
from typing import Any

from strangers.discontinuous_mortar import DiscontinuousMortar
from strangers.gauss_closest import GaussClosest
from strangers.half_passes import HalfPasses
from strangers.log_barrier import LogBarrier
from strangers.middle_line import MiddleLine
from strangers.nodal_least_squares import NodalLeastSquares
from strangers.node_to_segment import NodesWithAreas, NodesWithMultipliers, NodesWithPotential
from strangers.one_point import OnePoint
from strangers.segment_penalty import (
    BothSidesHalved,
    ComputedPoints,
    SegmentPenalty,
    SimpsonPoints,
    TabulatedPoints,
)
from strangers.smoothed_normals import SmoothedNormals
from strangers.springs_at_points import NearbyOnly, PointsFirst, SlaveNormalAtGaussPoints, TurnedFrame
from strangers.strip_energy import StripEnergy

__all__ = ["STRANGERS", "NearbyOnly", "PointsFirst", "SlaveNormalAtGaussPoints", "TurnedFrame"]

STRANGERS: dict[str, Callable[..., Any]] = {
    "points first, no tolerance, the last of ties": PointsFirst,
    "points in a frame along the first segment": TurnedFrame,
    "two Gauss points along the slave's normal": SlaveNormalAtGaussPoints,
    "points that look no farther than a segment": NearbyOnly,
    "nodal least squares": NodalLeastSquares,
    "discontinuous quadratic mortar": DiscontinuousMortar,
    "exact segments with three Gauss points": SegmentPenalty,
    "exact segments with Simpson's rule": SimpsonPoints,
    "exact segments with a table of 14 digits": TabulatedPoints,
    "exact segments with five computed points": ComputedPoints,
    "both sides with half the stiffness": BothSidesHalved,
    "half passes in both directions": HalfPasses,
    "smoothed normals": SmoothedNormals,
    "two Gauss points along the master's normal": GaussClosest,
    "one virtual slave node": OnePoint,
    "nodes with current areas": NodesWithAreas,
    "nodes with areas of the reference": NodesWithPotential,
    "nodes with multipliers": NodesWithMultipliers,
    "springs on the middle line": MiddleLine,
    "an energy of what faces the master": StripEnergy,
    "a logarithmic barrier on both sides": LogBarrier,
}
