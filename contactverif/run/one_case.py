"""Load one formulation and one property by name, and judge one case: replaying and drawing a case share this."""

from __future__ import annotations

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.names import unknown_name_error
from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.isolation.limits import Limits
from contactverif.run import judging
from contactverif.run.registry import load_formulation, load_properties, property_ids


def the_formulation(name: str, limits: Limits | None = None) -> Subject:
    """Return the formulation of that name, with its options.

    Parameters
    ----------
    name : str
        The name as on the command line.
    limits : Limits | None
        The limits of a process of its own, in which the plugin lives; None to load it in this process.

    Raises
    ------
    MisuseError
        If there is none, or it does not load.
    """
    subject = load_formulation(name, limits)
    if isinstance(subject, NotLoaded):
        raise MisuseError("formulation", f"{name}, which does not load ({subject.reason})", "one that loads")
    return subject


def the_property(property_id: str) -> Property:
    """Return the property of that id.

    Raises
    ------
    MisuseError
        If there is none, or it does not load.
    """
    if property_id not in property_ids():  # A pattern is no id.
        raise unknown_name_error("property", property_id, property_ids())
    (question,) = load_properties([property_id])
    if isinstance(question, NotLoaded):
        raise MisuseError("property", f"{property_id}, which does not load ({question.reason})", "one that loads")
    return question


def judge_if_applicable(question: Property, case: Case, subject: Subject) -> Outcome:
    """Judge a case; if the property does not apply to the formulation, return an outcome that says so."""
    if reason := question.refusal(subject.traits):
        return Outcome(case, Verdict.NOT_APPLICABLE, reason)
    if missing := question.needs - subject.provides:
        return Outcome(case, Verdict.NOT_PROVIDED, f"{', '.join(sorted(missing))}: not provided")
    return judging.judge_case(question, case, subject)


def forces_on(case: Case, subject: Subject) -> FloatArray | None:
    """Return nodal forces (n_nodes, dim) to draw; None if the plugin returns none or has multipliers."""
    try:
        formulation = subject.for_case(case)
        if formulation.n_multipliers(case.interface):
            return None
        forces = formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)
    except ContractError:
        return None
    nodal: FloatArray = -forces.reshape(case.interface.nodes.shape)
    return nodal
