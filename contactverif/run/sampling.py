"""The cases that a run draws: the source of the cases of every property, and their seed.

Rule for the next editor: the cases of a property depend on the seed of the run and on the property alone. So the choice
of properties and formulations, their order and the number of processes change no case.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.contract.property import Property
from contactverif.run.driver import CaseSource


@dataclass(frozen=True, slots=True)
class Sampling:
    """The size and the seed of a run, and the place where it asks.

    Attributes
    ----------
    examples : int
        The number of cases of each property.
    seed : int
        The seed of the run.
    interface : Interface | None
        The interface on which everything is checked; None for random ones.
    scene : Case | None
        The scene on which bodies are checked; None for random ones.
    """

    examples: int
    seed: int
    interface: Interface | None = None
    scene: Case | None = None

    def source(self, question: Property) -> CaseSource | None:
        """Return the source of the cases; None if the property cannot be checked on this interface or scene."""
        if not question.bodies:
            return cast("CaseSource | None", question.cases(self.interface))
        if self.interface is not None and self.scene is None:
            return None
        return cast("CaseSource | None", question.cases(self.scene))

    def key(self, question: Property) -> str:
        """Return the seed of a property, which does not depend on the other properties of the run."""
        return f"{self.seed}/{question.id}"
