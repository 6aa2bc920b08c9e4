"""Ask two elastic blocks for the exact stress, forces, gap and pressure where inner master nodes lie on slave nodes.

**Question.** Two elastic blocks, or a block and a rigid floor, are pressed together. Each inner master node lies on a
slave node. Are stress, forces on both sides, gap and reported pressure exact at a moderate and at a high penalty?

**Why it matters.** It is the patch test that the reference paper begins with. A formulation that fails the general one
must pass this one if its theory says so, and then its failure elsewhere is that of the theory.

**How it is judged.** Seven scenes: the paper's A1 and A2 (uniform and graded, on a rigid floor), and four of ours, with
moduli that differ by 1/8 to 1000, inclined, and 1/500 as large. Errors and tolerances are those of `patch.flat.solve`.
The promise is that of `patch.flat.normal`.

**Undecided.** Never, as in `patch.flat.solve`. No slave node faces a free end of the master but in upright scenes of
the paper, whose coordinates along the interface are exact.

**Source.** Zavarise & De Lorenzis (2009), Figs. 8 to 12, Section 4.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.class_scenes import normal_scenes
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.patch_class import list_or_scene, promise_normal
from contactverif_properties.shared.solved_patch import forces_to_draw
from contactverif_properties.shared.two_penalties import TWO_PENALTIES, measure_two_penalties

FLAT_NORMAL_SOLVE = Property(
    id="patch.flat.normal.solve",
    family="patch",
    summary="Two blocks find the exact stress, forces and gap where each inner master node lies on a slave node.",
    quantities=TWO_PENALTIES,
    cases=list_or_scene(normal_scenes, midpoints=False),
    measure=measure_two_penalties,
    promise=promise_normal,
    applicable=refuse_barrier,
    bodies=True,
    exact=forces_to_draw,
)
