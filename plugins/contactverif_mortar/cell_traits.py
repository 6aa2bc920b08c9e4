"""The promises that the methods on cells have in common; each method says what it changes."""

from __future__ import annotations

from contactverif.compiler import TAKES_LONGDOUBLE
from contactverif.contract.traits import Abilities, Evidence, PatchPromises, Promises, Rules, Traits

# The cases that show locking, for methods that lock.
LOCKING_WITNESSES = {"stability.locking": "12 on 8, ε̂ = 1e8 E/h", "accuracy.wavy-curved": "upper slave, 100 E/h"}
CELL_TRAITS = Traits(
    promises=Promises(
        patch=PatchPromises(flat=True, normal=True, single=True, kinked=True, overhang=True),
        converges=True,
        locks=False,
        tangent="exact",
        symmetric=False,
        conserves_force=True,
        conserves_moment=True,
        continuity="C0",
        integrates_linear_gap=True,
        local=True,
        nodes_push=True,
        unbiased=False,
        translation_stable=True,
    ),
    rules=Rules(gap="cells", force_along="slave normal", penalty="distributed"),
    abilities=Abilities(batched=True, takes_complex=True, takes_longdouble=TAKES_LONGDOUBLE),
    evidence=Evidence(witnesses={"symmetric": "offset-c", "swap": "tilted"}),
)
