"""Vectors of derivatives, and the block of a force that turns with the normal of its master segment.

Source: Zavarise & De Lorenzis (2009), Eqs. A1–A6.
"""

from __future__ import annotations

from contactverif.compiler import compile_inline, compile_part
from contactverif.geometry.block_rows import add_block
from contactverif.geometry.projection import Vector
from contactverif_nts.eq6 import Contact, Csr

ZERO = (0.0, 0.0)


@compile_part
def times(factor: float, a: Vector) -> Vector:
    """Return factor × a."""
    return factor * a[0], factor * a[1]


@compile_part
def plus(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1]


@compile_inline
def add_turned_force(csr: Csr, row: int, column: int, v: Contact, force: float, d_force: Vector, omega: Vector) -> None:
    """Add Δ(force n) = n Δforce + force Δn, with Δn = −t ω, to the rows of one node and the columns of another.

    `d_force` and `omega` are gained for a displacement of the node `column`.
    """
    normal, t = v.normal, v.t
    xx = normal[0] * d_force[0] - force * t[0] * omega[0]
    xy = normal[0] * d_force[1] - force * t[0] * omega[1]
    yx = normal[1] * d_force[0] - force * t[1] * omega[0]
    yy = normal[1] * d_force[1] - force * t[1] * omega[1]
    add_block(csr, row, column, xx, xy, yx, yy)
