"""Shape functions of plane faces at points of their plane: linear on a triangle, bilinear on a quadrilateral.

The place of a point on a quadrilateral is the root of a quadratic equation in each coordinate, for real and complex
positions alike.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array

TRIANGLE = 3
# A foot past the border of a face by this share of it still counts, since one on an edge between two faces must stand
# on one of them. Shape functions are rounded by 2⁻⁵³ × how slender a face is: enough for faces of 1 : 10⁶.
PAST_BORDER = 2.0**-30


def cross_plane(first: Array, second: Array) -> Array:
    """Return the cross products (...,) of plane vectors (..., 2)."""
    product: Array = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return product


def evaluate_shapes(corners: Array, points: Array) -> Array:
    """Return the shape functions (..., n_points, n_corners) of faces (..., n_corners, 2).

    The points are (..., n_points, 2).
    """
    arm = points - corners[..., :1, :]
    if corners.shape[-2] == TRIANGLE:
        first, second = corners[..., 1:2, :] - corners[..., :1, :], corners[..., 2:, :] - corners[..., :1, :]
        area = cross_plane(first, second)
        s, t = cross_plane(arm, second) / area, cross_plane(first, arm) / area
        return np.stack([1 - s - t, s, t], axis=-1)
    s, t = _find_place(corners, arm)
    return np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)


def _find_place(corners: Array, arm: Array) -> tuple[Array, Array]:
    """Return the place (s, t) of points at an arm (..., n_points, 2) from corner 0 of quadrilaterals (..., 4, 2).

    With edges a and b at corner 0 and the twist w, a point is at p = s a + t b + s t w. Its cross product with b + s w
    leaves s alone, that with a + t w leaves t. The root of the discriminant of both is the Jacobian at the point. It
    has the sign of the face's area, and so has what it is added to: nothing cancels where the twist is small, or 0.
    """
    first, second, third, last = (corners[..., i : i + 1, :] for i in range(4))
    a, b, w = second - first, last - first, (first - second) + (third - last)
    area, turn = cross_plane(a, b), cross_plane(arm, w)
    by_s, by_t = cross_plane(arm, b), cross_plane(a, arm)
    jacobian_s = _root((area - turn) ** 2 + 4 * cross_plane(a, w) * by_s, area)
    jacobian_t = _root((area + turn) ** 2 + 4 * cross_plane(w, b) * by_t, area)
    return 2 * by_s / (area - turn + jacobian_s), 2 * by_t / (area + turn + jacobian_t)


def _root(square: Array, sign: Array) -> Array:
    """Return the root with a sign; 0 for a negative number, since far outside of a face a point has no place."""
    root = np.sqrt(np.where(square.real > 0, square, 0.0))
    return np.where(sign.real < 0, -root, root)
