"""Numbers that carry their gradient, so that a kernel differentiates itself: forward automatic differentiation."""

from __future__ import annotations

from typing import Any

import numpy as np


class Dual:
    """An array of values (…) with gradients (…, n)."""

    def __init__(self, value: Any, slope: Any) -> None:
        self.value, self.slope = value, slope

    def __add__(self, other: Any) -> Dual:
        other = as_dual(other)
        return Dual(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Any) -> Dual:
        other = as_dual(other)
        return Dual(self.value - other.value, self.slope - other.slope)

    def __rsub__(self, other: Any) -> Dual:
        return Dual(other - self.value, -self.slope)

    def __mul__(self, other: Any) -> Dual:
        other = as_dual(other)
        slope = np.asarray(self.value)[..., None] * other.slope + np.asarray(other.value)[..., None] * self.slope
        return Dual(self.value * other.value, slope)

    def __truediv__(self, other: Dual) -> Dual:
        quotient = self.value / other.value
        return Dual(quotient, (self.slope - quotient[..., None] * other.slope) / other.value[..., None])

    __radd__, __rmul__ = __add__, __mul__


def as_dual(number: Any) -> Dual:
    return number if isinstance(number, Dual) else Dual(number, np.zeros(1))


def root(number: Any) -> Any:
    """Return the square root of a dual number or an array."""
    if not isinstance(number, Dual):
        return np.sqrt(number)
    value = np.sqrt(number.value)
    return Dual(value, number.slope / (2 * value[..., None]))
