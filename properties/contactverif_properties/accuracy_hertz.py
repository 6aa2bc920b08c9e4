"""Ask whether a contact that has an edge converges to Hertz' solution as meshes are refined.

**Question.** A parabola is pressed on a flat. Do nodal forces on both sides, reported pressures, the peak and the
half-width converge to those of the exact solution as both meshes become finer?

**Why it matters.** This is what analysts use contact for: the stress in a contact whose size is not known beforehand.
A method that fails the patch test leaves forces that do not converge at all unless the penalty stays soft on fine
meshes.

**How it is judged.** Four meshes, with 16 to 33 segments of the parabola across the contact; the flat's segments are
shorter, and match nowhere. The sides of both bodies carry the exact stresses of half-planes. Each body is the slave
once. The penalty is E/a, the same on all meshes ("layer"), or 1 E/h ("soft") or 100 E/h ("stiff"), which grow on finer
meshes. The exact solution of each mesh is that of its own penalty: Hertz on a layer of springs, solved to 1e-10 of the
peak; for multipliers Hertz himself.

- E_F is sqrt(Σ|F − F_exact|²/m) over sqrt(Σ|F_exact|²/m), with m = ∫N ds. Its rate is fitted over the meshes. Hertz'
  pressure falls to 0 like a root of the distance from the edge, which allows the rate 1; on a layer that stays as it
  is, the pressure has a kink there, which allows 1.5. Measured on formulations that pass the patch test: 0.97 to 1.09
  (0.86 at 100 E/h, where facets are felt), and 1.28 to 1.49 on the layer. All others have less than 0.75 on one side
  at E/h, and less than 0.5 on the layer: the forces on their master do not converge there at all.
- Reported pressures have rates from 0.78 to 1.03, and from 1.14 to 1.64 on the layer. Their size at 100 E/h is that
  of the facets: segments of the parabola are straight, so the gap varies by h²/8R along each, and the penetration is
  smaller than that.
- Errors on the finest mesh are at most half of the tolerances for formulations that converge.

The trait `converges` is the promise. `docs/concepts/accuracy.md` has a picture.

**Undecided.** A case in which Newton's method ends out of balance on some mesh, by more than 1e-4 of the largest force.
It starts at the exact displacements, where nothing but the formulation's own kinks can keep it from ending.
"""

from __future__ import annotations

from functools import partial

from contactverif.contract.property import Property
from contactverif.contract.traits import Traits
from contactverif.problems.hertz_box import HERTZ_STUDIES
from contactverif_properties.shared.applicability import refuse_dependent_multipliers, refuse_unstated_penalty
from contactverif_properties.shared.convergence import exact_forces, measure_convergence
from contactverif_properties.shared.finite_lists import unless_given


def _refuse(traits: Traits) -> str:
    return refuse_dependent_multipliers(traits) or refuse_unstated_penalty(traits)


ACCURACY_HERTZ = Property(
    id="accuracy.hertz",
    family="accuracy",
    summary="Forces and pressures of a contact with an edge converge to those of Hertz as meshes are refined.",
    quantities=HERTZ_STUDIES.quantities,
    cases=unless_given(HERTZ_STUDIES.cases),
    measure=partial(measure_convergence, HERTZ_STUDIES),
    promise=lambda traits: traits.converges,
    applicable=_refuse,
    series=dict.fromkeys(HERTZ_STUDIES.series, "1"),
    bodies=True,
    exact=partial(exact_forces, HERTZ_STUDIES),
)
