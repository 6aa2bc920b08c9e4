"""Node-to-segment formulations of Zavarise & De Lorenzis, IJNME 79 (2009) 379–416, with exact tangents.

`eq6` holds one virtual slave node against one master segment; `points` lists the methods that are nothing but such
points (NTS, NTS-AR, VTS-G, VTS-ME). `walk` is Boxes 1–2, `box3` the transmission over several master segments, and
`ppt` its three presets; `multipliers` lists those that hold their points by Lagrange multipliers. `two_pass` wraps any
one-pass formulation. Frictionless, stateless, two-dimensional.
"""

from contactverif_nts.multipliers import nts_lm, vts_me_lm, vts_ppt_lm
from contactverif_nts.points import nts, nts_ar, vts_g, vts_me
from contactverif_nts.ppt import vts_ppt, vts_ppt_balanced, vts_ppt_basic
from contactverif_nts.two_pass import two_pass

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
