"""Ask whether the tangent of a long interface is right in each of its blocks.

**Question.** Six interfaces have 104 to 200 segments on one side: wavy, graded, a ring, three chains, many segments on
few, and few on many. Is each block of the tangent the derivative of the residual?

**Why it matters.** Some errors need size: a table that is too short, a block of rows that is forgotten behind the
hundredth segment, a wrong entry among a hundred thousand. A norm of the whole matrix loses that entry, and the more so
the longer the interface.

**How it is judged.** As in `tangent.sparsity`, with the same tolerances: each block counts over its own largest entry.
One entry that is wrong by 1e-6 of its block is found. Unknowns that no row feels together move at the same time, so
that some 30 moves are enough. What looks wrong is measured again, one unknown at a time.

**Undecided.** As in `tangent.sparsity`.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.long_states import long_states
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.block_verdict import measure_blocks
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.tangent_blocks import BLOCK, COMPLEX_BLOCK, LACKING

TANGENT_LONG = Property(
    id="tangent.long",
    family="tangent",
    summary="Each block of the tangent of a long interface is the derivative of the residual.",
    quantities=(BLOCK, COMPLEX_BLOCK, LACKING),
    cases=unless_given(long_states),
    measure=measure_blocks,
    promise=lambda traits: None if traits.tangent is None else traits.tangent == "exact",
    needs=frozenset({"tangent"}),
    applicable=refuse_barrier,
)
