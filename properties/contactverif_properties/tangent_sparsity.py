"""Ask whether each block of the tangent is right on its own, and whether its pattern lacks an entry.

**Question.** Every unknown moves by itself. Is the change of each nodal force the entry of the tangent, and has the
tangent an entry wherever a force changes?

**Why it matters.** In a random direction, and in a norm of the whole matrix, a large entry hides a small one. A code
that allots its matrix from the mesh alone loses what couples a slave node with the second neighbour of a master node.

**How it is judged.** A block is the rows of a node × the columns of a node; a multiplier counts as a node. Each block
counts over its own largest entry, so that the tolerance does not grow with the size of the problem:

- Against a complex step, where the plugin takes complex positions: 1e-11 + 1024 s uS/ℓ. Here s is the largest block in
  the row or the column over this one, since roundoff is in proportion to that.
- Otherwise against the best of three central differences: (30 + 32 s) (uS/ℓ)^(2/3) + 1024 s uS/ℓ. Where the plugin
  takes long doubles, u is that of long doubles in the first term.
- A derivative beyond that tolerance needs an entry in the matrix. In an array an entry that is exactly zero is none.

Where the residual of a failing block bends over a length λ < ℓ, the block is judged again with λ in place of ℓ. A
failure names row and column of the worst entry, its value and the derivative.

**Undecided.** Only where nothing else fails: a failing block whose one-sided differences disagree, unless the tangent
is the derivative to one side; and a failing block whose residual bends over less than ℓ/1024.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.strategies import smooth_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.block_verdict import measure_blocks
from contactverif_properties.shared.tangent_blocks import BLOCK, COMPLEX_BLOCK, LACKING

TANGENT_SPARSITY = Property(
    id="tangent.sparsity",
    family="tangent",
    summary="Each block of the tangent is the derivative of the residual, and the pattern lacks no entry.",
    quantities=(BLOCK, COMPLEX_BLOCK, LACKING),
    cases=smooth_cases,
    measure=measure_blocks,
    promise=lambda traits: None if traits.tangent is None else traits.tangent == "exact",
    needs=frozenset({"tangent"}),
    applicable=refuse_barrier,
)
