"""Ask two elastic blocks for the exact stress, forces, gap and pressure with master nodes on nodes and midpoints.

**Question.** Two elastic blocks are pressed together. Each inner master node lies on a slave node or in the middle of a
slave segment. Are stress, forces on both sides, gap and reported pressure exact at a moderate and at a high penalty?

**Why it matters.** It is the patch test that VTS-ME was made for. It fails on other meshes, and only here a mistake of
its code can be told from what it cannot do.

**How it is judged.** Six scenes: the paper's B and Example 1 (a punch on a wider block), and four of ours, with moduli
that differ by 1/8 to 1000, inclined, and 1/500 as large. Errors and tolerances are those of `patch.flat.solve`. The
promise is that of `patch.flat.single`.

**Undecided.** Never, as in `patch.flat.solve`. No slave node faces a free end of the master but in upright scenes of
the paper, whose coordinates along the interface are exact.

**Source.** Zavarise & De Lorenzis (2009), Figs. 16 to 19 and 31, Sections 5.1.2 and 7.1.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.class_scenes import single_scenes
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.patch_class import list_or_scene, promise_single
from contactverif_properties.shared.solved_patch import forces_to_draw
from contactverif_properties.shared.two_penalties import TWO_PENALTIES, measure_two_penalties

FLAT_SINGLE_SOLVE = Property(
    id="patch.flat.single.solve",
    family="patch",
    summary="Two blocks find them too where inner master nodes lie in the middle of slave segments.",
    quantities=TWO_PENALTIES,
    cases=list_or_scene(single_scenes, midpoints=True),
    measure=measure_two_penalties,
    promise=promise_single,
    applicable=refuse_barrier,
    bodies=True,
    exact=forces_to_draw,
)
