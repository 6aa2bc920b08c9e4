"""The closest master segment of points, with the inner segments extended so that no point is lost at a kink."""

from typing import Any

import numpy as np


def closest_segments(points: Any, master: Any, x: Any) -> tuple[Any, Any]:
    """Return the numbers (n,) of the closest master segments of points (n, 2), and whether the foot is on the master.

    Of segments that are equally near, as at a vertex, the one counts whose line passes farther from the point: the foot
    is least past its end there.
    """
    first, second = x[master.segments[:, 0]], x[master.segments[:, 1]]
    along = second - first
    offset, beyond = points[:, None] - first, points[:, None] - second
    size = np.hypot(*along.T)
    advance = np.einsum("pmi,mi->pm", offset, along) / size
    height = np.einsum("pmi,mi->pm", offset, np.column_stack([along[:, 1], -along[:, 0]]) / size[:, None])
    rest = np.einsum("pmi,mi->pm", beyond, along) / size  # Positive past the second node
    distance = np.where(
        advance <= 0,
        np.hypot(offset[..., 0], offset[..., 1]),
        np.where(rest >= 0, np.hypot(beyond[..., 0], beyond[..., 1]), np.abs(height)),
    )
    near = distance <= distance.min(axis=1, keepdims=True) * (1 + 1e-13)
    number = np.where(near, np.abs(height), -1.0).argmax(axis=1)
    rows = np.arange(len(points))
    neighbours = master.neighbours[number]
    before = (advance[rows, number] >= 0) | (neighbours[:, 0] >= 0)
    behind = (rest[rows, number] <= 0) | (neighbours[:, 1] >= 0)
    return number, before & behind
