"""Segment-to-segment and mortar contact on exactly cut cells, with exact tangents. Frictionless, two-dimensional.

`cell_search` finds which pairs of segments make a cell, `integration_cells` has their points. A method is a rule for
the pressures: at the points themselves (`segment_to_segment`), at slave nodes from node gaps (`chen_hisada_method`), or
at slave nodes from weighted gaps (`mortar_methods`); `two_half_passes` weighs gaps on both surfaces and hands no force
from one body to the other.

There are two writers of tangents. `cell_frame` adds up twelve numbers a row in the frame of a slave that looks
along its own normal. `shape_rows` takes any directions and half passes, in the global frame, at 0.64 of that
speed. Tests hold both against a complex step (`tests/plugins/test_every_formulation.py`).

Of all factories `penalty` is the stiffness ε̂ > 0, force per length per length of penetration; with multipliers it is
the scale c > 0 of the decision λ_j − c G_j ≥ 0, on which no solution depends. `area` is the configuration in which
lengths are measured, "current" or "reference".
"""

from contactverif_mortar.chen_hisada_method import chen_hisada
from contactverif_mortar.mortar_methods import mortar, mortar_dual, mortar_dual_lm, mortar_lm
from contactverif_mortar.segment_to_segment import sts
from contactverif_mortar.two_half_passes import mortar_two_half_pass

__all__ = ["chen_hisada", "mortar", "mortar_dual", "mortar_dual_lm", "mortar_lm", "mortar_two_half_pass", "sts"]
