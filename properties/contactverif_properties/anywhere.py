"""Cases for questions that a kink does not matter to: any state at all, one in three of them an exact tie."""

from __future__ import annotations

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.case import Case
from contactverif.interface import Interface
from contactverif.strategies import general_cases, tie_cases


def any_cases(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Random meshes and states, ties among them; on a given interface random states."""
    if interface is not None:
        return general_cases(interface)
    return st.one_of(general_cases(), general_cases(), tie_cases())
