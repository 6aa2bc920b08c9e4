"""One virtual slave node a cell, written to be read: the reference of the compiled `vts-cell-3d`.

Its tangent is a complex step through these lines (`local_derivatives`), so it shares no formula with the kernel.
"""

from typing import Any

from contactverif_surfaces.cell_points import SURFACE_TRAITS, CellPoints, SlaveView, cross_plane
from contactverif_surfaces.face_methods import CellSprings


def centre_points(view: SlaveView, codes: Any) -> CellPoints:
    """Return one point for each cell: its centroid, with the area of the cell."""
    corners = view.cell_corners(codes)
    start = corners[..., :1, :]
    arms = corners[..., 1:, :] - start
    areas = cross_plane(arms[..., :-1, :], arms[..., 1:, :]) / 2
    moments = (areas[..., None] * (arms[..., :-1, :] + arms[..., 1:, :]) / 3).sum(axis=-2, keepdims=True)
    area = areas.sum(axis=-1)
    return view.points_at(start + moments / area[..., None, None], area[..., None])


def readable_vts_cell(*, penalty: float) -> CellSprings:
    """Return the readable formulation; its pairing has `active` (n_cells, 1)."""
    return CellSprings(SURFACE_TRAITS, penalty, centre_points)
