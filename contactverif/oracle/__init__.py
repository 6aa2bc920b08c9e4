"""Exact answers to judge by: consistent nodal forces, projections, and the distance of a state to a kink.

Rule for the next editor: the judge shares no code with the judged. No plugin uses anything here, and nothing here uses
the compiled geometry of plugins. Where it is affordable, the arithmetic is rational and thus exact.
"""

from contactverif.oracle.flat_answers import (
    is_of_class,
    nodal_spring_weights,
    nodal_surface_weights,
    uniform_pressure_weights,
    uniform_pressure_weights_exact,
    uniform_surface_weights,
    uniform_surface_weights_exact,
)
from contactverif.oracle.kink_distance import default_points, kink_margin
from contactverif.oracle.nearest import Nearest, NearSegment, nearest_segments
from contactverif.oracle.projection_kinds import is_of_kind, kind_of

__all__ = [
    "NearSegment",
    "Nearest",
    "default_points",
    "is_of_class",
    "is_of_kind",
    "kind_of",
    "kink_margin",
    "nearest_segments",
    "nodal_spring_weights",
    "nodal_surface_weights",
    "uniform_pressure_weights",
    "uniform_pressure_weights_exact",
    "uniform_surface_weights",
    "uniform_surface_weights_exact",
]
