"""Reasons why a question makes no sense for a formulation, from its traits alone.

Each function returns an empty string where the question can be asked, and else a reason that is printed in the table.
"""

from __future__ import annotations

from contactverif.contract.traits import Traits


def refuse_dependent_multipliers(traits: Traits) -> str:
    """Return why no scene is solved, or an empty string if a solution can be expected.

    Constraints that depend on one another contradict each other on bent surfaces, so Newton's method has nothing to
    converge to.
    """
    dependent = traits.promises.independent_multipliers is False
    return "the multipliers are not independent, so there need be no solution, nor one alone" if dependent else ""


def refuse_unstated_penalty(traits: Traits) -> str:
    """Return why the unit of the penalty is unknown, or an empty string if the traits name it."""
    known = traits.rules.penalty is not None
    return "" if known else "the trait `penalty` (nodal or distributed) is not stated, so its unit is unknown"
