"""Floats as the rationals that they are: integers over one power of two.

Rule for the next editor: no rounding happens here.
"""

from __future__ import annotations

from contactverif.contract.arrays import FloatArray


def integers(values: FloatArray) -> tuple[list[int], int]:
    """Return integers and one power of two, the scale, such that value = integer / scale exactly."""
    ratios = [value.as_integer_ratio() for value in values.reshape(-1).tolist()]
    scale = max(denominator for _, denominator in ratios)
    return [numerator * (scale // denominator) for numerator, denominator in ratios], scale
