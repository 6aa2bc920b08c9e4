"""What roundoff alone may do: the tolerances that several properties share, each with its reason.

Symbols: u = 2⁻⁵³; X largest coordinate; g penetration; ℓ shortest segment; L slave length; N number of segments.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array
from contactverif.contract.case import Case
from contactverif.contract.property import Quantity

PATCH = "u(8X/|g| + 4N)"
PATCH_REASON = "a gap is a difference of coordinates, each rounded to uX; N forces are summed"
TURNED = "u(8X/min(g, ℓ) + 4N)"
TURNED_REASON = "as for a gap; and rounding the ends of a segment turns it by uX/ℓ, and its force with it"


def slave_forces(case: Case, forces: Array) -> float:
    """Σ|R| over the slave nodes, from forces (n_unknowns,), whatever stands behind them."""
    return float(np.abs(forces.reshape(-1)[: 2 * case.interface.n_slave_nodes]).sum())


def mean_penetration(case: Case, forces: Array) -> float:
    """g of a state whose penetration varies: the uniform one that the same Σ|R| would need, Σ|R| / (ε̂ L)."""
    return slave_forces(case, forces) / (case.penalty * case.slave_length)


def of_gap(case: Case, penetration: float) -> float:
    """u(8X/|g| + 4N). Where nothing penetrates there is no gap to round, and a force is wrong at any size."""
    gap_rounding = 8 * case.largest_coordinate / penetration if penetration > 0 else 0.0
    return UNIT_ROUNDOFF * (gap_rounding + 4 * case.n_segments)


def share(part: float, whole: float) -> float:
    """part / whole; nothing of nothing is nothing, something of nothing is infinite."""
    if whole > 0:
        return part / whole
    return 0.0 if part == 0 else np.inf


def gap_quantity(name: str) -> Quantity:
    """A ratio that only the rounding of gaps may keep from zero."""
    return Quantity(name, "1", PATCH, PATCH_REASON)
