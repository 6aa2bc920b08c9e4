"""Case test A2: an elastic block on a rigid foundation, with a uniform and a graded mesh. NTS fails, NTS-AR passes.

The paper prints no lengths. Its axis runs from −5 to 5, so the block is 10 wide.

Source: Zavarise & De Lorenzis (2009), Section 4.4, Figs. 11 and 12.
"""

from __future__ import annotations

from contactverif_paper.patch_item import patch_item
from contactverif_paper.patch_solutions import TWO, PatchSetup

_X_AXIS, _AXIS = (-5.0, 5.0), (0.8, 1.8)

ITEM = patch_item(
    "case_a2",
    "Case A2: a block on a rigid foundation",
    PatchSetup("a2-uniform", "Case A2, uniform mesh", "12(a)", "11(a, b)", _X_AXIS, _AXIS, 0.06, TWO),
    PatchSetup("a2-graded", "Case A2, graded mesh", "12(b)", "11(c, d)", _X_AXIS, _AXIS, 0.3, TWO),
    captions={
        11: "Case A2: magnified penetrations; (a, b) uniform mesh, (c, d) graded mesh.",
        12: "Case A2: contact pressure over the exact one; (a) uniform mesh, (b) graded mesh.",
    },
    choices={"Case A2": "the lengths of the segments: 2 2 2 2 2 in the uniform mesh, 1 2 3 4 in the graded one"},
)
