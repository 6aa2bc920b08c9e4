"""Hypothesis strategies for an author's own tests and properties, built constructively.

`interfaces`, `faces`, `states` and `projections` make examples for tests under `@given`. The others make the cases of
properties. All shrink to one unit segment a side, no motion, scale 1. Sizes are small integers × 2^k. Cases for
derivatives stand on a second, coprime lattice (sevenths), so that they are not at kinks.

Scenes with elastic bodies are in `contactverif.strategies.solids`, which imports the mechanics; this package does not.
"""

from contactverif.strategies.flat import flat_cases, normal_cases, overhung_cases, single_cases
from contactverif.strategies.general import general_cases, smooth_cases, tie_cases
from contactverif.strategies.meshes import faces, interfaces, states
from contactverif.strategies.point_projections import Projection, projections

__all__ = [
    "Projection",
    "faces",
    "flat_cases",
    "general_cases",
    "interfaces",
    "normal_cases",
    "overhung_cases",
    "projections",
    "single_cases",
    "smooth_cases",
    "states",
    "tie_cases",
]
