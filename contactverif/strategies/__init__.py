"""What cases are made of, and the cases themselves: hypothesis strategies, built constructively and never filtered.

All shrink to one unit segment a side, no motion, scale 1. Sizes are small integers × 2^k; cases for derivatives stand
on a second, coprime lattice (sevenths), so that they are not at kinks; exact ties are a strategy of their own.
"""

from contactverif.strategies.flat import flat_cases
from contactverif.strategies.general import general_cases, smooth_cases
from contactverif.strategies.named import NAMED, named_case
from contactverif.strategies.solids import (
    VARIANTS,
    block_cases,
    dead_zone_cases,
    named_scene,
    solid_cases,
    variant_cases,
)
from contactverif.strategies.ties import tie_cases

__all__ = [
    "NAMED",
    "VARIANTS",
    "block_cases",
    "dead_zone_cases",
    "flat_cases",
    "general_cases",
    "named_case",
    "named_scene",
    "smooth_cases",
    "solid_cases",
    "tie_cases",
    "variant_cases",
]
