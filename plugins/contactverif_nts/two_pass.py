"""Two passes: any one-pass formulation, once with the roles as they are and once exchanged, summed.

The second pass asks the formulation about `interface.swap_roles()`. Both get the same penalty, so that it acts twice:
springs share a pressure between the passes, and penetrate half as much. Multipliers of the first pass come first in z.
Exchanging the roles of the surfaces changes nothing. What the formulation does not provide, two passes of it do not.

Source: Zavarise & De Lorenzis (2009), Sections 1 and 5, after Taylor & Papadopoulos' two-pass node-to-segment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Pairing, Traits
from contactverif.contract.interface import Interface
from contactverif.contract.subject import Subject

NAMES = ("pass_1.", "pass_2.")  # before the names of a pairing


@dataclass(frozen=True, slots=True, eq=False)
class Pass:
    """One of the two.

    Attributes
    ----------
    interface : Interface
        With the roles that it has here.
    places : IntArray, shape (n_unknowns + n_multipliers of this pass,)
        Where its unknowns are in z.
    name : str
        Before the names of its pairing.
    """

    interface: Interface
    places: IntArray
    name: str

    def part(self, pairing: Pairing | None) -> Pairing | None:
        """Its own part of the pairing of both."""
        if pairing is None:
            return None
        own = {name.removeprefix(self.name): values for name, values in pairing.items() if name.startswith(self.name)}
        return Pairing(own)


class TwoPass:
    """A formulation in two passes; `pair`, `tangent` and `contact_points` are None where it has none itself."""

    def __init__(self, inner: Subject, penalty: float) -> None:
        self._inner = inner.with_penalty(penalty)
        self._known: tuple[Interface, tuple[Pass, Pass]] | None = None
        self.traits = _traits(inner.traits)
        self.pair = self._pair if "pair" in inner.provides else None
        self.tangent = self._tangent if "tangent" in inner.provides else None
        self.contact_points = self._contact_points if "contact_points" in inner.provides else None

    def n_multipliers(self, interface: Interface, /) -> int:
        """Those of the first pass, and those of the second; 0 where a penalty takes their place."""
        return sum(len(one.places) - interface.n_unknowns for one in self._passes(interface))

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array, /) -> Array:
        """Forces (..., n_unknowns) of both passes, summed; behind them constraints of the first, then of the second."""
        total = np.zeros_like(z)
        for one in self._passes(interface):
            total[..., one.places] += self._inner.residual(one.interface, one.part(pairing), z[..., one.places])
        return total

    def _pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Both pairings, names with that of the pass before them."""
        found = {}
        for one in self._passes(interface):
            own = self._inner.pair(one.interface, z[one.places])
            assert own is not None
            found.update({one.name + name: values for name, values in own.items()})
        return Pairing(found)

    def _tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray, /) -> sparse.coo_array:
        """The sum of both tangents, sparse."""
        parts = []
        for one in self._passes(interface):
            part = sparse.coo_array(self._inner.tangent(one.interface, one.part(pairing), z[one.places]))
            parts.append((part.data, one.places[part.row], one.places[part.col]))
        values, rows, columns = (np.concatenate(both) for both in zip(*parts, strict=True))
        return sparse.coo_array((values, (rows, columns)), shape=(z.size, z.size))

    def _contact_points(self, interface: Interface, pairing: Pairing | None, z: FloatArray, /) -> ContactPoints:
        """The points of both passes, each with the gap, area and pressure of its own pass.

        Those of the second lie on the master: `slave_segment` is −1, `c` and its area's ends are NaN, and
        `master_segment`, `xi` and `position` say where; the normal is that out of the slave, turned round. The forces
        pressure × weight of both add up.
        """
        first, second = (
            self._inner.contact_points(one.interface, one.part(pairing), z[one.places])
            for one in self._passes(interface)
        )
        meaningless = np.full_like(second.c, np.nan)
        on_master = replace(
            second,
            slave_segment=np.full_like(second.slave_segment, -1),
            master_segment=second.slave_segment,
            xi=(1 + second.c) / 2,
            normal=-second.normal,
            c=meaningless,
            area_from=meaningless,
            area_to=meaningless,
        )
        names = [entry.name for entry in fields(ContactPoints)]
        return ContactPoints(
            **{name: np.concatenate([getattr(first, name), getattr(on_master, name)]) for name in names}
        )

    def _passes(self, interface: Interface) -> tuple[Pass, Pass]:
        """The first and the second pass; kept, since to exchange the roles costs far more than a residual."""
        if self._known is None or self._known[0] is not interface:
            self._known = interface, self._new_passes(interface)
        return self._known[1]

    def _new_passes(self, interface: Interface) -> tuple[Pass, Pass]:
        swapped, positions = interface.swap_roles(), np.arange(interface.n_unknowns)
        there = interface.dim * interface.n_slave_nodes
        first, second = (self._inner.n_multipliers(side) for side in (interface, swapped))
        multipliers = interface.n_unknowns + np.arange(first + second)
        return (
            Pass(interface, np.concatenate([positions, multipliers[:first]]), NAMES[0]),
            Pass(swapped, np.concatenate([np.roll(positions, -there), multipliers[first:]]), NAMES[1]),
        )


def two_pass(*, penalty: float, inner: Callable[..., Any]) -> TwoPass:
    """Two passes of a formulation.

    Parameters
    ----------
    penalty : float
        Of both passes, in the formulation's own kind.
    inner : Callable[..., Any]
        Factory `make(*, penalty)` of the formulation.
    """
    return TwoPass(Subject("inner", inner), penalty)


def _traits(inner: Traits) -> Traits:
    """What two passes promise, of what one does.

    With a penalty a penetration gives twice the pressure that it should (and where one pass is wrong, the other does
    not make it right). With nodal multipliers gaps vanish at the nodes of both surfaces; where force and moment
    balance, a node's force is spread over the segment that it meets by the lever rule; and the exact forces of a
    uniform pressure are among such, an overhang or not: those of trapezoids between neighbours in the union of the
    nodes that face a segment.
    """
    passes, independent = None, None
    witnesses = {part: name for part, name in inner.witnesses.items() if not part.startswith(("patch", "multipliers"))}
    if inner.enforcement == "penalty" and inner.passes_flat_patch is not None:
        passes, witnesses["patch"] = False, "a1"
    elif inner.enforcement == "multiplier":
        independent = False  # of two nodes in one place each would have a multiplier for one gap
        witnesses["multipliers"] = "a1"
        if inner.penalty == "nodal" and inner.conserves_force and inner.conserves_moment:
            passes = True
    return replace(
        inner,
        passes_flat_patch=passes,
        covers_overhang=passes,
        area=None,
        independent_multipliers=independent,
        batched=True,
        witnesses=witnesses,
        source=f"two passes of: {inner.source}" if inner.source else "",
    )
