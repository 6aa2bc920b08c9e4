"""Two blocks on meshes that are refined together: the scenes on which the inf-sup constant is computed.

Both blocks are 4 × 1 with E = 1 and ν = 0.3. They touch without a load, with rollers at their sides, and are held on
the sides away from the interface. Cells are square at the interface and grow away from it, since a pressure of
wavelength λ strains a body to a depth of λ/2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.simple_bodies import Rectangle
from contactverif.problems.blocks import two_blocks

WIDTH, HEIGHT = 4.0, 1.0
POISSON = 0.3
N_MESHES = 5
# The segments of slave and master on the coarsest mesh.
FAMILIES: Mapping[str, tuple[int, int]] = {"slave coarser, 2:3": (4, 6), "slave finer, 3:2": (6, 4), "matching": (4, 4)}
_GROWTH = 1.6  # The height of a row of cells over that of the row before.
PENALTY = 10.0  # The scale of the contact decision of multipliers.


@cache
def refined_blocks(n_slave: int, n_master: int) -> Scene:
    """Return two blocks that touch, with equal segments on each side; the fact "columns" (2,) has their numbers."""
    scene = two_blocks(_rectangle(n_slave, upper=True), _rectangle(n_master, upper=False), penalty=PENALTY, approach=0)
    return replace(scene, facts={"columns": np.array([n_slave, n_master], dtype=np.float64)})


@cache
def refinement_cases() -> tuple[Case, ...]:
    """Return the coarsest mesh of each family, by its name."""
    return tuple(replace(refined_blocks(*columns).case(), name=name) for name, columns in FAMILIES.items())


def refinements(case: Case) -> tuple[Scene, ...]:
    """Return the scenes of a family from coarse to fine, each with twice the segments of the one before."""
    n_slave, n_master = case.parameters["columns"].astype(int).tolist()
    return tuple(refined_blocks(n_slave * 2**level, n_master * 2**level) for level in range(N_MESHES))


def _rectangle(n_columns: int, *, upper: bool) -> Rectangle:
    lines = _row_lines(WIDTH / n_columns)
    return Rectangle(np.linspace(0, WIDTH, n_columns + 1), lines if upper else -lines[::-1], poisson=POISSON)


def _row_lines(first: float) -> FloatArray:
    """Return the heights (n,) of the lines between rows, from 0 to the height of the block."""
    lines, height = [0.0], first
    while lines[-1] + height < HEIGHT:
        lines.append(lines[-1] + height)
        height *= _GROWTH
    if len(lines) > 1 and HEIGHT - lines[-1] < (lines[-1] - lines[-2]) / 2:  # No thin last row.
        lines.pop()
    return np.array([*lines, HEIGHT])
