"""Case test A1: two slave segments over one master segment. NTS fails, NTS-AR passes.

Source: Zavarise & De Lorenzis (2009), Section 4.3, Figs. 8–10.
"""

from __future__ import annotations

from contactverif_paper.patch_item import PrintedForces, patch_item
from contactverif_paper.patch_solutions import TWO, PatchSetup

PATCH = PatchSetup("a1", "Case A1", "10", "9", (-2.0, 2.0), (0.9, 1.1), 1.0, TWO, origin=2.0)

ITEM = patch_item(
    "case_a1",
    "Case A1: two slave segments over one master segment",
    PATCH,
    captions={
        9: "Case A1: magnified penetrations. Hatched is what penetrates. Solid and filled: slave; dashed and open: "
        "master.",
        10: "Case A1: contact pressure over the exact one.",
    },
    printed=PrintedForces("Fig. 8", "the right forces on the master are 2p, 2p", "2 2", {}),
    choices={
        "Patch tests": "E = 10⁴ and ν = 0.3 in both bodies, heights 4, two layers of cells, rollers at all sides",
        "Penalty of the figures": "one for each panel, so that its curves use the pressure axis that the paper prints",
        "Pressure of NTS and of two passes": "the nodal force over the node's share of the interface, Eq. 3",
    },
)
