"""Exact motions: a state of coordinates with few bits is turned by a Pythagorean triple and shifted without rounding.

Rule for the next editor: nothing is rounded on the way. What arrives is the exact image of what was there, so that the
forces of the image are the exact image of the forces. `contactverif.problems.stability_states` makes such states.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case


@dataclass(frozen=True, slots=True, eq=False)
class ExactMotion:
    """A rotation by a Pythagorean triple, and a translation behind it.

    Attributes
    ----------
    legs : FloatArray, shape (2,)
        The legs (a, b) of the triple: the rotation has cos = a/c and sin = b/c.
    shift : FloatArray, shape (2,)
        The translation, a length each.
    """

    legs: FloatArray
    shift: FloatArray

    @classmethod
    def from_case(cls, case: Case) -> ExactMotion:
        """Return the motion that the parameters "turn" and "shift" of a case describe."""
        return cls(case.parameters["turn"], case.parameters["shift"])

    @property
    def _hypotenuse(self) -> float:
        return float(np.hypot(*self.legs))

    @property
    def _matrix(self) -> FloatArray:
        a, b = self.legs
        return np.array([[a, -b], [b, a]])

    def move(self, positions: FloatArray) -> FloatArray:
        """Return the positions (n, 2) after the motion, exact for multiples of the triple's hypotenuse."""
        return (positions / self._hypotenuse) @ self._matrix.T + self.shift

    def turn(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (n, 2) after the rotation, each component rounded like a sum of two products."""
        turned: FloatArray = (vectors @ self._matrix.T) / self._hypotenuse
        return turned

    def turn_back(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (n, 2) before the rotation."""
        turned: FloatArray = (vectors @ self._matrix) / self._hypotenuse
        return turned
