"""What several properties ask on: any state at all, one in three of them an exact tie; and of whom they ask it."""

from __future__ import annotations

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.case import Case
from contactverif.formulation import Traits
from contactverif.interface import Interface
from contactverif.strategies import general_cases, tie_cases


def any_cases(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Random meshes and states, ties among them; on a given interface random states."""
    if interface is not None:
        return general_cases(interface)
    return st.one_of(general_cases(), general_cases(), tie_cases())


def springs_only(traits: Traits) -> str:
    """Empty for a penalty method. The states penetrate, where a barrier is not defined, and hold no multipliers."""
    if traits.enforcement == "penalty":
        return ""
    return f"the states are those of a penalty method, and the enforcement is by a {traits.enforcement}"
