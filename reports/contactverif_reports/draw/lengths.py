"""Numbers as a person writes them beside a drawing: 3/2, 0.5, 3·2^-40."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import numpy as np

from contactverif.contract.arrays import FloatArray

_LARGEST_DENOMINATOR = 64


def format_number(value: float, slack: float = 0.0, digits: int = 4) -> str:
    """Return the shortest text for a number: an integer, a decimal, a fraction or an integer times 2^k."""
    if not math.isfinite(value):
        return "–"
    slack = min(slack, 1e-6 * abs(value))
    texts = [text for text, number in _candidates(value, digits) if abs(number - value) <= slack]
    return min(texts, key=len, default=_decimal(value, digits))


def one_digit(value: float) -> float:
    """Round to one significant digit."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{round(value / power) * power:.3g}")


def unit_of(lengths: FloatArray) -> tuple[float, str]:
    """Return a power of two as unit of the lengths, and its name; 1 and no name if they are of everyday size."""
    shortest, longest = float(np.min(lengths)), float(np.max(lengths))
    if longest >= 1e-3 and shortest < 1e5:
        return 1.0, ""
    exponent = math.floor(math.log2(shortest))
    return math.ldexp(1.0, exponent), f"2^{exponent}"


def _candidates(value: float, digits: int) -> list[tuple[str, float]]:
    """Return short texts near a number, each with the number that it says."""
    candidates = []
    if abs(value) < 1e6:
        fraction = Fraction(value).limit_denominator(_LARGEST_DENOMINATOR)
        candidates += [(f"{round(value)}", float(round(value))), (str(fraction), float(fraction))]
    candidates += [(text, float(text)) for text in (_decimal(value, count) for count in range(1, digits + 1))]
    if value:
        significand, exponent = math.frexp(value)
        odd, power = round(significand * 1024), exponent - 10
        while odd and odd % 2 == 0:
            odd, power = odd // 2, power + 1
        if abs(power) > 3:
            times = {1: "", -1: "-"}.get(odd, f"{odd}·")
            candidates += [(f"{times}2^{power}", _times(odd, power))]
    return candidates


def _decimal(value: float, digits: int) -> str:
    """Return a number with so many digits, and a plain exponent: 1e-5, 1e6."""
    return re.sub(r"e([+-])0*", lambda match: "e" + match[1].strip("+"), f"{value:.{digits}g}")


def _times(odd: int, power: int) -> float:
    try:
        return math.ldexp(odd, power)
    except OverflowError:
        return math.inf
