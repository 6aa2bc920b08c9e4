"""All right formulations that are written from papers and textbooks, each with what it is.

Each promises what theory says of it, and no more. None may ever be accused. A formulation is a class or a factory
`make(*, penalty)` with traits.
"""

from collections.abc import Callable
from typing import Any

from zoo import at_points, laws, on_strips

STRANGERS: dict[str, Callable[..., Any]] = {
    "points first, no tolerance, the last of ties": at_points.PointsFirst,
    "points in a frame along the first segment": at_points.TurnedFrame,
    "two Gauss points along the slave's normal": at_points.SlaveNormalAtGaussPoints,
    "points that look no farther than a segment": at_points.NearbyOnly,
    "nodal least squares": on_strips.NodalLeastSquares,
    "discontinuous quadratic mortar": on_strips.DiscontinuousMortar,
    "exact segments with three Gauss points": on_strips.SegmentPenalty,
    "exact segments with Simpson's rule": on_strips.SimpsonPoints,
    "exact segments with a table of 14 digits": on_strips.TabulatedPoints,
    "exact segments with five computed points": on_strips.ComputedPoints,
    "exact segments with a tangent by differences": on_strips.ByDifferences,
    "both sides with half the stiffness": on_strips.BothSidesHalved,
    "half passes in both directions": on_strips.HalfPasses,
    "smoothed normals": at_points.SmoothedNormals,
    "two Gauss points along the master's normal": at_points.GaussClosest,
    "one virtual slave node": on_strips.OnePoint,
    "nodes with current areas": at_points.NodesWithAreas,
    "nodes with areas of the reference": at_points.NodesWithPotential,
    "nodes with multipliers": at_points.NodesWithMultipliers,
    "springs on the middle line": on_strips.MiddleLine,
    "an energy of what faces the master": on_strips.StripEnergy,
    "a logarithmic barrier on both sides": at_points.LogBarrier,
    "a law of its own, quadratic": laws.Quadratic,
    "a law of its own, exponential from a gap on": laws.Exponential,
    "a law of its own, constant": laws.Constant,
}
