"""The cases with which formulations prove that they fail."""

from __future__ import annotations

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.problems.named_states import named_case
from contactverif.run.draw import CaseSource


def find_witness(subject: Subject, question: Property, source: CaseSource) -> Case:
    """Return the case that the traits name as a proof that the formulation fails.

    It is a case of the property's own finite list, if that has one of this name, else a named state or scene.
    """
    name = subject.traits.witness(question.id)
    if name is None:
        raise MisuseError(
            "witnesses", f"none for {question.id}, which {subject.name} says it does not pass", "the name of a case"
        )
    if isinstance(source, tuple) and (matches := [case for case in source if case.name == name]):
        return matches[0]
    if not question.bodies:
        return named_case(name)
    # The catalogue imports bodies and Newton's method, so it is imported only where it is needed.
    from contactverif.problems.catalogue import load_scene_case

    return load_scene_case(name)
