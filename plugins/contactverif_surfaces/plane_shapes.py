"""Shape functions of plane faces at points of their plane: linear on a triangle, bilinear on a quadrilateral.

The place of a point on a quadrilateral is the root of two quadratic equations. Newton's method starts from the middle
and takes a fixed number of steps, so that real and complex positions take the same path. On a parallelogram one step is
exact.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array

TRIANGLE = 3
# A foot past the border of a face by this share of it still counts, since one on an edge between two faces must stand
# on one of them. Shape functions are rounded by 2⁻⁵³ × how slender a face is: enough for faces of 1 : 10⁶.
PAST_BORDER = 2.0**-30
N_STEPS = 12  # Steps of Newton's method; on convex faces it converges to roundoff in six or fewer.


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
    """Return the place (s, t) of points at an arm (..., n_points, 2) from corner 0 of quadrilaterals (..., 4, 2)."""
    a, b, c, d = (corners[..., i : i + 1, :] for i in range(4))
    along, up, twist = b - a, d - a, (a - b) + (c - d)
    s = np.full(np.broadcast_shapes(arm.shape, along.shape)[:-1], 0.5, np.result_type(arm, corners))
    t = s.copy()
    for _ in range(N_STEPS):
        rest = arm - s[..., None] * along - t[..., None] * up - (s * t)[..., None] * twist
        by_s, by_t = along + t[..., None] * twist, up + s[..., None] * twist
        area = cross_plane(by_s, by_t)
        s, t = s + cross_plane(rest, by_t) / area, t + cross_plane(by_s, rest) / area
    return s, t
