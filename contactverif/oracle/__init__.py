"""Exact answers to judge by. The judge shares no code with the judged: nothing here is used by a plugin."""

from contactverif.oracle.consistent import uniform_pressure_weights, uniform_pressure_weights_exact
from contactverif.oracle.exact_projection import Projection, nearest, projection_cases
from contactverif.oracle.kink_distance import kink_margin, usual_places

__all__ = [
    "Projection",
    "kink_margin",
    "nearest",
    "projection_cases",
    "uniform_pressure_weights",
    "uniform_pressure_weights_exact",
    "usual_places",
]
