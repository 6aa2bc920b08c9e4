"""Node-to-segment formulations of Zavarise & De Lorenzis, IJNME 79 (2009) 379–416, with exact tangents.

`point_contact` lists the methods that are points on slave segments (NTS, NTS-AR, VTS-G, VTS-ME); their forces are in
`eq6`. `patch_test_passing` has the presets of VTS-PPT; `walk` is the pairing of Boxes 1 and 2, and `box3` holds the
forces of Box 3. `eq6_tangent` and `box3_tangent` differentiate both, and `turned_force` holds what they share.
`nts_multipliers` puts Lagrange multipliers in the place of springs. `two_passes` wraps any one-pass formulation. All of
them are frictionless, stateless and two-dimensional.
"""

from contactverif_nts.nts_multipliers import nts_lm, vts_me_lm, vts_ppt_lm
from contactverif_nts.patch_test_passing import vts_ppt, vts_ppt_balanced, vts_ppt_basic
from contactverif_nts.point_contact import nts, nts_ar, vts_g, vts_me
from contactverif_nts.two_passes import two_pass

__all__ = [
    "nts",
    "nts_ar",
    "nts_lm",
    "two_pass",
    "vts_g",
    "vts_me",
    "vts_me_lm",
    "vts_ppt",
    "vts_ppt_balanced",
    "vts_ppt_basic",
    "vts_ppt_lm",
]
