"""The judgement of one case, the order of outcomes from harmless to bad, and the verdict over those of a row.

Whatever a plugin does is an outcome. What the harness or a property does wrong is an exception.
"""

from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, replace
from math import inf, nan
from time import perf_counter

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, NonFiniteError, PluginError, describe_error, place_of_error
from contactverif.contract.interface import PLANE
from contactverif.contract.property import Outcome, Property, PropertyInfo, Verdict, checked_numbers, judge
from contactverif.contract.result import JUDGED_SHARE, OPPOSITE_SIGN, NodalForces, Row, exceeds
from contactverif.contract.subject import EngineSubject, FirstAnswers, Subject, ask_first
from contactverif.contract.traits import Traits
from contactverif.problems.named_states import first_state, flat_in_space, named_case
from contactverif.problems.open_states import fit_to_traits
from contactverif.problems.own_law import fit_to_law, is_nonlinear
from contactverif.sampling.hypothesis_draws import one_thread

STATES = ("a1", "c")  # Flat interfaces that penetrate uniformly.
LEAST_SHARE = 0.1  # A row says nothing of a formulation that takes less than this share of its cases.
RAISED = "the property raised "
ACTS_APART = "it acts where the gap is open, not where it is closed: look at the normal, and the order of master nodes"
NOT_LINEAR = "; on one flat pair forces are not in proportion to the gap: if that is the law, state rules.law='own'"
SLOW_CALL = 0.01  # Seconds of a call that are worth a word: the included formulations take 1e-4.


def judge_case(question: Property, case: Case, subject: Subject) -> Outcome:
    """Judge one case, a new one or one that was stored. Whatever the plugin or the property does is an outcome.

    Parameters
    ----------
    question : Property
        The property to check.
    case : Case
        The case to check it on.
    subject : Subject
        The formulation.

    Returns
    -------
    Outcome
        Verdict, reason and numbers. Where the property raises an exception, the case is undecided.
    """
    start = perf_counter()

    def outcome(verdict: Verdict, reason: str, *, breach: bool = False) -> Outcome:
        return Outcome(case, verdict, reason, seconds=perf_counter() - start, breach=breach)

    try:
        case, refused = fit_to_traits(case, subject.traits)
        if refused:
            return outcome(Verdict.UNDECIDED, refused)
        with one_thread(), np.errstate(all="ignore"):  # A check of the answer reports NaN, not a warning on the way.
            measurement = question.measure(fit_to_law(case, subject), subject)
            verdict, reason = judge(question, measurement)
            if verdict is Verdict.FAIL and _may_have_own_law(question, case, subject.traits):
                with suppress(ContractError):
                    pair = case if "penetration" in case.parameters else named_case(STATES[0])
                    reason += NOT_LINEAR if is_nonlinear(pair, subject) else ""
    except PluginError as error:
        verdict = Verdict.UNDECIDED if error.cause == "not asked" else Verdict.CRASHED
        return outcome(verdict, f"{error.cause}: {error}")
    except NonFiniteError as error:
        return outcome(Verdict.FAIL, f"not finite: {error}", breach=True)
    except ContractError as error:
        return outcome(Verdict.FAIL, f"breaks the contract: {error}", breach=True)
    except Exception as error:  # A mistake of the judge: `verdict_over_all` does not let it pass.
        return outcome(Verdict.UNDECIDED, f"{RAISED}{describe_error(error)}{place_of_error(error)}")
    return replace(outcome(verdict, reason), measurement=measurement)


def _may_have_own_law(question: Property, case: Case, traits: Traits) -> bool:
    """Return whether a law that is not linear may fail so: at a uniform gap, or where linear springs are asked."""
    rules, uniform = traits.rules, "penetration" in case.parameters
    springs = rules.enforcement == "penalty" and rules.penalty != "nodal" and rules.law is None
    return springs and traits.abilities.in_plane and (uniform or bool(question.linear))


