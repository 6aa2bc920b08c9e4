"""The contract of a property: what it asks, what it measures, how that is judged, and what comes of one case.

Rules for the next editor: measuring and judging stay apart, so that a stored measurement can be judged again.
`PropertyInfo` is plain data, which a report stores; only a `Property` holds functions.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from functools import cache
from importlib import import_module
from inspect import getdoc
from math import isfinite
from sys import modules
from typing import Any, Literal, overload

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, Cases, CaseSummary
from contactverif.contract.errors import MisuseError, clean, refuse
from contactverif.contract.interface import TRIANGLE
from contactverif.contract.subject import SOLVE, TOO_DEEP, EngineSubject, Subject
from contactverif.contract.traits import Traits

LEAST_CONTACT = 0.8  # A pass with less than this share of cases in contact says little.
# With the 23 built-in formulations and 100 cases each, most properties leave none of 2300 cases undecided. Then the
# share is below 3/2300 with a probability of 95 %.
NONE_UNDECIDED = 3 / 2300
LAST_TURN = 99
# The reason of a case that is not asked of a formulation of open chains (`Abilities.chains`): no case to be judged.
CLOSED_CHAIN = "a chain is closed, and the formulation takes open ones"
FOREIGN = (CLOSED_CHAIN, TOO_DEEP)  # The reasons of all cases that a formulation does not take.
WITHOUT_BARRIER = frozenset({"penalty", "multiplier"})
WITH_BARRIER = WITHOUT_BARRIER | {"barrier"}


class Verdict(IntEnum):
    """The verdict on a case, or on a property over all of its cases. A report stores the numbers."""

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


FAILED = frozenset({Verdict.FAIL, Verdict.CRASHED})
DECIDED = FAILED | {Verdict.PASS}  # The verdicts that count as judged.
Role = Literal["", "foundation", "exact", "comparison", "trait"]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number that a property measures, and the formula of its tolerance.

    Attributes
    ----------
    name : str
        A short name, in words.
    tolerance : str
        The formula, as it is printed; its symbols are explained in docs/concepts/tolerances.md.
    reason : str
        The reason for that formula.
    unit : str
        The unit of value and tolerance; "1" for a ratio.
    sense : Literal['at most', 'at least']
        The relation of value to tolerance in a pass.
    """

    name: str
    tolerance: str
    reason: str
    unit: str = field(default="1", kw_only=True)
    sense: Literal["at most", "at least"] = field(default="at most", kw_only=True)

    def __post_init__(self) -> None:
        refuse("quantity", self.name, self.unit)
        clean(self, lines=("tolerance", "reason"))

    def check(self, value: float, tolerance: float) -> CheckedNumber:
        """Return a value of this quantity beside its tolerance, both in its unit. A NaN value is a failure."""
        return CheckedNumber(self, float(value), float(tolerance))


@dataclass(frozen=True, slots=True)
class CheckedNumber:
    """A measured number beside its tolerance, both in the unit of the quantity. A NaN value is a failure."""

    quantity: Quantity
    value: float
    tolerance: float

    @property
    def ratio(self) -> float:
        """Value over tolerance (the inverse for "at least"): above 1 fails, infinite if one is not finite."""
        if not (isfinite(self.value) and isfinite(self.tolerance)):
            return float("inf")
        at_most = self.quantity.sense == "at most"
        top, bottom = (self.value, self.tolerance) if at_most else (self.tolerance, self.value)
        if bottom <= 0:
            return 0.0 if top <= bottom else float("inf")
        return top / bottom

    @property
    def sign(self) -> str:
        """The sign between value and tolerance in a pass."""
        return "≤" if self.quantity.sense == "at most" else "≥"


