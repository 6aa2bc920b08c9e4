"""The patch test solved: two elastic bodies under a uniform pressure find the exact stress, forces and gap."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.measurement import Measurement, Quantity
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.oracle import is_of_class
from contactverif.problems.block_scenes import normal_scenes, single_scenes
from contactverif.strategies.solids import UNIFORM, block_cases, dead_zone_cases, variant_cases
from contactverif_properties.patch_flat import promise_normal, promise_single
from contactverif_properties.shared import solved_patch

HIGH = 1e3  # The high penalty over the moderate penalty of a case.
SLOPE = "slope over penalties (−1 if it locks)"


def measure_two_penalties(case: Case, subject: Subject) -> Measurement:
    """Solve two blocks at the penalty of the case and at a HIGH one; one with multipliers has none, and is solved once.

    The details are how each solution ended, and the slope of the logarithm of the stress error over that of the
    penalty.
    """
    if subject.traits.rules.enforcement == "multiplier":
        return solved_patch.measure_once(case, subject)
    moderate = solved_patch.measure_at_penalty(case, subject, case.penalty)
    high = solved_patch.measure_at_penalty(case, subject, HIGH * case.penalty)
    if not (moderate.numbers and high.numbers):  # A whole code may find no solution.
        return moderate if moderate.undecided else high
    errors = moderate.values[solved_patch.STRESS.name], high.values[solved_patch.STRESS.name]
    slope = float(np.log(errors[1] / errors[0]) / np.log(HIGH)) if min(errors) > 0 else 0.0
    return Measurement(
        [*moderate.numbers, *(replace(number, quantity=_at_high(number.quantity)) for number in high.numbers)],
        undecided=moderate.undecided or high.undecided,
        details={**moderate.details, **{high_name(name): value for name, value in high.details.items()}, SLOPE: slope},
    )


def high_name(name: str) -> str:
    """Return the name of a quantity at the high penalty."""
    return f"{name}, high penalty"


def _at_high(quantity: Quantity) -> Quantity:
    return replace(quantity, name=high_name(quantity.name))


def _scenes_of_class(make: Callable[[], tuple[Case, ...]], *, midpoints: bool) -> Cases:
    """Return a list of scenes; in its place random states of a scene that is given, if it is of the class."""

    def on_scene(scene: Case) -> Any:
        states = block_cases(scene)
        fits = states is not None and is_of_class(scene.interface, scene.parameters["along"], midpoints=midpoints)
        return states if fits else None

    return Cases.from_list(make, on_place=on_scene, needs=UNIFORM)


_define = partial(Property.define, family="patch", bodies=True, engines=True, exact=solved_patch.forces_to_draw)
_define_at_two_penalties = partial(
    _define, quantities=(*solved_patch.QUANTITIES, *map(_at_high, solved_patch.QUANTITIES), solved_patch.MULTIPLIERS)
)


@_define_at_two_penalties(
    id="patch.flat.solve", rank=660, cases=Cases.random(block_cases), promise=lambda traits: traits.promises.patch.flat
)
def patch_flat_solve(case: Case, subject: Subject) -> Measurement:
    """Two elastic blocks under a uniform pressure find the exact stress, forces and gap at two penalties.

    **Question.** Two random elastic blocks on rollers are pressed together. Are the stress, the forces on both sides,
    the gap and the reported pressure the exact ones?

    **Why it matters.** This is the patch test as an engineer runs it. The two penalties say different things. At a
    moderate penalty a wrong distribution of forces bends the bodies. As the penalty grows, a method that only
    interpolates the gap well locks into the right pressure and seems to pass. The slope of the stress error over the
    penalty, a detail of every measurement, tells them apart: near 0 the method fails at any penalty, near −1 it passes
    because it locks.

    **How it is judged.** The blocks cannot strain sideways, so the exact pressure is p = Δ / (H1/M1 + H2/M2 + 1/ε̂).
    Stress is compared at the Gauss points over p, nodal forces over p L, heights and reported gaps over p/ε̂, and
    reported pressures over p. The tolerance of a stress is 1e-11 + 1e-13 κ + 5e-15/r + 64 u (X ε̂ + M U/ℓ)/p: the
    condition of the matrix, the ratio of segments, and the rounding of positions and displacements. The other
    tolerances follow from it (`docs/concepts/tolerances.md`). Newton's method differentiates the residual by itself
    here, so a wrong tangent does no harm. A formulation with multipliers has no penalty and is asked once; its
    multipliers are compared with p.

    **Undecided.** Never: Newton's method starts at the exact solution, where a formulation that passes is in balance.
    """
    return measure_two_penalties(case, subject)


@_define_at_two_penalties(
    id="patch.flat.normal.solve",
    rank=590,
    cases=_scenes_of_class(normal_scenes, midpoints=False),
    promise=promise_normal,
)
def patch_flat_normal_solve(case: Case, subject: Subject) -> Measurement:
    """Two blocks find the exact stress, forces and gap where each inner master node lies on a slave node.

    **Question.** Two elastic blocks, or a block and a rigid floor, are pressed together. Each inner master node lies on
    a slave node. Are stress, forces on both sides, gap and reported pressure exact at a moderate and at a high penalty?

    **Why it matters.** It is the patch test that the reference paper begins with. A formulation that fails the general
    one must pass this one if its theory says so, and then its failure elsewhere is that of the theory.

    **How it is judged.** Seven scenes: the paper's A1 and A2 (uniform and graded, on a rigid floor), and four of ours,
    with moduli that differ by 1/8 to 1000, inclined, and 1/500 as large. Errors and tolerances are those of
    `patch.flat.solve`. The promise is that of `patch.flat.normal`.

    **Undecided.** Never, as in `patch.flat.solve`. No slave node faces a free end of the master but in upright scenes
    of the paper, whose coordinates along the interface are exact.

    **Source.** Zavarise & De Lorenzis (2009), Figs. 8 to 12, Section 4.
    """
    return measure_two_penalties(case, subject)


@_define_at_two_penalties(
    id="patch.flat.single.solve",
    rank=610,
    cases=_scenes_of_class(single_scenes, midpoints=True),
    promise=promise_single,
)
def patch_flat_single_solve(case: Case, subject: Subject) -> Measurement:
    """Two blocks find them too where inner master nodes lie in the middle of slave segments.

    **Question.** Two elastic blocks are pressed together. Each inner master node lies on a slave node or in the middle
    of a slave segment. Are stress, forces on both sides, gap and reported pressure exact at a moderate and at a high
    penalty?

    **Why it matters.** It is the patch test that VTS-ME was made for. It fails on other meshes, and only here a mistake
    of its code can be told from what it cannot do.

    **How it is judged.** Six scenes: the paper's B and Example 1 (a punch on a wider block), and four of ours, with
    moduli that differ by 1/8 to 1000, inclined, and 1/500 as large. Errors and tolerances are those of
    `patch.flat.solve`. The promise is that of `patch.flat.single`.

    **Undecided.** Never, as in `patch.flat.solve`. No slave node faces a free end of the master but in upright scenes
    of the paper, whose coordinates along the interface are exact.

    **Source.** Zavarise & De Lorenzis (2009), Figs. 16 to 19 and 31, Sections 5.1.2 and 7.1.
    """
    return measure_two_penalties(case, subject)


@_define(
    id="patch.variants",
    rank=680,
    quantities=(*solved_patch.QUANTITIES, solved_patch.MULTIPLIERS),
    cases=Cases.random(variant_cases),
    promise=lambda traits: traits.promises.patch.flat,
)
def patch_variants(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact with a rigid master, unequal materials, an inclined interface or a punch.

    **Question.** Does a uniform pressure stay exact on a rigid master, with materials whose stiffness differs by 1e-6
    to 1e6, inclined by 1° to 179°, slid to 200 positions, and under a punch that is narrower than its base?

    **Why it matters.** Codes that pass the textbook patch test often fail when the interface is inclined, when one body
    is rigid, or when nodes nearly coincide. These are the everyday cases of an engineer.

    **How it is judged.** As in `patch.flat.solve`, at ε̂ = 10 E/h alone, with the same tolerances.

    **Undecided.** Never, as in `patch.flat.solve`.
    """
    return solved_patch.measure_once(case, subject)


