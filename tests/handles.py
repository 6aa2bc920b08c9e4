"""Formulations whose pairing is an object: right ones, and one that hides real numbers in it."""

import contactverif_nts
from contactverif import Handle


class Handled:
    """A formulation (by default VTS-PPT) whose pairing is a handle, as it is for a library with sets of its own."""

    def __init__(self, *, penalty, make=contactverif_nts.vts_ppt):
        self._inner = make(penalty=penalty)
        self.traits = self._inner.traits
        if hasattr(self._inner, "n_multipliers"):
            self.n_multipliers = self._inner.n_multipliers

    def put(self, pairing, interface, z):
        """Return what the handle of a pairing holds."""
        return pairing

    def get(self, pairing):
        """Return the pairing that a handle holds."""
        return pairing.handle

    def pair(self, interface, z):
        return {"set": Handle(self.put(self._inner.pair(interface, z), interface, z))}

    def residual(self, interface, pairing, z):
        return self._inner.residual(interface, self.get(pairing), z)

    def tangent(self, interface, pairing, z):
        return self._inner.tangent(interface, self.get(pairing), z)

    def contact_points(self, interface, pairing, z):
        return self._inner.contact_points(interface, self.get(pairing), z)


class HidesNumbers(Handled):
    """The handle holds the forces themselves: they do not change on a frozen pairing, where the tangent 0 is right.

    The residual is right at every state with its own pairing.
    """

    def put(self, pairing, interface, z):
        return pairing, self._inner.residual(interface, pairing, z)

    def get(self, pairing):
        return pairing.handle[0]

    def residual(self, interface, pairing, z):
        return pairing.handle[1].astype(z.dtype)

    def tangent(self, interface, pairing, z):
        return 0.0 * super().tangent(interface, pairing, z)


class ReusesItsHandle(Handled):
    """One object for all states, as a library has that keeps its last set: an earlier pairing changes with the next."""

    def put(self, pairing, interface, z):
        vars(self).setdefault("_last", [None])[0] = pairing
        return self._last

    def get(self, pairing):
        return pairing.handle[0]


class WrongTangent(Handled):
    """A right residual, and a tangent in which every second row is 1 % too small."""

    def tangent(self, interface, pairing, z):
        matrix = super().tangent(interface, pairing, z).toarray()
        matrix[::2] *= 0.99
        return matrix
