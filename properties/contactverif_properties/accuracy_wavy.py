"""Ask whether forces, pressures and displacements converge to an exact solution in which the pressure varies.

**Question.** Two wavy bodies are pressed together until they touch everywhere. On finer and finer meshes that do not
match, how fast do nodal forces, reported pressures and displacements come near to the exact ones?

**Why it matters.** The patch test asks about uniform pressures. A method that fails it need not be wrong by much, and
one that passes it may be poor where pressures vary, as they do in every real contact. What counts for an engineer is
that a finer mesh gives a better answer.

**How it is judged.** The exact field of wavy half-planes is elementary (`docs/concepts/accuracy.md`), and the profiles
are such that the interface is flat in the end. Meshes are 6r on 8r cells, r = 1, 2, 4 and 8, and the penalty grows as
E/h, so that its layer of springs, which the exact solution has too, vanishes with h. A case is one choice of the slave
and one penalty. The rates are the slopes of log error over log h:

- forces: E_F = sqrt(Σ|F_i − F_i^exact|²/m_i) over sqrt(Σ|F_i^exact|²/m_i) with m_i = ∫N_i ds, on slave and master;
  right ones measure 1.41 to 1.90 (two half passes, whose sides are not in balance, 1.22), and formulations that fail
  the patch test at most 0.42 on one of the sides at 10 E/h with the upper body as the slave;
- displacements of both surfaces in L2: right ones 1.89 to 2.08; the rate is 2 but for the coarsest mesh;
- reported pressures, if there are any, with the formulation's own weights: 1.08 to 2.20 against at most 0.87; pressures
  that are constant on each segment have the rate 1, but for the coarsest mesh.

On the finest mesh pressures are judged by the best pressure that is constant on each segment, which is off by kh/√24 of
the wave's amplitude. Roundoff is uXε̂/p = 5e-6, and no error comes near to it. Pressures that two passes share are not
judged.

In two more cases the slave is four times finer, or four times coarser, than the master: 4r on r cells, r = 6, 9, 13 and
18, at 10 E/h with the h of the coarser mesh. A pressure that jumps between coarse slave segments, as that of few points
or of dual shapes does, has the rate 1 on a finer master. Forces of right ones have at least 0.95 there, others at most
0.58. On the finer slave right ones have at least 1.62, and several wrong ones hide below the error of the coarse body.
Less is asked of displacements, since the coarse body has at most 18 cells and not 48: right ones have 1.84, half passes
1.72.

**Undecided.** Where Newton's method finds no solution on one of the meshes.

References: K. L. Johnson, Contact Mechanics (1985), Chapter 13.
"""

from __future__ import annotations

from functools import partial

from contactverif.contract.property import Property
from contactverif.problems.wavy import WAVY_STUDIES
from contactverif_properties.shared.applicability import refuse_dependent_multipliers
from contactverif_properties.shared.convergence import exact_forces, measure_convergence
from contactverif_properties.shared.finite_lists import unless_given

ACCURACY_WAVY = Property(
    id="accuracy.wavy",
    family="accuracy",
    summary="Forces, pressures and displacements of wavy bodies in full contact converge to the exact ones.",
    quantities=WAVY_STUDIES.quantities,
    cases=unless_given(WAVY_STUDIES.cases),
    measure=partial(measure_convergence, WAVY_STUDIES),
    promise=lambda traits: traits.converges,
    applicable=refuse_dependent_multipliers,
    series=dict.fromkeys(WAVY_STUDIES.series, "1"),
    bodies=True,
    exact=partial(exact_forces, WAVY_STUDIES),
)
