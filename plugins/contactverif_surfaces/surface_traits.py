"""The promises that the methods on cells have in common; each method says what it changes."""

from __future__ import annotations

from contactverif.contract.traits import Abilities, Evidence, PatchPromises, Promises, Rules, Traits

SURFACE_TRAITS = Traits(
    promises=Promises(
        patch=PatchPromises(flat=True),
        tangent="exact",
        symmetric=False,
        conserves_force=True,
        conserves_moment=True,
        unbiased=False,
        nodes_push=True,
        translation_stable=True,
    ),
    rules=Rules(gap="cells", force_along="slave normal", penalty="distributed", area="current"),
    abilities=Abilities(dimensions=(3,), faces=(3,), batched=True, takes_complex=True),
    evidence=Evidence(witnesses={"symmetric": "tilted-faces", "swap": "tilted-faces"}),
)
