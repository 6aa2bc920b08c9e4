"""Hypothesis strategies for cases: random interfaces with their states, built constructively and never filtered.

All shrink to one unit segment a side, no motion, scale 1. Sizes are small integers × 2^k. Cases for derivatives stand
on a second, coprime lattice (sevenths), so that they are not at kinks. Exact ties are a strategy of their own.

Scenes with elastic bodies are in `contactverif.strategies.solids`, which imports the mechanics; this package does not.
"""

from contactverif.strategies.flat import flat_cases, normal_cases, overhung_cases, single_cases
from contactverif.strategies.general import general_cases, smooth_cases
from contactverif.strategies.ties import tie_cases

__all__ = ["flat_cases", "general_cases", "normal_cases", "overhung_cases", "single_cases", "smooth_cases", "tie_cases"]
