"""Ask whether forces, pressures and displacements come near to the exact ones where pressures vary or surfaces bend.

The problems state their bounds, beside what right and wrong formulations measure. They stand nowhere else.
"""

from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, Cases
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import PLANE, TRIANGLE
from contactverif.contract.property import Measure, Measurement, Property, Quantity, check_all
from contactverif.contract.subject import EngineSubject, Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import fit_rate, force_error, shape_integrals, solve_for_accuracy, traction_forces
from contactverif.problems.arcs import Arcs
from contactverif.problems.hertz_boxes import HERTZ_STUDIES
from contactverif.problems.problem import FORCES, ITERATIONS, Bound, Errors, ProblemInstance, Studies
from contactverif.problems.space_problems import (
    FINER,
    HERTZ_CELLS,
    HERTZ_POINT,
    EggBox,
    egg_box_cases,
    hertz_point_cases,
)
from contactverif.problems.wavy import CURVED_STUDIES, WAVY_STUDIES
from contactverif_properties import applicability
from contactverif_properties.exact_forces import pushing_forces, uniform_state
from contactverif_properties.states import nearest_sum


def _measure_convergence(studies: Studies, case: Case, subject: Subject) -> Measurement:
    """Return the sizes of errors on the finest mesh, and the rates that are asked, for which others are solved."""
    study = studies.read(case)
    group, instance = study.group(subject.traits), study.pose(study.meshes[-1], subject.traits)
    last, failure = _solve(studies, instance, subject)
    bounds = [bound for bound in studies.bounds if last.keys() >= set(bound.kinds)]
    sizes = [
        bound.quantity.check(bound.size(last), bound.tolerance(group, instance.best))
        for bound in bounds
        if not bound.rate
    ]
    fails = any(not number.value <= number.tolerance for number in sizes)

    def counts(bound: Bound) -> bool:
        """Return whether a rate is asked: some only of large errors, where no size fails."""
        if group not in bound.only_above:
            return True
        return not fails and bound.size(last) > bound.only_above[group] * bound.size(instance.best)

    rates = [bound for bound in bounds if bound.rate and counts(bound)]
    coarser = study.meshes[:-1] if rates else ()
    solved = [_solve(studies, study.pose(mesh, subject.traits), subject) for mesh in coarser] + [(last, failure)]
    meshes = study.meshes[-len(solved) :]
    solver = "the code" if isinstance(subject, EngineSubject) else "Newton's method"
    undecided = _name_failures({mesh: end for mesh, (_, end) in zip(meshes, solved, strict=True)}, solver)
    details = {} if ITERATIONS in studies.series.values() else {ITERATIONS: last[ITERATIONS]}
    kinds = [kind for kind in solved[0][0] if all(kind in row for row, _ in solved)]
    errors = {kind: [row[kind] for row, _ in solved] for kind in kinds}
    lengths = [study.size(mesh) for mesh in meshes]
    series = {name: np.array(errors[kind]) for name, kind in studies.series.items() if kind in errors}
    numbers = [
        bound.quantity.check(min(fit_rate(lengths, errors[kind]) for kind in bound.kinds), bound.limit(group))
        for bound in rates
        if errors.keys() >= set(bound.kinds)
    ]
    action = f"solved on meshes {' · '.join(map(str, meshes))}, drawn on mesh {study.meshes[0]}"
    return Measurement([*numbers, *sizes], undecided, details=details, series=series).after(action)


def _name_failures(ends: dict[int, str], solver: str) -> str:
    """Return on which meshes the solver ended without a solution, and how; empty if on none."""
    groups: dict[str, list[str]] = {}
    for mesh, end in ends.items():
        if end:
            groups.setdefault(end, []).append(str(mesh))
    words = ", ".join(f"mesh{'es' * (len(meshes) > 1)} {' · '.join(meshes)}: {end}" for end, meshes in groups.items())
    return f"{solver} finds no solution on {words}" if words else ""


def _solve(studies: Studies, instance: ProblemInstance, subject: Subject) -> tuple[Errors, str]:
    """Return the errors on one mesh, and how Newton's method ended if that is no solution."""
    solution = solve_for_accuracy(instance.scene, subject, instance.start, instance.step)
    largest = float(np.abs(instance.exact_forces(solution.state)).max())
    end = "" if solution.is_balanced_to(studies.nearly * largest) else solution.end
    return instance.errors(solution) | {ITERATIONS: float(solution.n_iterations)}, end


