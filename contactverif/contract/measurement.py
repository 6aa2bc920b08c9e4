"""A measurement: the numbers of a property on one case, beside their tolerances, and the place of the worst one.

Rule for the next editor: measuring and judging stay apart. A `Measurement` holds numbers, their tolerances and the
reasons of those, so that one that was stored can be judged again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Literal

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import clean, refuse


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

    Raises
    ------
    MisuseError
        If the name or the unit is too long or cannot be shown.
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
        The place in words, such as a row and a column of the tangent.
    found, right : tuple[float, ...]
        The numbers at that place, as many of both; empty where the place says it all.
    unit : str
        The unit of both.
    found_name, right_name : str
        What the numbers are, in a word: `force` and `exact`.
    remark : str
        Anything else about the place.

    Raises
    ------
    ValueError
        If not as many numbers are found as are right.
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

    Raises
    ------
    ValueError
        If a quantity is measured twice.
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
