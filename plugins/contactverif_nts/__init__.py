"""Node-to-segment formulations of Zavarise & De Lorenzis, IJNME 79 (2009) 379–416, with exact tangents.

`point_contact` has the methods that are points on slave segments (NTS, NTS-AR, VTS-G, VTS-ME); `nts_force` has their
forces, Eq. 6. `patch_test_passing` has the presets of VTS-PPT; `vts_ppt_force` has the pairing of Boxes 1 and 2 and
the forces of Box 3, `vts_ppt_tangent` their derivative. `two_passes` wraps any one-pass formulation. All of them
are frictionless, stateless and two-dimensional.

| argument of a factory | meaning |
|---|---|
| `penalty` | stiffness ε̂ > 0, force per length per length of penetration; of `nts` it is ε > 0, force per length |
| `penalty` of `…_lm` | the scale c > 0 of the decision λ − c g ≥ 0, in the same units; no solution depends on it |
| `n` | number of points on a slave segment, ≥ 1 |
| `area` | configuration in which lengths of areas of competence are measured: "current" or "reference" |
| `tau` | part of a master segment by which a foot may lie past its free end and still count |
| `free_end` | what happens to an area of competence that overhangs a free end of the master; `vts_ppt_force` says it |
| `threads` | how many threads share the work on a large interface, ≥ 1; the answers have the same bits |
"""

from contactverif_nts.patch_test_passing import vts_ppt, vts_ppt_balanced, vts_ppt_basic, vts_ppt_lm
from contactverif_nts.point_contact import nts, nts_ar, nts_lm, vts_g, vts_me, vts_me_lm
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