def _widen_tolerance(quantity: Quantity) -> Quantity:
    """Return the quantity with L/A times its tolerance."""
    reason = "Loads on the whole slave, of length L, are rounded, and the part A that faces the master bears that."
    return replace(quantity, tolerance=f"({quantity.tolerance}) L/A", reason=f"{quantity.reason} {reason}")


@_define(
    id="patch.dead-zone",
    rank=620,
    quantities=tuple(map(_widen_tolerance, (*solved_patch.QUANTITIES, solved_patch.MULTIPLIERS))),
    cases=Cases.random(dead_zone_cases),
    promise=lambda traits: traits.promises.patch.overhang,
)
def patch_dead_zone(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact where the slave overhangs the master inside a slave segment.

    **Question.** The master ends inside a slave segment. Do the contact forces end where the master ends?

    **Why it matters.** Every punch, gasket and lap joint has such an end. A method that decides about whole slave nodes
    or whole areas of competence has too much slave in contact there, or too little.

    **How it is judged.** The pressure acts on what the master does not cover too, so that the exact stress is as
    uniform as without an overhang. The errors are those of `patch.flat.solve` at ε̂ = 1, 10 or 100 E/h, and gaps count
    where there is a master opposite. The tolerances are those of `patch.flat.solve` times L/A: loads on the whole
    slave, of length L, are rounded, and the part A that has the master opposite bears that.

    **Undecided.** Never, as in `patch.flat.solve`.
    """
    measurement = solved_patch.measure_once(case, subject)
    slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    covered = min(slave.max(), master.max()) - max(slave.min(), master.min())
    ratio = float(np.ptp(slave) / covered)
    numbers = [replace(number, tolerance=ratio * number.tolerance) for number in measurement.numbers]
    return replace(measurement, numbers=numbers)
