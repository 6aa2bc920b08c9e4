"""Exact answers to judge by. The judge shares no code with the judged: nothing here is used by a plugin."""

from contactverif.oracle.consistent import uniform_pressure_weights, uniform_pressure_weights_exact
from contactverif.oracle.exact_projection import Projection, project_point, projection_cases
from contactverif.oracle.kink_distance import default_points, kink_margin

__all__ = [
    "Projection",
    "default_points",
    "kink_margin",
    "project_point",
    "projection_cases",
    "uniform_pressure_weights",
    "uniform_pressure_weights_exact",
]