@dataclass(frozen=True, slots=True)
class Finding:
    """The numbers at one place, beside what is right there.

    Attributes
    ----------
    place : str
        What the property did to the case, if anything, and the place, such as a row and a column of the tangent.
    found, right : tuple[float, ...]
        The numbers at that place, as many of both; empty where the place says it all.
    unit : str
        The unit of both.
    found_name, right_name : str
        What the numbers are, in a word: `force` and `exact`.
    remark : str
        Anything else about the place.
    """

    place: str
    found: tuple[float, ...] = ()
    right: tuple[float, ...] = ()
    unit: str = "1"
    found_name: str = "found"
    right_name: str = "right"
    remark: str = ""

    def __post_init__(self) -> None:
        clean(self, lines=("place", "unit", "found_name", "right_name", "remark"))
        for name in ("found", "right"):
            object.__setattr__(self, name, tuple(map(float, getattr(self, name))))
        if len(self.found) != len(self.right):
            raise ValueError(f"{len(self.found)} numbers are found, and {len(self.right)} are right")

    def __str__(self) -> str:
        if not self.found:
            return "; ".join(filter(None, (self.place, self.remark)))
        found, right = (", ".join(f"{number:.10g}" for number in numbers) for numbers in (self.found, self.right))
        text = f"{self.place}: {self.found_name} {found}, {self.right_name} {right}"
        return f"{text}; {self.remark}" if self.remark else text


@dataclass(frozen=True, slots=True)
class Measurement:
    """The numbers that a property measured on one case, with their tolerances.

    Attributes
    ----------
    numbers : Sequence[CheckedNumber]
        The numbers, each as `quantity.check(value, tolerance)`; one of each quantity at most.
    undecided : str
        The reason why a failure would not be the formulation's fault (roundoff, a kink); empty if it would.
    broken : str
        A breach that no number shows, in words; empty if there is none.
    details : Mapping[str, float]
        Further numbers worth keeping, {name: number}; they are not judged.
    series : Mapping[str, FloatArray]
        Numbers by iterate, {name: (n_iterates,)}; only those that the property declares.
    idle : bool
        Nothing was in contact, so that a pass says little; a property with too many idle cases is not judged
        (`PropertyInfo.least_contact`).
    finding : Finding | None
        The place of the worst number, and what is found and right there; None where nothing is known of it.
    """

    numbers: Sequence[CheckedNumber] = ()
    undecided: str = ""
    broken: str = ""
    details: Mapping[str, float] = field(default_factory=dict)
    series: Mapping[str, FloatArray] = field(default_factory=dict)
    idle: bool = False
    finding: Finding | None = None

    def __post_init__(self) -> None:
        clean(self, lines=("undecided", "broken"))
        object.__setattr__(self, "numbers", tuple(self.numbers))
        object.__setattr__(self, "idle", bool(self.idle))  # numpy's would turn counts of cases into numpy's integers.
        if len(self.values) != len(self.numbers):
            raise ValueError("a quantity is measured twice")

    def after(self, action: str, *quantities: Quantity, finding: Finding | None = None) -> Measurement:
        """Return the measurement of a case after an action on it, in words, which the finding of a failure begins with.

        It does where one of some quantities fails, by default any; `finding` then is where the worst number is.
        """
        if not any(each.ratio > 1 and each.quantity in (quantities or [each.quantity]) for each in self.numbers):
            return self
        finding = finding or self.finding or Finding("")
        place = ", ".join(filter(None, (action, finding.place)))
        return replace(self, finding=replace(finding, place=place) if place else None)

    @property
    def values(self) -> dict[str, float]:
        """The measured values, {name of the quantity: value}."""
        return {number.quantity.name: number.value for number in self.numbers}

    @property
    def tolerances(self) -> dict[str, float]:
        """The tolerances of the measured values, {name of the quantity: tolerance}."""
        return {number.quantity.name: number.tolerance for number in self.numbers}


def check_all(
    values: Mapping[Quantity, float], tolerance: Mapping[Quantity, float] | float
) -> tuple[CheckedNumber, ...]:
    """Return values beside one tolerance, or each beside its own; tolerances of what has no value play no part."""
    each = tolerance if isinstance(tolerance, Mapping) else dict.fromkeys(values, tolerance)
    return tuple(quantity.check(value, each[quantity]) for quantity, value in values.items())


Measure = Callable[[Case, Subject], Measurement]


