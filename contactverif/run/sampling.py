"""The cases that a run draws: the source of the cases of every property, and their seed.

Rule for the next editor: the cases of a property depend on the seed of the run and on its strategy alone. So the choice
of properties and formulations, their order and the number of processes change no case, and properties with the same
strategy share their cases.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

from contactverif.contract.case import Case
from contactverif.contract.cases import name_of_source
from contactverif.contract.interface import Interface
from contactverif.contract.property import Property
from contactverif.run.driver import CaseSource
from contactverif.run.one_thread import one_thread


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
        if question.bodies and self.interface is not None and self.scene is None:
            return None
        with one_thread():
            return cast("CaseSource | None", question.cases(self.scene if question.bodies else self.interface))

    def key(self, question: Property) -> str:
        """Return the seed of the cases of a property, which properties with the same strategy have in common."""
        return f"{self.seed}/{strategy_name(question)}"

    def group(self, question: Property) -> tuple[str, bool]:
        """Return what properties have in common if their cases are the same: the seed, and what makes them."""
        return self.key(question), question.bodies


def strategy_name(question: Property) -> str:
    """Return the stored name of the strategy of a property (`random_source`), or else the id of the property."""
    return name_of_source(question.cases) or question.id