def judge_if_applicable(question: Property, case: Case, subject: Subject) -> Outcome:
    """Judge a case; if the property does not apply to the formulation, return an outcome that says so."""
    if reason := question.refusal_of(subject):
        return Outcome(case, Verdict.NOT_APPLICABLE, reason)
    if missing := question.needs - subject.provides:
        return Outcome(case, Verdict.NOT_PROVIDED, f"{', '.join(sorted(missing))}: not provided")
    return judge_case(question, case, subject)


def badness(info: PropertyInfo, outcome: Outcome) -> tuple[int, float]:
    """Return a key that orders outcomes: crashes, breaches of the contract, failures by how far beyond tolerance."""
    if outcome.verdict is Verdict.CRASHED:
        return 3, inf
    if outcome.verdict is not Verdict.FAIL:
        return 0, 0.0
    if outcome.breach:
        return 2, inf
    if outcome.measurement is None or outcome.measurement.broken:
        return 1, inf
    return 1, max((number.ratio for number in checked_numbers(info, outcome.measurement)), default=inf)


def verdict_over_all(row: Row) -> tuple[Verdict, str]:
    """Return verdict and reason of a row from its outcomes."""
    everything = [*row.outcomes, *([row.witness] if row.witness else [])]
    # Before any failure: one that is stated would let the mistake of the property pass.
    if raised := next((outcome.reason for outcome in everything if outcome.reason.startswith(RAISED)), ""):
        return Verdict.NOT_JUDGED, raised
    worst = max(everything, key=lambda outcome: badness(row.info, outcome), default=None)
    if worst is not None and worst.verdict in (Verdict.CRASHED, Verdict.FAIL):
        name = worst.case_or_summary.name  # A finite list has named its cases.
        return worst.verdict, f"{name}: {worst.reason}" if name and worst is not row.witness else worst.reason
    planned = max(row.planned - row.foreign, 1)
    if row.planned - row.foreign < LEAST_SHARE * row.planned:
        cause = next(iter(row.tally.reasons))
        return Verdict.UNDECIDED, f"{row.judged} of {row.planned} cases judged; too few are left because {cause}"
    fewest = JUDGED_SHARE * (1 - row.info.usual_undecided) * planned
    if not any(outcome.case_or_summary.name for outcome in row.outcomes[:1]):
        # Not a list. Of a few random cases, the one that cannot be judged comes by chance.
        fewest = min(fewest, max(planned - 1, 1))
    if row.judged < fewest:
        cause = next((f"most often because {reason}" for reason in row.tally.reasons), "no more cases could be made")
        # Of what nobody promises, nothing can be kept or broken.
        verdict = Verdict.UNDECIDED if row.promise is None and row.undecided and not row.known else Verdict.NOT_JUDGED
        return verdict, f"{row.judged} of {row.planned} cases judged; {cause}"
    counts, least = row.tally.counts, row.info.least_contact
    if counts.idle and counts.idle == counts.judged and least:
        return Verdict.NOT_JUDGED, "nothing was in contact in any case: nothing was judged"
    # Chance may leave some more without contact than are allowed: of a share of 80 % in contact up to 36 of 100 cases,
    # and 8 of 12.
    if exceeds(counts.idle, counts.judged, 1.0 - least):
        words = f"{counts.judged - counts.idle} of {counts.judged} judged cases in contact, needed {least:.0%}"
        return Verdict.NOT_JUDGED, words
    return Verdict.PASS, ""


def forces_on(case: Case, subject: Subject) -> FloatArray | None:
    """Return nodal forces (n_nodes, dim) to draw; None if the plugin returns none or has multipliers."""
    try:
        formulation = subject.for_case(fit_to_law(case, subject))
        if formulation.n_multipliers(case.interface):
            return None
        forces = formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)
    except ContractError:
        return None
    return -forces.reshape(case.interface.nodes.shape)