@dataclass(frozen=True, slots=True, eq=False)
class PropertyInfo:
    """The description of a property for a reader of results: plain data, which a report stores.

    A MisuseError says that a share is not between 0 and 1, or that id, family or a kind is too long or cannot be shown.
    """

    id: str  # The dotted name on the command line, `patch.flat.transmission`.
    family: str  # The subject that the property belongs to, `patch`.
    summary: str  # The property in one line.
    quantities: tuple[Quantity, ...]  # The numbers that are measured and judged.
    # The parts of the contract without which the property cannot be checked, {"pair", "tangent", "contact_points"}. Who
    # leaves out a tangent that the traits promise breaks a promise; other parts are optional.
    needs: frozenset[str] = field(default=frozenset(), kw_only=True)
    # {name: unit} of the numbers by iterate that a measurement may hold.
    series: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    # The kinds of situation (`Case.kind`) that the strategy makes, in the order of tables. A run counts the cases of
    # each, and shows a kind of which there was no case too.
    kinds: tuple[str, ...] = field(default=(), kw_only=True)
    # The least share of judged cases in which something must be in contact, 0 to 1; with clearly less the property is
    # not judged. It is 0 where contact is not the question.
    least_contact: float = field(default=LEAST_CONTACT, kw_only=True)
    # The share of undecided cases of right formulations, 0 to 1, as it was measured. A formulation with more than twice
    # that, and more than chance allows, is reported: what is undecided may hide what is wrong.
    usual_undecided: float = field(default=NONE_UNDECIDED, kw_only=True)
    # The place of a failure among others, the lowest first: few other properties catch what such a property catches.
    # One of another author has −1 and is shown before ours, since it was installed for a purpose.
    rank: float = field(default=-1.0, kw_only=True)
    # "foundation" if a failure says that no other answer can be relied on; "exact" for an exact answer, behind which
    # failures of "comparison" are shown: two answers that differ do not say which is right; "trait" if a failure that
    # breaks no promise tells what method it is, and is no mistake.
    role: Role = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        refuse("property", self.id, self.family, *self.kinds, *self.series, *self.series.values())
        clean(self, lines=("summary",))
        for name in ("least_contact", "usual_undecided"):
            if not 0 <= getattr(self, name) <= 1:
                raise MisuseError(f"{self.id}: {name}", f"{getattr(self, name)}", "a share from 0 to 1")


