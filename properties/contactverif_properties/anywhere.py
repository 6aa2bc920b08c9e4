"""What several properties ask on: any state at all, one in three of them an exact tie; and of whom they ask it.

A formulation with multipliers is asked about a state with some: random ones that press. As no body is there, the unit
of pressure is free, and is chosen so that c = 1 and multipliers are as large as penetrations would be: forces,
constraints and all parts of a tangent are then of one size and one unit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case
from contactverif.contract.formulation import Traits
from contactverif.contract.interface import Interface
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.strategies import general_cases, tie_cases

PRESS = (0.125, 0.25)  # random multipliers lie between, × the shortest segment


def any_cases(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Random meshes and states, ties among them; on a given interface random states."""
    if interface is not None:
        return general_cases(interface)
    return st.one_of(general_cases(), general_cases(), tie_cases())


def no_barrier(traits: Traits) -> str:
    """Empty but for a barrier: the states penetrate, where it is not defined."""
    if traits.enforcement != "barrier":
        return ""
    return "the states penetrate, where a barrier is not defined"


def posed(case: Case, subject: Subject) -> tuple[CheckedFormulation, Case]:
    """The formulation with the penalty of the case, and the case with multipliers if it has any."""
    formulation = subject.for_case(case)
    if not formulation.n_multipliers(case.interface):
        return formulation, case
    low, high = (share * case.shortest_segment for share in PRESS)
    formulation = subject.with_penalty(1.0)
    random = np.random.default_rng([case.seed, 1])  # not the numbers that the property draws for itself
    multipliers = random.uniform(low, high, formulation.n_multipliers(case.interface))
    return formulation, replace(case, penalty=1.0).with_multipliers(multipliers)
