"""Numbers as one would write them beside a drawing by hand: 3/2, 0.5, 3·2^-40."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import numpy as np

from contactverif.contract.arrays import FloatArray

_LARGEST_DENOMINATOR = 64


def format_number(value: float, slack: float = 0.0, digits: int = 4) -> str:
    """The shortest text within `slack` of the value: an integer, a decimal, a fraction or an integer times 2^k.

    Where there is none, `digits` significant digits.
    """
    if not math.isfinite(value):
        return "–"
    slack = min(slack, 1e-6 * abs(value))
    found = [text for text, number in _candidates(value, digits) if abs(number - value) <= slack]
    return min(found, key=len, default=_decimal(value, digits))


def unit_of(lengths: FloatArray) -> tuple[float, str]:
    """A power of two to measure the lengths in, and its name; 1 and nothing where they are of everyday size."""
    shortest, longest = float(np.min(lengths)), float(np.max(lengths))
    if longest >= 1e-3 and shortest < 1e5:
        return 1.0, ""
    exponent = math.floor(math.log2(shortest))
    return math.ldexp(1.0, exponent), f"2^{exponent}"


def _candidates(value: float, digits: int) -> list[tuple[str, float]]:
    found = []
    if abs(value) < 1e6:
        found += [(f"{round(value)}", float(round(value)))]
        fraction = Fraction(value).limit_denominator(_LARGEST_DENOMINATOR)
        found += [(str(fraction), float(fraction))]
    found += [(text, float(text)) for text in (_decimal(value, count) for count in range(1, digits + 1))]
    if value:
        significand, exponent = math.frexp(value)
        odd, power = round(significand * 1024), exponent - 10
        while odd and odd % 2 == 0:
            odd, power = odd // 2, power + 1
        if abs(power) > 3:
            times = {1: "", -1: "-"}.get(odd, f"{odd}·")
            found += [(f"{times}2^{power}", _times(odd, power))]
    return found


def _decimal(value: float, digits: int) -> str:
    """`%g` with the exponent as one writes it: 1e-5, 1e6."""
    return re.sub(r"e([+-])0*", lambda match: "e" + match[1].strip("+"), f"{value:.{digits}g}")


def _times(odd: int, power: int) -> float:
    try:
        return math.ldexp(odd, power)
    except OverflowError:
        return math.inf