def forces_to_draw(question: Property, case: Case, subject: Subject) -> NodalForces | None:
    """Return the forces of a formulation on a case, beside the exact ones where the property knows them.

    Those of bodies are at the exact solution where it is uniform, else at the first guess and without exact ones.
    """
    uniform = not case.packed_bodies
    if case.packed_bodies:
        from contactverif.problems.blocks import at_exact_solution, is_uniform  # Mechanics take long to import.

        case, uniform = at_exact_solution(case), is_uniform(case)
    forces = forces_on(case, subject)
    if forces is None:
        return None
    if question.exact is None or not uniform:
        return NodalForces(forces)
    return NodalForces(forces, question.exact(case))


@dataclass(frozen=True, slots=True)
class FirstCall:
    """The findings of the first calls of a formulation."""

    mistake: str = ""  # `OPPOSITE_SIGN`, `ACTS_APART` or nothing.
    answers: FirstAnswers | None = None
    seconds: float | None = None  # Of a pairing and a residual that are asked once more; a kernel is compiled then.


def call_first(subject: Subject, parts: Collection[str]) -> FirstCall:
    """Call a formulation for the first time, and return whether its sign or its gap is turned round, and its answers.

    Many compile their kernels in the first call. `parts` are the optional parts that the run will need; no other part
    is called. What else goes wrong here, the properties will say: then there are no answers.
    """
    if isinstance(subject, EngineSubject):
        return FirstCall()  # It has no forces to ask for.
    first_case, refused = first_state(subject.traits)
    if refused:
        return FirstCall()  # A barrier whose activation is unknown is not defined in these states.
    try:
        with one_thread(), np.errstate(all="ignore"):
            first = ask_first(subject, first_case, parts)
            name, *others = STATES if subject.traits.abilities.in_plane else (flat_in_space(subject.traits),)
            start = perf_counter()
            push = _push(subject, name)
            seconds = perf_counter() - start
            if seconds >= SLOW_CALL:  # A busy machine makes one call slow, and hardly two.
                start = perf_counter()
                _push(subject, name)
                seconds = min(seconds, perf_counter() - start)
            mistake = ""
            if push < 0 and all(_push(subject, name) < 0 for name in others):
                mistake = OPPOSITE_SIGN
            elif push == 0 and subject.traits.rules.enforcement == "penalty":
                mistake = ACTS_APART if abs(_push(subject, name, apart=True)) > 0 else ""
            if "contact_points" in parts:  # Their kernels are compiled, too.
                with suppress(ContractError):
                    formulation, case = subject.for_case(first.case), first.case
                    formulation.contact_points(case.interface, formulation.pair(case.interface, case.z), case.z)
    except ContractError:
        return FirstCall()
    return FirstCall(mistake, first, seconds)


def _push(subject: Subject, state: str, *, apart: bool = False) -> float:
    """Return the force on the slave away from the master in a state with a name, or where its surfaces are apart.

    A residual with all signs turned round is the most frequent mistake of a first plugin, and a normal turned round
    that of a first element. Then nearly every property fails, and none of the numbers says why. It is NaN for an error.
    """
    try:
        case = fit_to_traits(named_case(state), subject.traits)[0]
        formulation, interface = subject.for_case(case), case.interface
        pressure = case.penalty * case.parameter("penetration")  # Multipliers, if any, press.
        state_z = case.with_multipliers(np.full(formulation.n_multipliers(interface), pressure)).z.copy()
        x, y = case.parameters.get("direction", (0.0, 0.0))
        # It points out of the master.
        normal = np.array([-y, x]) if interface.dim == PLANE else case.parameters["normal"]
        slave = slice(interface.n_slave_nodes * interface.dim)
        if apart:
            state_z[slave] += np.tile(2 * case.parameter("penetration") * normal, interface.n_slave_nodes)
        residual = formulation.residual(interface, formulation.pair(interface, state_z), state_z)
    except ContractError:
        return nan
    return -float((residual[slave].reshape(-1, interface.dim) @ normal).sum())
