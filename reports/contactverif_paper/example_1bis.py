"""Example 1bis: the punch of Example 1 on a mesh where areas of competence cross master nodes.

Source: Zavarise & De Lorenzis (2009), Section 7.1, Figs. 34–36.
"""

from __future__ import annotations

from contactverif_paper.patch_item import patch_item
from contactverif_paper.patch_solutions import FIVE, PatchSetup

PATCH = PatchSetup("example-1bis", "Example 1bis", "36", "35", (-3.0, 3.0), (0.6, 1.4), 0.06, FIVE, close_up=(0.8, 1.2))

ITEM = patch_item(
    "example_1bis",
    "Example 1bis: the same punch on another mesh",
    PATCH,
    captions={
        34: "Example 1bis: the meshes. Slave lengths 2 2 2 over master lengths 1.625, five of 1.75, 1.625; the paper "
        "draws them and prints no lengths.",
        35: "Example 1bis: magnified penetrations.",
        36: "Example 1bis: contact pressure over the exact one; (b) is a close-up.",
    },
    choices={"Example 1bis": "the lengths of the segments: 1.625 1.75 1.75 1.75 1.75 1.75 1.625 in the master"},
)