@dataclass(frozen=True, slots=True, eq=False)
class Property(PropertyInfo):
    """A property that formulations are checked for; besides the attributes of `PropertyInfo` it has functions.

    Attributes
    ----------
    cases : Callable[[Any], Any]
        The cases in the plane, a `Cases`.
    cases_in_space : Cases | None
        The cases on interfaces in space, with a stored name of their own; None if the question is about plane
        interfaces alone. They are on triangles, unless the function that makes them has an argument `faces`.
    measure : Callable[[Case, Subject], Measurement]
        Measures one case; it raises what the plugin raises.
    promise : Callable[[Traits], bool | None]
        Reads the traits: True if the formulation states that it passes, False if it states (with a witness) that
        it fails, None if it states nothing.
    applicable : Callable[[Traits], str]
        Returns an empty string, or the reason why the property makes no sense for these traits, of which the
        enforcement is among `asks`.
    asks : frozenset[str]
        The enforcements of the formulations that the property is asked of.
    shown_by : frozenset[str]
        The parts of the contract that show a failure which the traits state. Where one is left out, the statement is
        not held against the formulation.
    bodies : bool
        The cases are scenes, which are solved; else they are states of an interface alone.
    engines : bool
        Displacements alone answer the question, so that engines are asked it too. A property of which `needs` holds
        "solve" is asked of engines alone, and need not say this.
    exact : Callable[[Case], FloatArray] | None
        Returns the exact forces (n_nodes, dim) that push the nodes of a case, for pictures; None where no exact
        answer is known.
    linear : str
        The reason why a law of its own (`Rules.own_law`) is not asked; empty if it is.
    turn : int
        The turn in the first round of a run, from 0 on: cheap properties, of which one fails for most mistakes.
    restarts : bool
        A second process of the formulation is asked, too. It starts once if one process judges all cases.
    question : str
        What is asked, why it matters, how it is judged and what is undecided, from which the property's page is made.
    """

    cases: Callable[[Any], Any]
    measure: Measure
    promise: Callable[[Traits], bool | None]
    applicable: Callable[[Traits], str] = lambda traits: ""
    asks: frozenset[str] = WITHOUT_BARRIER
    shown_by: frozenset[str] = frozenset()
    bodies: bool = False
    engines: bool = False
    exact: Callable[[Case], FloatArray] | None = None
    question: str = ""
    cases_in_space: Cases | None = None
    linear: str = ""
    turn: int = LAST_TURN
    restarts: bool = False

    @classmethod
    def define(
        cls,
        *,
        id: str,
        quantities: tuple[Quantity, ...],
        cases: Callable[[Any], Any],
        family: str = "",
        promise: Callable[[Traits], bool | None] = lambda traits: True,
        **others: Any,
    ) -> Callable[[Measure], Property]:
        """Return a decorator that makes a property of the function that measures.

        The first line of its docstring is the summary, and what follows is the question. The arguments are the other
        attributes of the property. Its family is the first word of its id, and every formulation promises it, unless
        the arguments say otherwise. A property that is made so can be pickled. A function without a docstring is
        refused.
        """

        def make(measure: Measure) -> Property:
            summary, _, question = (getdoc(measure) or "").partition("\n\n")
            if not summary:
                name = f"{measure.__module__}.{measure.__qualname__}"
                needed = "what must hold, in one line, and the question below it: the property's page is made of them"
                raise MisuseError(f"docstring of {name}", "none", needed)
            values = (id, family or id.partition(".")[0], summary, quantities, cases, measure, promise)
            return cls(*values, question=question, **others)

        return make

    @property
    def info(self) -> PropertyInfo:
        """The plain data alone."""
        return PropertyInfo(**{part.name: getattr(self, part.name) for part in fields(PropertyInfo)})

    def for_traits(self, traits: Traits) -> Property:
        """Return the property with the cases that a formulation of these traits takes: in the plane, or in space.

        A formulation that takes both is asked in the plane.
        """
        if traits.abilities.in_plane or self.cases_in_space in (None, self.cases):
            return self
        return _in_space(self, traits.abilities.faces if self.cases_in_space.takes_faces else (TRIANGLE,))

    def refusal_of(self, subject: Subject) -> str:
        """Return why the property is not asked of a formulation or an engine, or an empty string."""
        if isinstance(subject, EngineSubject) and not (self.engines or SOLVE in self.needs):
            return "displacements alone do not answer it"
        if SOLVE in self.needs - subject.provides:
            return "it is asked of whole codes"
        return self.refusal(subject.traits)

    def refusal(self, traits: Traits) -> str:
        """Return why the property is not asked of a formulation of these traits, or an empty string."""
        enforcement = traits.rules.enforcement
        if not traits.abilities.in_plane:
            if self.cases_in_space is None:
                return "the interfaces are plane, and the formulation takes none of them"
            if TRIANGLE not in traits.abilities.faces and not self.cases_in_space.takes_faces:
                return "the interfaces in space are of triangles, and the formulation takes none of them"
            if enforcement == "barrier":
                return "the states in space penetrate, where a barrier is not defined"
        if enforcement in self.asks:
            if enforcement == "barrier" and traits.rules.activation is None:
                return "the barrier does not state the trait `activation`, so no gap is known"
            return (self.linear if traits.rules.own_law else "") or self.applicable(traits)
        if enforcement == "barrier" and "penalty" in self.asks:
            return "the states penetrate, where a barrier is not defined"
        return f"the enforcement is by a {enforcement}"

    def __reduce__(self) -> str | tuple[Any, ...]:
        # The name of a decorated function is that of the property, so the function itself cannot be pickled by it.
        module, name = (getattr(self.measure, part, "") for part in ("__module__", "__qualname__"))
        at_home = getattr(modules.get(module), name, None)
        if not isinstance(at_home, Property) or at_home.measure is not self.measure:
            return super(Property, self).__reduce_ex__(2)
        values = {part.name: getattr(self, part.name) for part in fields(self)}
        changes = {name: value for name, value in values.items() if value is not getattr(at_home, name)}
        return _find_defined, (module, name, changes)


@cache
def _in_space(question: Property, faces: tuple[int, ...]) -> Property:
    """Return a property with its cases in space on such faces, the same object at each call."""
    assert question.cases_in_space is not None
    cases = question.cases_in_space.on_faces(faces)
    by_kind = cases(None) if question.kinds else ()
    kinds = tuple(by_kind) if isinstance(by_kind, Mapping) else ()
    return replace(question, cases=cases, cases_in_space=cases, kinds=kinds)


