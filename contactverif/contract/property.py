"""The contract of a check: what it needs, how it measures, and how a measurement becomes a verdict.

Measuring and judging are apart: a `Measurement` holds numbers, the tolerances they are held against and why, so that a
stored one can be judged again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from math import isfinite
from typing import Any, Literal

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import Traits
from contactverif.contract.subject import Subject


class Verdict(IntEnum):
    """How a case, or a property over all of its cases, came out. The numbers are those of a report."""

    PASS = 0
    FAIL = 1
    UNDECIDED = 2
    NOT_APPLICABLE = 3
    CRASHED = 4
    NOT_PROVIDED = 5
    NOT_LOADED = 6
    NOT_JUDGED = 7

    def __str__(self) -> str:
        return self.name.lower().replace("_", " ")


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number that a property measures.

    Attributes
    ----------
    name : str
        Short, in words.
    unit : str
        "1" for a ratio.
    tolerance : str
        The formula, as it is printed; its symbols are explained in docs/concepts/tolerances.md.
    reason : str
        Why that formula.
    sense : Literal['at most', 'at least']
        Whether the number must be at most or at least the tolerance.
    """

    name: str
    unit: str
    tolerance: str
    reason: str
    sense: Literal["at most", "at least"] = "at most"


@dataclass(frozen=True, slots=True)
class Measurement:
    """Numbers, and what they are held against; `undecided` is a reason why they decide nothing.

    Attributes
    ----------
    values, tolerances : Mapping[str, float]
        {quantity: number}, the same names; a NaN value is a failure.
    undecided : str
        Empty, or why a failure would not be the formulation's fault (roundoff, a kink).
    broken : str
        Empty, or a breach that no number tells, in words.
    details : Mapping[str, float]
        Further numbers worth keeping, {name: number}.
    series : Mapping[str, FloatArray]
        Numbers by iterate, {name: (n_iterates,)}; those that the property declares.
    idle : bool
        Nothing was in contact, so that a pass says little; a property whose every case is idle is not judged.
    """

    values: Mapping[str, float]
    tolerances: Mapping[str, float]
    undecided: str = ""
    broken: str = ""
    details: Mapping[str, float] = field(default_factory=dict)
    series: Mapping[str, FloatArray] = field(default_factory=dict)
    idle: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Property:
    """A question to a formulation.

    Attributes
    ----------
    id : str
        Dotted, `patch.flat.transmission`.
    family : str
        The group of a report that it belongs to.
    summary : str
        What is asked, in one line.
    quantities : tuple[Quantity, ...]
        What is measured.
    cases : Callable[[Any], Any]
        Makes a hypothesis strategy of `Case`; given an interface, random states on that one, or None where the
        property cannot be asked of it. Where the property is one of bodies, it is given the case of a scene
        instead.
    measure : Callable[[Case, Subject], Measurement]
        Numbers from a case; raises what the plugin raises.
    needs : frozenset[str]
        Parts of the contract without which there is nothing to ask, {"pair", "tangent", "contact_points"}.
    promise : Callable[[Traits], bool | None]
        What the traits say: True passes, False does not (with a witness), None nothing.
    applicable : Callable[[Traits], str]
        Empty, or why the question makes no sense for these traits.
    series : Mapping[str, str]
        {name: unit} of the numbers by iterate that it keeps of each case.
    bodies : bool
        The cases are scenes, solved; else they are states of an interface alone.
    exact : Callable[[Case], FloatArray] | None
        Where there is an exact answer, the forces (n_nodes, dim) that push the nodes in this case, for
        pictures.
    """

    id: str
    family: str
    summary: str
    quantities: tuple[Quantity, ...]
    cases: Callable[[Any], Any]
    measure: Callable[[Case, Subject], Measurement]
    promise: Callable[[Traits], bool | None]
    needs: frozenset[str] = frozenset()
    applicable: Callable[[Traits], str] = lambda traits: ""
    series: Mapping[str, str] = field(default_factory=dict)
    bodies: bool = False
    exact: Callable[[Case], FloatArray] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What became of one case.

    Attributes
    ----------
    case : Case
        What was judged.
    verdict, reason : Verdict or str
        How it came out, and why it is no pass.
    measurement : Measurement | None
        The numbers, None where the plugin gave none.
    seconds : float
        Spent measuring and judging.
    breach : bool
        The plugin broke the contract or returned NaN: a failure that nobody can have promised.
    """

    case: Case
    verdict: Verdict
    reason: str = ""
    measurement: Measurement | None = None
    seconds: float = 0.0
    breach: bool = False

    @property
    def decided(self) -> bool:
        """Whether the case counts as judged."""
        return self.verdict in (Verdict.PASS, Verdict.FAIL, Verdict.CRASHED)


def excess(quantity: Quantity, value: float, tolerance: float) -> float:
    """How far the value is towards its tolerance: above 1 fails, infinite where either is no finite number."""
    if not (isfinite(value) and isfinite(tolerance)):
        return float("inf")
    top, bottom = (value, tolerance) if quantity.sense == "at most" else (tolerance, value)
    if bottom <= 0:
        return 0.0 if top <= bottom else float("inf")
    return top / bottom


def judge(question: Property, measurement: Measurement) -> tuple[Verdict, str]:
    """The verdict on a measurement, with its reason where it is no pass."""
    strangers = measurement.values.keys() - {quantity.name for quantity in question.quantities}
    if strangers:
        raise ValueError(f"{question.id} measured {sorted(strangers)}, which it does not declare as quantities")
    failures = []
    measured = [quantity for quantity in question.quantities if quantity.name in measurement.values]
    for quantity in measured:
        if not isfinite(value := measurement.values[quantity.name]):
            return Verdict.FAIL, f"{quantity.name} is {value}"
    untold = ""
    for quantity in measured:
        value, tolerance = measurement.values[quantity.name], measurement.tolerances[quantity.name]
        if not isfinite(tolerance):
            untold = f"the tolerance of {quantity.name} is {tolerance}"
        elif excess(quantity, value, tolerance) > 1:
            failures.append(f"{quantity.name} {value:.3g}, {quantity.sense} {tolerance:.3g}")
    if measurement.broken:
        failures.insert(0, measurement.broken)
    if failures and measurement.undecided:
        return Verdict.UNDECIDED, measurement.undecided
    if failures:
        return Verdict.FAIL, "; ".join(failures)
    if measurement.undecided and not measured:  # nothing to judge, and a reason why
        return Verdict.UNDECIDED, measurement.undecided
    if untold:  # the judge's fault, not the formulation's: neither a pass nor an accusation
        return Verdict.UNDECIDED, untold
    return Verdict.PASS, ""
