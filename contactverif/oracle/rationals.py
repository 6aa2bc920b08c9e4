"""Floats as the rationals that they are: integers over one power of two."""

from __future__ import annotations

from contactverif.contract.arrays import FloatArray


def integers(values: FloatArray) -> tuple[list[int], int]:
    """Integers and one power of two: value = integer / scale, exactly."""
    ratios = [value.as_integer_ratio() for value in values.reshape(-1).tolist()]
    scale = max(denominator for _, denominator in ratios)
    return [numerator * (scale // denominator) for numerator, denominator in ratios], scale
