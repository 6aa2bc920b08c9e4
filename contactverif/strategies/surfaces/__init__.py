"""Hypothesis strategies for interfaces in space: grids of triangles and of quadrilaterals, built and never filtered.

All shrink to one square on one square, each cut in two, without any motion.
"""

from contactverif.strategies.surfaces.plane_slaves import plane_cases_by_a_plate, tilted_plane_cases
from contactverif.strategies.surfaces.tilted_surfaces import (
    smooth_surface_cases,
    surface_cases,
    translated_surface_cases,
)
from contactverif.strategies.surfaces.uniform_surfaces import (
    flat_surface_cases,
    matched_surface_cases,
    overhung_surface_cases,
    skewed_surface_cases,
)

__all__ = [
    "flat_surface_cases",
    "matched_surface_cases",
    "overhung_surface_cases",
    "plane_cases_by_a_plate",
    "skewed_surface_cases",
    "smooth_surface_cases",
    "surface_cases",
    "tilted_plane_cases",
    "translated_surface_cases",
]
