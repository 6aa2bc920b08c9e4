"""Formulations whose pairing is an object: right ones, and one that hides real numbers in it."""

from collections.abc import Callable
from typing import Any

import contactverif_nts
from contactverif.contract.formulation import Handle


class Handled:
    """A formulation (by default VTS-PPT) whose pairing is a handle, as it is for a library with sets of its own."""

    def __init__(self, *, penalty: float, make: Callable[..., Any] = contactverif_nts.vts_ppt) -> None:
        self._inner = make(penalty=penalty)
        self.traits = self._inner.traits
        if hasattr(self._inner, "n_multipliers"):
            self.n_multipliers = self._inner.n_multipliers

    def pair(self, interface: Any, z: Any) -> Any:
        return {"set": Handle(self._inner.pair(interface, z))}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.residual(interface, pairing.handle, z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.tangent(interface, pairing.handle, z)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.contact_points(interface, pairing.handle, z)


class HidesNumbers(Handled):
    """The handle holds the forces themselves: they do not change on a frozen pairing, where the tangent 0 is right.

    The residual is right at every state with its own pairing.
    """

    def pair(self, interface: Any, z: Any) -> Any:
        pairing = self._inner.pair(interface, z)
        return {"set": Handle((pairing, self._inner.residual(interface, pairing, z)))}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return pairing.handle[1].astype(z.dtype)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return 0.0 * self._inner.tangent(interface, pairing.handle[0], z)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.contact_points(interface, pairing.handle[0], z)


class ReusesItsHandle(Handled):
    """One object for all states, as a library has that keeps its last set: an earlier pairing changes with the next."""

    def __init__(self, *, penalty: float) -> None:
        super().__init__(penalty=penalty)
        self._last: list[Any] = [None]

    def pair(self, interface: Any, z: Any) -> Any:
        pairing = self._inner.pair(interface, z)
        self._last[0] = pairing
        return {"set": Handle(self._last)}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.residual(interface, pairing.handle[0], z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.tangent(interface, pairing.handle[0], z)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.contact_points(interface, pairing.handle[0], z)


class WrongTangent(Handled):
    """A right residual, and a tangent in which every second row is 1 % too small."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        matrix = super().tangent(interface, pairing, z).toarray()
        matrix[::2] *= 0.99
        return matrix
