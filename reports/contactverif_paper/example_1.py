"""Example 1: Taylor and Papadopoulos' punch, whose areas of competence each lie over one master segment.

Source: Zavarise & De Lorenzis (2009), Section 7.1, Figs. 31–33.
"""

from __future__ import annotations

from contactverif_paper.patch_item import patch_item
from contactverif_paper.patch_solutions import FOUR, PatchSetup

PATCH = PatchSetup("example-1", "Example 1", "33", "32", (-3.0, 3.0), (0.6, 2.2), 0.06, FOUR, close_up=(0.8, 1.2))

ITEM = patch_item(
    "example_1",
    "Example 1: the punch of Taylor and Papadopoulos",
    PATCH,
    captions={
        31: "Example 1: the meshes. Slave lengths 2 2 2 over master lengths 3 1 4 1 3; the paper draws them and prints "
        "no lengths.",
        32: "Example 1: magnified penetrations.",
        33: "Example 1: contact pressure over the exact one; (b) is a close-up.",
    },
    choices={
        "Example 1": "master lengths 3 1 4 1 3. With six equal ones each slave node faces the middle of one, and "
        "two-pass NTS-AR passes by symmetry"
    },
)