def _find_defined(module: str, name: str, changes: Mapping[str, Any]) -> Property:
    question: Property = getattr(import_module(module), name)
    return replace(question, **changes) if changes else question


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """The verdict on one case, with the numbers behind it.

    Attributes
    ----------
    case_or_summary : Case | CaseSummary
        The case that was judged; of most cases in a report only the summary is stored.
    verdict, reason : Verdict or str
        The verdict, and the reason why it is no pass.
    measurement : Measurement | None
        The numbers; None if the plugin gave none.
    seconds : float
        Time spent measuring and judging.
    breach : bool
        The plugin broke the contract or returned NaN: a failure that no statement excuses.
    """

    case_or_summary: Case | CaseSummary
    verdict: Verdict
    reason: str = ""
    measurement: Measurement | None = None
    seconds: float = 0.0
    breach: bool = False

    def __post_init__(self) -> None:
        clean(self, lines=("reason",))

    @property
    def decided(self) -> bool:
        """Return whether the case counts as judged."""
        return self.verdict in DECIDED

    @property
    def case(self) -> Case:
        """The case itself; a MisuseError says that only its summary was stored."""
        if not isinstance(self.case_or_summary, Case):
            needed = "a counterexample; of all other cases a report stores no more than that"
            raise MisuseError("case", "the summary of a case", needed)
        return self.case_or_summary

    @property
    def summary(self) -> CaseSummary:
        """The numbers that say what kind of case it is."""
        case = self.case_or_summary
        return CaseSummary.from_case(case) if isinstance(case, Case) else case


def checked_numbers(info: PropertyInfo, measurement: Measurement | None) -> tuple[CheckedNumber, ...]:
    """Return the measured numbers beside their tolerances, in the order of the quantities."""
    by_name = {number.quantity.name: number for number in measurement.numbers} if measurement is not None else {}
    pairs = [(quantity, by_name[quantity.name]) for quantity in info.quantities if quantity.name in by_name]
    return tuple(quantity.check(number.value, number.tolerance) for quantity, number in pairs)


def judge(info: PropertyInfo, measurement: Measurement) -> tuple[Verdict, str]:
    """Return the verdict on a measurement, with its reason if it is no pass."""
    strangers = measurement.values.keys() - {quantity.name for quantity in info.quantities}
    if strangers:
        raise ValueError(f"{info.id} measured {sorted(strangers)}, which it does not declare as quantities")
    numbers = checked_numbers(info, measurement)
    for number in numbers:
        if not isfinite(number.value):
            return Verdict.FAIL, f"{number.quantity.name} is {number.value}"
    failures = [measurement.broken] if measurement.broken else []
    failures += [
        f"{number.quantity.name} {number.value:.3g}, {number.quantity.sense} {number.tolerance:.3g}"
        for number in numbers
        if isfinite(number.tolerance) and number.ratio > 1
    ]
    if measurement.undecided and (failures or not numbers):
        return Verdict.UNDECIDED, measurement.undecided
    if failures:
        return Verdict.FAIL, "; ".join([*failures, *([str(measurement.finding)] if measurement.finding else [])])
    for number in reversed(numbers):
        if not isfinite(number.tolerance):  # The judge's fault, not the formulation's: neither pass nor accusation.
            return Verdict.UNDECIDED, f"the tolerance of {number.quantity.name} is {number.tolerance}"
    return Verdict.PASS, ""


def judge_stored(info: PropertyInfo, outcome: Outcome) -> Outcome:
    """Return an outcome with the verdict that follows from its numbers; one without numbers is returned as it is."""
    measurement = outcome.measurement
    if measurement is None:
        return outcome
    if any(number.quantity not in info.quantities for number in measurement.numbers):
        raise ValueError(f"numbers that {info.id} does not declare")
    verdict, reason = judge(info, measurement)
    if (verdict, reason, False) == (outcome.verdict, outcome.reason, outcome.breach):
        return outcome
    return replace(outcome, verdict=verdict, reason=reason, breach=False)


class Outcomes(Sequence[Outcome]):
    """The outcomes of a row in order. A class of this kind has its length, and `at`."""

    @abstractmethod
    def at(self, number: int) -> Outcome:
        """Return an outcome by its number, from 0."""

    @overload
    def __getitem__(self, number: int) -> Outcome: ...
    @overload
    def __getitem__(self, number: slice) -> tuple[Outcome, ...]: ...
    def __getitem__(self, number: int | slice) -> Outcome | tuple[Outcome, ...]:
        if isinstance(number, slice):
            return tuple(self.at(n) for n in range(*number.indices(len(self))))
        if not -len(self) <= number < len(self):
            raise IndexError(number)
        return self.at(number % len(self))
