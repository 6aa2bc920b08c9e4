"""Segment-to-segment and mortar contact on exactly cut cells, with exact tangents. Frictionless, two-dimensional.

`search` finds which pairs of segments make a cell, `geometry` has a point of a cell and its Δ, `cells` the points of
all of them, `transmission` turns pressures at points into forces. A method is a rule for the pressures: at the points
themselves (`segment_to_segment`), at slave nodes from node gaps (`chen_hisada`) or from weighted gaps (`mortar`, with
`shapes`).
"""

from contactverif_mortar.chen_hisada import chen_hisada
from contactverif_mortar.mortar import mortar, mortar_dual, mortar_dual_lm, mortar_lm
from contactverif_mortar.segment_to_segment import sts

__all__ = ["chen_hisada", "mortar", "mortar_dual", "mortar_dual_lm", "mortar_lm", "sts"]
