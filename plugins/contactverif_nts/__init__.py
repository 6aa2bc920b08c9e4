"""Node-to-segment formulations of Zavarise & De Lorenzis, IJNME 79 (2009) 379–416, with exact tangents.

`eq6` holds one virtual slave node against one master segment; `points` lists the methods that are nothing but such
points (NTS, NTS-AR, VTS-G, VTS-ME). `walk` is Boxes 1–2, `box3` the transmission over several master segments, and
`ppt` its three presets. Frictionless, stateless, two-dimensional.
"""

from contactverif_nts.points import nts, nts_ar, vts_g, vts_me
from contactverif_nts.ppt import vts_ppt, vts_ppt_balanced, vts_ppt_basic

__all__ = ["nts", "nts_ar", "vts_g", "vts_me", "vts_ppt", "vts_ppt_balanced", "vts_ppt_basic"]
