"""Roundoff in the forces on an interface: far from the origin, and at small gaps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case, Cases, random_source
from contactverif.contract.interface import Interface
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.oracle import uniform_pressure_weights_exact
from contactverif.problems.stability_states import stability_states
from contactverif.strategies.flat import exact_flat_cases, linear_flat_cases
from contactverif.strategies.surfaces import translated_surface_cases
from contactverif.strategies.translations import translated_cases
from contactverif_properties import exact_forces, roundoff
from contactverif_properties.applicability import knows_total
from contactverif_properties.kinks import explain_by_rounded_decision
from contactverif_properties.states import FrozenState, ask_forces_and_tangents, freeze_state, move_state

FORCES = roundoff.forces_quantity("change of the forces in roundings")
TANGENT = roundoff.tangent_quantity("change of the tangent in roundings")
SEARCH = roundoff.forces_quantity("change of the forces with a new pairing in roundings")
FORCES_THERE = roundoff.forces_quantity("error of the forces in roundings")
TOTAL_THERE = roundoff.forces_quantity("error of the total force in roundings")
KINDS = ("uniform penetration", "linear penetration")
LARGEST_DENOMINATOR = 13  # The hypotenuses of the triples are 5 and 13.
SWEPT_ROUNDINGS = roundoff.forces_quantity("error of a force in roundings")


@Property.define(
    id="stability.translation",
    rank=150,
    family="stability",
    quantities=(FORCES, TANGENT, SEARCH),
    cases=Cases.random(translated_cases),
    cases_in_space=Cases.random(translated_surface_cases),
    promise=lambda traits: traits.promises.translation_stable,
)
def stability_translation(case: Case, subject: Subject) -> Measurement:
    """A part far from the origin gets the same forces as the same part at the origin.

    **Question.** State and reference are moved by up to 2^20, while segments have lengths of 1 to 4. The move is exact:
    no coordinate is rounded. Do forces and tangent stay what they were?

    **Why it matters.** Assemblies, bridges and maps have coordinates of 10⁵ to 10⁷ and penetrations of 10⁻⁶. A
    formulation that forms a point of a segment there rounds it at its distance from the origin. What it subtracts
    afterwards is lost: forces are wrong by 10⁻⁴, and Newton's method stops at that.

    **How it is judged.** The forces are compared on the pairing of the state at the origin. The difference is counted
    in roundings (ω): how many times more it is than rounding all positions relative to their centroid, to 53 bits,
    would make it. A kernel that takes differences of nodes first gives 0, or a few where it centres its coordinates.
    The tolerance is 16, at any distance and any gap. A kernel that rounds points far away has 10⁵ and more at 2^20. The
    tangent may differ by 16 u D max(max|K|/ℓ, max|dK/dx|): a rounding turns a segment by u D/ℓ, and changes the
    stiffness of a law that is not linear. The state's own pairing at the far place must give these forces too. Without
    a promise (trait `translation_stable`), a failure is shown and breaks nothing: kernels that form points first are
    common, and right near the origin.

    **Undecided.** Never, if the plugin has a pairing. Without one, or with the far state's own pairing, a case is
    undecided where a decision hangs on less than 64 u D: there a right search may decide otherwise.
    """
    near = freeze_state(case, subject)
    far = replace(near, case=move_state(near.case, case.parameters["shift"]))
    (forces, forces_there), tangents = ask_forces_and_tangents(near, far)
    conditioning = roundoff.measure_conditioning(near, forces)
    values = {FORCES: conditioning.count_roundings(forces_there - forces)}
    if tangents:
        here, there = tangents
        values[TANGENT] = roundoff.count_tangent_roundings(
            near.case, here, there, roundoff.measure_tangent_slope(near, here)
        )
    # A plugin without a pairing decides anew in each residual. A frozen pairing decides the same in both places.
    excusable = near.pairing is None or max(values.values()) <= roundoff.MOST_ROUNDINGS
    if near.pairing is not None:
        searched = FrozenState.at(near.formulation, far.case)
        values[SEARCH] = conditioning.count_roundings(searched.residual - forces)
    undecided = ""
    if excusable and max(values.values()) > roundoff.MOST_ROUNDINGS:
        undecided = explain_by_rounded_decision(near)
    idle = not forces[: case.interface.n_unknowns].any()
    return Measurement(check_all(values, roundoff.MOST_ROUNDINGS), undecided, idle=idle)


def refuse_unknown_forces(traits: Traits) -> str:
    """Return why no exact force is known, or an empty string if one is."""
    known = _knows_forces(traits) or _knows_total_of_springs(traits) or traits.abilities.takes_longdouble
    return "" if known else "no exact force is known: the traits promise no patch test, no area and no long double"


@random_source("contactverif_properties.stability_local.local_cases")
def _local_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | None:
    """Return a strategy for each kind of penetration; None where an interface is given."""
    uniform, linear = exact_flat_cases(interface), linear_flat_cases(interface)
    return None if uniform is None or linear is None else dict(zip(KINDS, (uniform, linear), strict=True))


@Property.define(
    id="stability.local",
    rank=170,
    family="stability",
    quantities=(FORCES_THERE, TOTAL_THERE),
    cases=Cases.by_kind(_local_cases),
    kinds=KINDS,
    promise=lambda traits: True if traits.promises.translation_stable else None,
    applicable=refuse_unknown_forces,
)
def stability_local(case: Case, subject: Subject) -> Measurement:
    """Forces are as exact as the positions allow, whatever the gap and the distance from the origin.

    **Question.** A turned flat interface penetrates by 10⁻² to 10⁻⁸ of a segment, near the origin or far from it. The
    penetration is uniform, or linear along a straight slave. Are the forces as near to the exact ones as rounding the
    positions relative to one another lets them be?

    **Why it matters.** A small gap is a difference of large numbers, so an error of 10⁻⁷ at a gap of 10⁻⁹ is no fault:
    the positions do not contain more digits. The same error at a gap of 10⁻² is one. A tolerance that grows with the
    coordinates cannot tell them apart. And a formulation may be wrong by the same amount everywhere, as one in single
    precision, so that a translation does not show it.

    **How it is judged.** The error is counted in roundings (ω), as in `stability.translation`, with the same tolerance
    of 16 at any gap, distance and penalty. What is exact depends on the traits. Where the flat patch test is promised,
    it is the force on every node, in rationals on the stored positions. Else it is the answer in long double, if the
    plugin says that it can (`takes_longdouble`), and the total force ε̂ |g| A, if `area` and `penalty` say that springs
    are distributed. Multipliers that are pressures are all ε̂ |g|, and only the distribution of their forces counts.

    Under a linear penetration, the force on each slave node is exact where `integrates_linear_gap` is promised. The
    total on the slave is exact where `gap`, `force_along`, `penalty` and `area` state it. Where nothing is stated, and
    with multipliers, the forces are compared with those near the origin.

    A formulation promises this if it promises `translation_stable` and one of the above. Ratios of lengths stay below
    5: a kernel that moves the origin to a node rounds at the diameter, which is right, but costs digits on much shorter
    segments.

    **Undecided.** A failing case is undecided where a slave point faces a master node to within 64 u D. Both partners
    give the same gap there, but a search that asks for 0 ≤ ξ ≤ 1 may lose the point between them.
    """
    linear = "slope" in case.parameters
    pressure = exact_forces.uniform_multiplier(case) if linear else case.penalty * case.parameter("penetration")
    far = FrozenState.with_multiplier(subject.for_case(case), move_state(case, case.parameters["shift"]), pressure)
    near = replace(far, case=case.with_multipliers(far.case.multipliers))
    forces = far.residual
    conditioning = roundoff.measure_conditioning(near, near.residual)
    errors = (_errors_of_linear if linear else _errors_of_uniform)(near.case, subject.traits, forces)
    if FORCES_THERE not in errors and subject.traits.abilities.takes_longdouble:
        errors[FORCES_THERE] = forces - far.residual_at(far.case.z.astype(np.longdouble))
    if not errors:
        errors[FORCES_THERE] = forces - near.residual
    values: dict[Quantity, float] = {}
    if FORCES_THERE in errors:
        values[FORCES_THERE] = conditioning.count_roundings(errors[FORCES_THERE])
    if TOTAL_THERE in errors:
        reach = float(conditioning.reach[: case.interface.n_slave_nodes].sum())
        values[TOTAL_THERE] = roundoff.ratio(float(np.hypot(*errors[TOTAL_THERE])), UNIT_ROUNDOFF * reach)
    failed = max(values.values()) > roundoff.MOST_ROUNDINGS
    undecided = explain_by_rounded_decision(near) if failed else ""
    return Measurement(check_all(values, roundoff.MOST_ROUNDINGS), undecided)


def _errors_of_uniform(case: Case, traits: Traits, forces: FloatArray) -> dict[Quantity, FloatArray]:
    """Return the errors {quantity: of each row, or of the total force} that the traits make known.

    Constraint rows are not judged here, and get 0. With multipliers only the distribution of the forces counts.
    """
    knows_forces = _knows_forces(traits)
    if not knows_forces and not _knows_total_of_springs(traits):
        return {}
    exact, pulls, n_slave = exact_residual(case), list(map(Fraction, forces.tolist())), 2 * case.interface.n_slave_nodes
    total, exact_total = ([sum(part[axis:n_slave:2], Fraction()) for axis in (0, 1)] for part in (pulls, exact))
    if not knows_forces:
        return {TOTAL_THERE: np.array([float(x - right) for x, right in zip(total, exact_total, strict=True)])}
    scale = Fraction(1)
    if case.n_multipliers:
        projection = total[0] * exact_total[0] + total[1] * exact_total[1]
        if projection > 0:
            scale = (exact_total[0] * exact_total[0] + exact_total[1] * exact_total[1]) / projection
    errors = [float(pull * scale - right) for pull, right in zip(pulls, exact, strict=False)]
    return {FORCES_THERE: np.array([*errors, *([0.0] * case.n_multipliers)])}


def _errors_of_linear(case: Case, traits: Traits, forces: FloatArray) -> dict[Quantity, FloatArray]:
    """Return the same under a linear penetration, of the rows of slave nodes."""
    if traits.rules.enforcement != "penalty" or not exact_forces.knows_linear_total(traits):
        return {}
    n_slave = case.interface.n_slave_nodes
    error = forces[: 2 * n_slave].reshape(-1, 2) + exact_forces.exact_slave_forces(case, traits)
    errors = {TOTAL_THERE: error.sum(axis=0)}
    if traits.promises.integrates_linear_gap:
        errors[FORCES_THERE] = np.concatenate([error.reshape(-1), np.zeros(len(forces) - 2 * n_slave)])
    return errors


def exact_residual(case: Case) -> list[Fraction]:
    """Return the exact residual of a uniform pressure ε̂ |g| (n_unknowns entries), which pulls nodes back."""
    weights = uniform_pressure_weights_exact(case.interface, case.parameters["along"])
    x, y = (Fraction(entry).limit_denominator(LARGEST_DENOMINATOR) for entry in case.parameters["direction"].tolist())
    pressure = Fraction(case.penalty) * Fraction(case.parameter("penetration"))
    forces = []
    for node, weight in enumerate(weights):
        size = -pressure * weight if node < case.interface.n_slave_nodes else pressure * weight
        forces += [-y * size, x * size]  # The normal points to the left of the way the slave runs.
    return forces


def _knows_forces(traits: Traits) -> bool:
    """Return whether the traits say what the force on each node is: that of springs, or of uniform pressures."""
    if traits.rules.enforcement == "multiplier" and traits.rules.penalty != "distributed":
        return False
    return traits.promises.patch.flat is True


def _knows_total_of_springs(traits: Traits) -> bool:
    return traits.rules.enforcement == "penalty" and knows_total(traits)


def move_swept(case: Case) -> Case:
    """Return the state after its exact motion, multipliers included."""
    motion = ExactMotion.from_case(case)
    positions = motion.move(case.positions)
    z = np.concatenate([positions.reshape(-1), case.multipliers])
    return replace(case, interface=case.interface.at(motion.move(case.interface.nodes)), z=z)


@Property.define(
    id="stability.sweep",
    rank=330,
    family="stability",
    quantities=(SWEPT_ROUNDINGS,),
    cases=Cases.from_list(stability_states),
    promise=lambda traits: traits.promises.translation_stable,
)
def stability_sweep(case: Case, subject: Subject) -> Measurement:
    """Small gaps, short segments and a place far away cost no more digits than the condition number says.

    **Question.** A flat interface lies turned and far from the origin, with gaps down to 1e-12, segments down to 1e-9
    and offsets up to 1e9. Is the error of each nodal force at most sixteen times what rounding the positions relative
    to one another would change?

    **Why it matters.** A small gap is a difference of nearly equal coordinates. Then digits are lost in any
    formulation, and the condition number says how many. A kernel that rounds a point at its distance from the origin
    loses more. No test near the origin shows that, and in a model in global coordinates it looks like bad contact.

    **How it is judged.** The same state, flat and at the origin, is the reference: there every product is nearly exact.
    It is turned by a rational rotation and shifted, and neither rounds anything. Both residuals are evaluated on the
    pairing of the flat state. The error is counted in roundings, ω (see the shared measure of conditioning). The
    tolerance is 16. The states are a finite list. Besides ω, the error and the
    condition number of the worst force are kept.

    **Undecided.** Never, since no decision is made anew. A formulation without `pair` decides anew inside its residual.
    One that prefers an axis fails in every state: look at `objectivity` first.
    """
    state = freeze_state(case, subject)
    there = replace(state, case=move_swept(state.case))
    expected: FloatArray = np.array(state.residual)
    expected[: case.interface.n_unknowns] = ExactMotion.from_case(case).turn(state.forces).reshape(-1)
    error, conditioning = there.residual - expected, roundoff.measure_conditioning(state, state.residual)
    return roundoff.make_sweep_measurement(SWEPT_ROUNDINGS, conditioning, error, idle=not state.residual.any())


@dataclass(frozen=True, slots=True, eq=False)
class ExactMotion:
    """A rotation by a Pythagorean triple, and a translation behind it."""

    matrix: FloatArray  # (2, 2) The rotation times the hypotenuse, in integers.
    hypotenuse: float
    shift: FloatArray  # (2,) The translation, a length each.

    @classmethod
    def from_case(cls, case: Case) -> ExactMotion:
        """Return the motion that the parameters "turn", the legs of the triple, and "shift" of a case describe."""
        a, b = case.parameters["turn"]
        return cls(np.array([[a, -b], [b, a]]), float(np.hypot(a, b)), case.parameters["shift"])

    def move(self, positions: FloatArray) -> FloatArray:
        """Return the positions (n, 2) after the motion, exact for multiples of the triple's hypotenuse."""
        return (positions / self.hypotenuse) @ self.matrix.T + self.shift

    def turn(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (n, 2) after the rotation, each component rounded like a sum of two products."""
        return (vectors @ self.matrix.T) / self.hypotenuse

    def turn_back(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (n, 2) before the rotation."""
        return (vectors @ self.matrix) / self.hypotenuse
