"""One formulation, one property, asked for by name and put together: what replaying and drawing a case share."""

from __future__ import annotations

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.run import runner
from contactverif.run.registry import load_formulation, load_properties


def the_formulation(name: str) -> Subject:
    """The formulation of that name, with its options.

    Raises
    ------
    MisuseError
        If there is none, or it does not load.
    """
    subject = load_formulation(name)
    if isinstance(subject, NotLoaded):
        raise MisuseError("formulation", f"{name}, which does not load ({subject.reason})", "one that loads")
    return subject


def the_property(property_id: str) -> Property:
    """The property of that id.

    Raises
    ------
    MisuseError
        If there is none, or it does not load.
    """
    (question,) = load_properties([property_id])
    if isinstance(question, NotLoaded):
        raise MisuseError("property", f"{property_id}, which does not load ({question.reason})", "one that loads")
    return question


def judged(question: Property, case: Case, subject: Subject) -> Outcome:
    """The outcome of a case; also where the property cannot be asked of the formulation."""
    if reason := question.applicable(subject.traits):
        return Outcome(case, Verdict.NOT_APPLICABLE, reason)
    if missing := question.needs - subject.provides:
        return Outcome(case, Verdict.NOT_PROVIDED, f"{', '.join(sorted(missing))}: not provided")
    return runner.judge_case(question, case, subject)


def forces_on(case: Case, subject: Subject) -> FloatArray | None:
    """Nodal forces (n_nodes, dim) to draw; None where the plugin gives none, or has multipliers: no case holds any."""
    try:
        formulation = subject.for_case(case)
        if formulation.n_multipliers(case.interface):
            return None
        forces = formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)
    except ContractError:
        return None
    nodal: FloatArray = -forces.reshape(case.interface.nodes.shape)
    return nodal
