"""Case test B: each area of competence lies over one master segment. NTS-AR fails, VTS-ME passes.

Source: Zavarise & De Lorenzis (2009), Section 5.1.3, Figs. 16–18.
"""

from __future__ import annotations

from contactverif_paper.paper_formulations import NTS_AR, VTS_ME
from contactverif_paper.patch_item import PrintedForces, patch_item
from contactverif_paper.patch_solutions import FOUR, PatchSetup

PATCH = PatchSetup("b", "Case B", "18", "17", (0.0, 12.0), (0.8, 1.6), 0.06, FOUR)
_EXACT = "3/2 3 7/2 3 1"

ITEM = patch_item(
    "case_b",
    "Case B: non-matching meshes that VTS-ME can handle",
    PATCH,
    captions={17: "Case B: magnified penetrations.", 18: "Case B: contact pressure over the exact one."},
    printed=PrintedForces(
        "Fig. 16",
        "NTS hands wrong forces to the master although those on the slave are right; VTS-ME hands over the right ones",
        _EXACT,
        {NTS_AR: "5/3 10/3 3 2 2", VTS_ME: _EXACT},
    ),
    text="In Fig. 16 the paper’s “NTS” starts from the right slave forces: that is NTS-AR.",
)