def _exact_forces(studies: Studies, case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, dim) that push the nodes of the coarsest mesh, for pictures."""
    if case.interface.dim != PLANE:
        problem = HERTZ_POINT.pose(HERTZ_CELLS, Traits())
        if studies is WAVY_STUDIES:
            problem = EggBox.from_case(case).pose(1, Traits())
        return problem.exact_forces(case)
    study = studies.read(case)
    return study.pose(study.meshes[0], Traits()).exact_forces(case)


def _define(studies: Studies) -> Callable[..., Callable[[Measure], Property]]:
    return partial(
        Property.define,
        quantities=studies.quantities,
        cases=Cases.from_list(studies.cases),
        linear=applicability.LINEAR_FORCES,
        applicable=applicability.refuse_dependent_multipliers,
        series=dict.fromkeys(studies.series, "1"),
        bodies=True,
        engines=True,
        exact=partial(_exact_forces, studies),
    )


EGG_BOX = Quantity(
    "extrapolated amplitude of the pressure",
    "0.02, on tetrahedra 0.04, with multipliers 0.1",
    "Errors of second order are taken away by two meshes, (4 e₂ − e₁)/3. Right ones reach 0.01 on hexahedra, 0.022 on "
    "tetrahedra, and 0.055 there under springs that hardly give way, which hide no error of the bodies.",
)
EGG_BOX_RATE = Quantity(
    "rate of the amplitude",
    "1.6, on tetrahedra 1.3, with multipliers 1.2",
    "It is 2. Where the finer mesh errs by more than 0.01, right ones have 1.8 and more on hexahedra, 1.43 on "
    "tetrahedra, and 1.27 there under springs that hardly give way.",
    sense="at least",
)
EGG_BOX_NODES = Quantity("error of nodal forces, r = 2", "0.05", "Right ones have 0.03.")
UNIFORM = Quantity(
    "error of nodal forces under a uniform pressure",
    "0.01, where one mesh is 3 times finer 0.1",
    "Right ones have 1e-4 with cells, and 0.005 and 0.055 with Gauss points on whole faces. Areas or shape functions "
    "of parallelograms have 0.03 and more, a search that stops at eight faces 0.3.",
)
_SMALL_AMPLITUDE = 0.01  # An error of the finer mesh up to this has no rate that says anything.


def _measure_egg_box(case: Case, subject: Subject) -> Measurement:
    box, errors, ends = EggBox.from_case(case), [], {}
    if box.mesh.skew:
        return _measure_uniform(box, subject)
    for refine in (1, 2):
        instance = box.pose(refine, subject.traits)
        solution = solve_for_accuracy(instance.scene, subject, instance.start, instance.step)
        exact, n_slave = instance.exact_forces(solution.state), solution.interface.n_slave_nodes
        wave = box.cosines(solution.interface.nodes[:n_slave])
        ends[refine] = "" if solution.balanced else solution.end
        amplitudes = (float(forces[:n_slave, 2] @ wave) for forces in (solution.forces, exact))
        errors.append(next(amplitudes) / next(amplitudes) - 1)
    solver = "the code" if isinstance(subject, EngineSubject) else "Newton's method"
    coarse, fine = errors
    most, least = (0.02, 1.6) if box.corners != TRIANGLE else (0.04, 1.3)
    if subject.traits.rules.enforcement == "multiplier" and box.corners == TRIANGLE:
        most, least = 0.1, 1.2
    nodes = max(instance.errors(solution)[kind] for kind in FORCES)
    numbers = [EGG_BOX.check(abs(4 * fine - coarse) / 3, most), EGG_BOX_NODES.check(nodes, 0.05)]
    if abs(fine) > _SMALL_AMPLITUDE:
        numbers.append(EGG_BOX_RATE.check(float(np.log2(abs(coarse / fine))), least))
    details = {"error at r = 1": coarse, "error at r = 2": fine}
    measurement = Measurement(numbers, _name_failures(ends, solver), details=details)
    return measurement.after("solved on this mesh and on one that is twice as fine")


def _measure_uniform(box: EggBox, subject: Subject) -> Measurement:
    """Solve blocks without waves; a method that cycles nearer to balance than the bound is judged."""
    refine, most = (1, 0.1) if box.mesh is FINER else (2, 0.01)
    instance = box.pose(refine, subject.traits)
    solution = solve_for_accuracy(instance.scene, subject, instance.start, instance.step)
    largest = float(np.abs(instance.exact_forces(solution.state)).max())
    undecided = "" if solution.is_balanced_to(most * largest) else f"no solution: {solution.end}"
    error = max(instance.errors(solution)[kind] for kind in FORCES)
    return Measurement([UNIFORM.check(error, most)], undecided).after(f"solved without waves, r = {refine}")


@partial(_define(WAVY_STUDIES), quantities=(*WAVY_STUDIES.quantities, EGG_BOX, EGG_BOX_RATE, EGG_BOX_NODES, UNIFORM))(
    id="accuracy.wavy",
    rank=540,
    cases_in_space=Cases.from_list(egg_box_cases),
    promise=lambda traits: traits.promises.converges,
)
def accuracy_wavy(case: Case, subject: Subject) -> Measurement:
    """Forces, pressures and displacements of wavy bodies in full contact converge to the exact ones.

    **Question.** Two wavy bodies are pressed together until they touch everywhere. On finer and finer meshes that do
    not match, how fast do nodal forces, reported pressures and displacements come near to the exact ones?

    **Why it matters.** The patch test asks about uniform pressures. A method that fails it need not be wrong by much,
    and one that passes it may be poor where pressures vary, as they do in every real contact. What counts for an
    engineer is that a finer mesh gives a better answer.

    **How it is judged.** The exact field of wavy half-planes is elementary (`docs/concepts/accuracy.md`), and the
    profiles are such that the interface is flat in the end. Meshes are 6r on 8r cells, r = 1, 2, 4 and 8, and the
    penalty grows as E/h, so that its layer of springs, which the exact solution has too, vanishes with h. A case is one
    choice of the slave and one penalty. The rates are the slopes of log error over log h:

    - forces: E_F = sqrt(Σ|F_i − F_i^exact|²/m_i) over sqrt(Σ|F_i^exact|²/m_i) with m_i = ∫N_i ds, on slave and master;
      right ones measure 1.41 to 1.90 (two half passes, whose sides are not in balance, 1.22), and formulations that
      fail the patch test at most 0.42 on one of the sides at 10 E/h with the upper body as the slave;
    - displacements of both surfaces in L2: right ones 1.89 to 2.08; the rate is 2 but for the coarsest mesh;
    - reported pressures, if there are any, with the formulation's own weights: 1.08 to 2.20 against at most 0.87;
      pressures that are constant on each segment have the rate 1, but for the coarsest mesh.

    On the finest mesh pressures are judged by the best pressure that is constant on each segment, which is off by
    kh/√24 of the wave's amplitude. Roundoff is uXε̂/p = 5e-6, and no error comes near to it. Pressures that two passes
    share are not judged.

    In two more cases the slave is four times finer, or four times coarser, than the master: 4r on r cells, r = 6, 9, 13
    and 18, at 10 E/h with the h of the coarser mesh. A pressure that jumps between coarse slave segments, as that of
    few points or of dual shapes does, has the rate 1 on a finer master. Forces of right ones have at least 0.95 there,
    others at most 0.58. As much is asked on a finer slave, since pressures may belong to the master: such a right one
    has 0.97 there, others at least 1.62, and several wrong ones hide below the error of the coarse body. Less is asked
    of displacements, since the coarse body has at most 18 cells and not 48: right ones have 1.84, half passes 1.72.

    In space a block with the surface h cos(πx/w) cos(πy/l), an egg-box, is pressed on a flat one until all is in
    contact: the amplitude of the pressure is h/(C + C + 1/ε̂) with the compliances C of layers on rollers. It is Σ F_i
    cos cos over the slave's nodes, over the same sum of the exact nodal forces. Meshes are 4r × 3r faces on 3r × 4r,
    r = 1 and 2, with ε̂ = 100 (E = 1000 and 300), and on hexahedra with 1e4, too. The error is of second order:
    (4 e₂ − e₁)/3 is at most 0.02, where 0.01 is measured, and the rate at least 1.6 where e₂ is above 0.01. On
    tetrahedra 0.04 and 1.3 are allowed, as a dual mortar method has 0.022 and 1.43; multipliers may have 0.1 and 1.2,
    as springs of 1e6 have 0.044 and 1.27 there. E_F at r = 2 is at most 0.05; right ones have 0.03.

    Without waves the pressure is uniform, and nodes inside are moved back and forth by a fifth of a side: on hexahedra
    E_F is at most 0.01 at r = 2, and with 3 × 3 faces on 9 × 10 it is at most 0.1. With cells right ones have 1e-4,
    with Gauss points on whole faces 0.005 and 0.055. Areas or shape functions of parallelograms have 0.03 and more on
    the one mesh, a search that stops at eight faces 0.3 on the other.

    **Undecided.** Where Newton's method finds no solution on one of the meshes.

    **Source.** K. L. Johnson, Contact Mechanics (1985), Chapter 13.
    """
    if case.interface.dim != PLANE:
        return _measure_egg_box(case, subject)
    return _measure_convergence(WAVY_STUDIES, case, subject)


def promise_without_locking(traits: Traits) -> bool | None:
    """Return whether the traits promise convergence without locking; None if they leave one of them open."""
    if traits.promises.converges is False or traits.promises.locks is True:
        return False
    return True if traits.promises.converges and traits.promises.locks is False else None


@_define(CURVED_STUDIES)(
    id="accuracy.wavy-curved", rank=530, promise=promise_without_locking, shown_by=frozenset({"contact_points"})
)
def accuracy_wavy_curved(case: Case, subject: Subject) -> Measurement:
    """Wavy bodies converge to the exact solution on a curved interface too, at a high penalty as well.

    **Question.** The bodies of `accuracy.wavy` fit along a wave of 1e-6 of their size. Do nodal forces, pressures and
    displacements converge there too, at a moderate and at a high penalty?

    **Why it matters.** On a curved interface the facets of two meshes do not lie on one another. At 100 E/h the
    distance between them is up to ten times the penetration. A method that presses every point of every facet then
    carries the load on the few places where facets cross: it locks. Its pressures are wrong by half of their own size
    and more, on any mesh.

    **How it is judged.** As `accuracy.wavy`, with the same exact field: a slope of 1e-6 changes it by as much. Chords
    leave a part of the error that falls with h alone, so less is asked of the rate of forces and of the size of
    pressures; right ones have at least 1.13 and at most 1.4kh/√24. Displacements and pressures are asked for the rates
    of `accuracy.wavy`: right ones have at least 1.89 and 1.28. At 100 E/h the pressures of formulations that lock are
    off by 0.17 and more, where 0.08 to 0.11 is allowed, or displacements converge with 1.3. The promise is that a
    formulation converges (`converges`) and does not lock (`locks`). Where no pressures are reported, nothing may show
    that it locks, and nobody is held to fail. At 1000 E/h forces of those that lock fall with at most 0.82, but
    Newton's method finds no solution for some there. `docs/concepts/accuracy.md` has a picture.

    **Undecided.** Where Newton's method finds no solution on one of the meshes.
    """
    return _measure_convergence(CURVED_STUDIES, case, subject)


TOTAL = Quantity(
    "total force on a point contact",
    "0.08",
    "Five cells on 1.2 a, springs of 10 E/h and a rigid body that is not a parabola; right ones have 0.04.",
)
NODES = Quantity(
    "error of nodal forces on a point contact",
    "0.16, with multipliers 0.24",
    "The mesh is coarse; right ones have 0.10, and 0.17 where springs hardly give way.",
)


def _measure_point(case: Case, subject: Subject) -> Measurement:
    instance = HERTZ_POINT.pose(HERTZ_CELLS, subject.traits)
    solution = solve_for_accuracy(instance.scene, subject)
    n_slave = solution.interface.n_slave_nodes
    forces, exact = solution.forces[:n_slave], instance.exact_forces(solution.state)[:n_slave]
    total = abs(float(forces[:, 2].sum() / exact[:, 2].sum()) - 1)
    nodes = float(np.linalg.norm(forces - exact) / np.linalg.norm(exact))
    undecided = "" if solution.balanced else _name_failures({HERTZ_CELLS: solution.end}, "Newton's method")
    most = 0.24 if subject.traits.rules.enforcement == "multiplier" else 0.16
    return Measurement(check_all({TOTAL: total, NODES: nodes}, {TOTAL: 0.08, NODES: most}), undecided)


@partial(_define(HERTZ_STUDIES), quantities=(*HERTZ_STUDIES.quantities, TOTAL, NODES))(
    id="accuracy.hertz",
    rank=520,
    cases_in_space=Cases.from_list(hertz_point_cases),
    promise=lambda traits: traits.promises.converges,
    applicable=applicability.refuse_unknown_pressure,
)
def accuracy_hertz(case: Case, subject: Subject) -> Measurement:
    """Forces and pressures of a contact with an edge converge to those of Hertz as meshes are refined.

    **Question.** A parabola is pressed on a flat. Do nodal forces on both sides, reported pressures, the peak and the
    half-width converge to those of the exact solution as both meshes become finer?

    **Why it matters.** This is what analysts use contact for: the stress in a contact whose size is not known
    beforehand. A method that fails the patch test leaves forces that do not converge at all unless the penalty stays
    soft on fine meshes.

    **How it is judged.** The finest of five meshes has 66 segments of the parabola across the contact; the flat's
    segments are shorter, and match nowhere. The sides of both bodies carry the exact stresses of half-planes. Each body
    is the slave once. The penalty is E/a, the same on all meshes ("layer"), or 1 E/h ("soft") or 100 E/h ("stiff"),
    which grow on finer meshes. The exact solution of each mesh is that of its own penalty: Hertz on a layer of springs,
    solved to 1e-10 of the peak; for multipliers Hertz himself.

    - E_F is sqrt(Σ|F − F_exact|²/m) over sqrt(Σ|F_exact|²/m), with m = ∫N ds. It is judged by P1, the L2 error of the
      continuous, piecewise linear pressure on the nodes of the same side that comes nearest to the exact one: 1.4e-3 to
      7e-3. No more than 3 P1 are allowed, and 8 P1 where springs are stiff and the flat is the slave. Those that pass
      the patch test reach 1.2 (layer), 1.4 (soft) and 2.2, strangers among them; others have 4.1 to 33 on the layer
      with up to five points a segment.
    - Where E_F is below its limit, but above 1.5 P1 (layer, soft) or 2.5 P1 (stiff), its rate is asked on meshes with
      16, 20, 26, 33 and 66 segments, two octaves: at least 1.1, 0.85 and 0.75. Hertz' pressure falls to 0 like a root
      of the distance from the edge, which allows 1; on a layer that stays as it is, it has a kink there, which allows
      1.5. Wrong ones have at most 0.6 where their error is that large. A small error may fall slowly: that of one point
      a segment is 0.6 of that of two.
    - Reported pressures are judged by the best pressure that is constant on each slave segment (P0). Segments of the
      parabola are straight, so that the gap varies along each by h²/(√180 · 2R) in the mean square; stiff springs turn
      that into pressures, which are allowed too. Constant pressures reach 0.9 of both, others 0.3.
    - The half-width 2 √(Σ F x² / Σ F) of the slave's forces is right up to one slave segment; right ones err by 0.04 of
      it. The peak of F/m is right to P1 (0.4 P1 is measured), and displacements of the slave, which are smoother than
      pressures, to 1.5 P1 on the layer and to P1 elsewhere (0.6 and 0.34).

    In space a rigid paraboloid is pressed into a quarter of a box of side 3a whose far sides move as Boussinesq's
    half-space does, with five cells on 1.2 a and ε̂ = 10 E/h. The total force is right to 0.08, and the nodal forces to
    0.16 in the mean square; right ones have 0.04 and 0.10. With multipliers 0.24 is allowed, as springs of 1e4 E/h have
    0.17.

    The trait `converges` is the promise. `docs/concepts/accuracy.md` has a picture.

    **Undecided.** A case in which Newton's method ends out of balance on some mesh, by more than 1e-4 of the largest
    force. It starts at the exact displacements, where nothing but the formulation's own kinks can keep it from ending.
    """
    if case.interface.dim != PLANE:
        return _measure_point(case, subject)
    return _measure_convergence(HERTZ_STUDIES, case, subject)


REFINEMENTS = (32, 64)  # Two meshes, one twice as fine, so that an error of second order can be taken away.
EXTRAPOLATED = 3e-5  # Right formulations reach 9.3e-6 here, and thirteen that share no code with them no more.

_SECOND_ORDER = (
    "Errors of second order are taken away by two meshes, (4 e₆₄ − e₃₂)/3. Right ones reach 9.3e-6, strangers too."
)
_CHORDS = "(h_s² + h_m²)/(8Rd)"
_CHORD_REASON = "A chord h is up to h²/8R inside its arc, so that gaps differ from d by no more than both."
SLAVE = Quantity("extrapolated radial force on the slave", f"{EXTRAPOLATED:g}", _SECOND_ORDER)
MASTER = Quantity("extrapolated radial force on the master", f"{EXTRAPOLATED:g}", _SECOND_ORDER)
SLAVE_SUM = Quantity("radial force on the slave", _CHORDS, _CHORD_REASON)
MASTER_SUM = Quantity("radial force on the master", _CHORDS, _CHORD_REASON)
ALONG = Quantity(
    "tangential force",
    "h_m/8R",
    "Normals of facets turn by up to h_m/2R to either side. In a sum of 192 such turns, 6 standard deviations leave a "
    "quarter; right ones reach a third of that.",
)
NODAL_FORCES = Quantity(
    "error of the slave's nodal forces", "h_m/2R", "The normal of a facet turns by no more than that."
)
SUM = Quantity("extrapolated sum of reported pressures", f"{EXTRAPOLATED:g}", _SECOND_ORDER)
PRESSURE = Quantity("error of the reported pressures", _CHORDS, _CHORD_REASON)


@cache
def _arc_cases() -> tuple[Case, ...]:
    names = {"convex slave": True, "concave slave": False}
    arcs = {name: Arcs(convex_slave=convex) for name, convex in names.items()}
    # The same numbers of segments: they are up to five times as long, so the penetration is four times as deep.
    circle = (0.0, 360.0)
    whole = {
        name: Arcs(depth=0.4, convex_slave=convex, slave=circle, master=circle)
        for name, convex in {"a disc in a hole": True, "a hole around a disc": False}.items()
    }
    return tuple(each.case(REFINEMENTS[0], name) for name, each in (arcs | whole).items())


@Property.define(
    id="accuracy.arc",
    rank=440,
    quantities=(SLAVE, MASTER, SLAVE_SUM, MASTER_SUM, ALONG, NODAL_FORCES, SUM, PRESSURE),
    cases=Cases.from_list(_arc_cases),
    linear=applicability.LINEAR_FORCES,
    promise=lambda traits: None if applicability.refuse_unknown_total(traits) else True,
    applicable=applicability.refuse_unknown_total,
)
def accuracy_arc(case: Case, subject: Subject) -> Measurement:
    """Springs between two concentric arcs press with ε̂ d, and reported pressures say so.

    **Question.** Two concentric arcs, or whole circles, penetrate each other by the same depth d everywhere. Do the
    forces and the reported pressures tend to those of a uniform pressure ε̂ d as the mesh is refined, whether the slave
    is convex or concave, a disc in a hole or a hole around a disc?

    **Why it matters.** No flat test sees what a formulation does where the surface bends. Here no body hides it: the
    pressure is known at every place (`docs/concepts/curved-surfaces.md`). A closed chain is a disc or a hole, and its
    numbers begin somewhere; who takes one for the other, or forgets the last segment, is right on open ones.

    **How it is judged.** The slave reaches from 10° to 80° in 3m equal segments, the master from 0° to 90° in 4m graded
    ones, of radius R = 4 at d = R/40, with m = 32 and 64. Circles have as many segments, numbered from anywhere, and
    d = R/10. Whatever the rule by which gaps are measured, the limit is the pressure ε̂ d on the slave's arc. A force is
    divided into its parts along the radius and across it. Errors are those over the exact radial sum.

    - The radial sum, on the slave, and on the master where the traits promise `conserves_force`. Chords h lie up to
      h²/8R inside their arcs, so that it is right to (h_s² + h_m²)/(8Rd) at m = 64, which is 4.6e-4 on arcs. Its part
      of second order is taken away by (4 e₆₄ − e₃₂)/3: what is left is at most 9.3e-6, and 3e-5 is allowed.
    - The tangential sum at m = 64. Normals of facets turn by up to h_m/2R = 3.5e-3 to either side on arcs. In a sum of
      192 such turns that have nothing to do with each other, 6 standard deviations are a quarter of that; right ones
      have 2.4e-4. It is not extrapolated, because it depends on how nodes meet.
    - The nodal forces of the slave at m = 64 (E_F): h_m/2R is allowed, and right ones reach half of that.
    - Reported pressures: the extrapolated sum over the weights (9.3e-6), and at m = 64 their root mean square error
      with the plugin's own weights (a third of its bound). Of two passes the slave's points count, or for the sum the
      points of both, whichever comes nearer to the forces. Multipliers that are pressures are all ε̂ d here.

    The total is known from the traits only if `penalty` is "distributed" and `area` is stated. These formulations are
    asked to pass.

    **Undecided.** Never: the bounds are far above what a tie between two master segments changes.
    """
    arcs = Arcs.from_case(case)
    coarse, fine = (_errors(arcs, refine, subject) for refine in REFINEMENTS)
    extrapolated = {quantity: abs(4 * fine.sums[quantity] - coarse.sums[quantity]) / 3 for quantity in fine.sums}
    single = {SLAVE: SLAVE_SUM, MASTER: MASTER_SUM}
    values = fine.others | {single[quantity]: abs(fine.sums[quantity]) for quantity in single if quantity in fine.sums}
    tolerances = dict.fromkeys(extrapolated, EXTRAPOLATED) | {ALONG: fine.turn / 4, NODAL_FORCES: fine.turn}
    tolerances |= dict.fromkeys((SLAVE_SUM, MASTER_SUM, PRESSURE), fine.chords)
    details = {f"{quantity.name}, m = {REFINEMENTS[0]}": value for quantity, value in coarse.others.items()}
    measurement = Measurement(check_all(values | extrapolated, tolerances), details=details)
    return measurement.after("on this mesh and on one that is twice as fine")


class _ArcErrors(NamedTuple):
    """The errors on one mesh, and what chords and facets of its lengths may add to them."""

    sums: dict[Quantity, float]  # With their signs
    others: dict[Quantity, float]
    chords: float  # (h_s² + h_m²)/(8Rd)
    turn: float  # h_m/2R


def _errors(arcs: Arcs, refine: int, subject: Subject) -> _ArcErrors:
    case = arcs.case(refine)
    state = uniform_state(case, subject, arcs.pressure)
    n_slave, slave = case.interface.n_slave_nodes, case.interface.slave
    # Areas of the reference are those of the master's arc, on which the slave lies there.
    share = arcs.radius / arcs.slave_radius if subject.traits.rules.area == "reference" else 1.0
    forces, outwards = pushing_forces(state), case.positions / np.linalg.norm(case.positions, axis=1)[:, None]
    exact = share * arcs.length * arcs.pressure
    towards = np.where(np.arange(len(forces)) < n_slave, -1.0, 1.0) * (1 if arcs.convex_slave else -1)
    radial = towards * (forces * outwards).sum(axis=1) / exact
    across = (forces[:, 1] * outwards[:, 0] - forces[:, 0] * outwards[:, 1]) / exact
    sums, along = {SLAVE: float(radial[:n_slave].sum()) - 1}, [abs(float(across[:n_slave].sum()))]
    if subject.traits.promises.conserves_force:
        sums[MASTER] = float(radial[n_slave:].sum()) - 1
        along.append(abs(float(across[n_slave:].sum())))
    pressure = share * (-arcs.pressure if arcs.convex_slave else arcs.pressure)  # Outwards.

    def traction(places: FloatArray) -> FloatArray:
        pressures: FloatArray = pressure * places / np.linalg.norm(places, axis=1)[:, None]
        return pressures

    exact_forces = traction_forces(slave, case.positions, traction)
    others = {
        ALONG: max(along),
        NODAL_FORCES: force_error(forces, exact_forces, shape_integrals(slave, case.positions)),
    }
    if state.has_points:
        total = nearest_sum(state.points, exact * abs(float(radial[:n_slave].sum())))
        sums[SUM] = total / exact - 1
        others[PRESSURE] = _pressure_error(state.points, arcs.pressure)
    h_s, h_m = (float(side.lengths(case.positions).max()) for side in (slave, case.interface.master))
    chords = (h_s**2 + h_m**2) / (8 * arcs.radius * arcs.depth)
    return _ArcErrors(sums, others, chords, h_m / (2 * arcs.radius))


def _pressure_error(points: ContactPoints, pressure: float) -> float:
    """Return the root mean square of p/p_exact − 1 over the weights; infinite if no point of the slave has any."""
    counted = ~points.on_master & (points.weight > 0)
    if not counted.any():
        return np.inf
    errors = np.where(points.active, points.pressure, 0.0)[counted] / pressure - 1
    return float(np.sqrt(np.average(errors**2, weights=points.weight[counted])))
