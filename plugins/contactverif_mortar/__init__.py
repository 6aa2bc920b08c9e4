"""Segment-to-segment and mortar contact on exactly cut cells, with exact tangents. Frictionless, two-dimensional.

`cell_search` finds which pairs of segments make a cell. `cell_geometry` computes a point of a cell and its Δ,
`integration_cells` the points of all cells. `cell_forces` turns pressures at points into forces. A method is a rule for
the pressures: at the points themselves (`segment_to_segment`), at slave nodes from node gaps (`chen_hisada_method`), or
at slave nodes from weighted gaps (`mortar_methods`, with `weighted_gaps` and `pressure_shapes`). `two_half_passes`
weighs gaps on both surfaces, at points of `covered_ranges`, and hands no force from one body to the other.

Tangents are written straight into compressed rows. `cell_frame` has the Δ of points of slaves that look along their own
normal: `cell_tangent` makes the tangent of springs at points of it, and `node_rows` that of all mortar methods. For
averaged normals and half passes `shape_rows` does so with the Δ of `cell_geometry`. Tests hold all of them against
triplets and sparse products (`tests/plugins/readable_mortar.py`).
"""

from contactverif_mortar.chen_hisada_method import chen_hisada
from contactverif_mortar.mortar_methods import mortar, mortar_dual, mortar_dual_lm, mortar_lm
from contactverif_mortar.segment_to_segment import sts
from contactverif_mortar.two_half_passes import mortar_two_half_pass

__all__ = ["chen_hisada", "mortar", "mortar_dual", "mortar_dual_lm", "mortar_lm", "mortar_two_half_pass", "sts"]
