"""Two passes: the sum of any one-pass formulation and the same formulation with slave and master exchanged.

The second pass asks the formulation about `interface.swap_roles()`. Both passes get the same penalty, so it acts twice:
springs share a pressure between the passes and penetrate half as much. In z the multipliers of the first pass come
first. Two passes provide what the formulation provides, no more and no less.

What must stay true: exchanging the roles of the surfaces changes no force, not even in the last bit.

Source: Zavarise & De Lorenzis (2009), Sections 1 and 5, after Taylor & Papadopoulos' two-pass node-to-segment.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import scipy

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Handle, Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits, format_forces, parse_forces

NAMES = ("pass_1.", "pass_2.")  # The prefixes of the names in a pairing.
_EXCHANGED = "-swapped"  # The end of the name of a flat case whose slave and master have exchanged their lengths.


@dataclass(frozen=True, slots=True, eq=False)
class Pass:
    """One of the two passes."""

    interface: Interface  # The interface with the roles of this pass.
    # (n_unknowns + n_multipliers,) Where the unknowns of this pass are in z; only its own multipliers count.
    places: IntArray
    name: str  # The prefix of its names in a pairing.

    def part(self, pairing: Pairing | None) -> Pairing | None:
        """Return the part of a pairing of both passes that belongs to this one."""
        if pairing is None or pairing.opaque:  # Each pass decides anew.
            return None
        arrays = {name.removeprefix(self.name): array for name, array in pairing.items() if name.startswith(self.name)}
        return Pairing(arrays)


class TwoPass:
    """A formulation in two passes; `pair`, `tangent` and `contact_points` are None where the formulation has none."""

    def __init__(self, inner: Subject, penalty: float) -> None:
        self._inner = inner.with_penalty(penalty)
        self._last_passes: tuple[Interface, tuple[Pass, Pass]] | None = None
        self.traits = _traits(inner.traits)
        self.pair = self._pair if "pair" in inner.provides else None
        self.tangent = self._tangent if "tangent" in inner.provides else None
        self.contact_points = self._contact_points if "contact_points" in inner.provides else None

    def n_multipliers(self, interface: Interface, /) -> int:
        """Return the number of multipliers of both passes, 0 for a penalty."""
        return sum(len(each.places) - interface.n_unknowns for each in self._passes(interface))

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array, /) -> Array:
        """Compute the sum of the forces of both passes, then the constraints of the first and of the second pass."""
        total = np.zeros_like(z)
        for each in self._passes(interface):
            total[..., each.places] += self._inner.residual(each.interface, each.part(pairing), z[..., each.places])
        return total

    def _pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the pairings of both passes; each name carries the prefix of its pass. A handle stays with its pass."""
        arrays: dict[str, Any] = {}
        for each in self._passes(interface):
            pairing = self._inner.pair(each.interface, z[each.places])
            if pairing is None:
                return Pairing({"of both passes": Handle(None)})
            arrays.update({each.name + name: array for name, array in pairing.items()})
        return Pairing(arrays)

    def _tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray, /) -> scipy.sparse.coo_array:
        parts = []
        for each in self._passes(interface):
            part = scipy.sparse.coo_array(self._inner.tangent(each.interface, each.part(pairing), z[each.places]))
            parts.append((part.data, each.places[part.row], each.places[part.col]))
        values, rows, columns = (np.concatenate(both) for both in zip(*parts, strict=True))
        return scipy.sparse.coo_array((values, (rows, columns)), shape=(z.size, z.size))

    def _contact_points(self, interface: Interface, pairing: Pairing | None, z: FloatArray, /) -> ContactPoints:
        """Return the points of both passes, the second with exchanged roles (`on_master`); their forces add up."""
        first, second = (
            self._inner.contact_points(each.interface, each.part(pairing), z[each.places])
            for each in self._passes(interface)
        )
        second = replace(second, on_master=~second.on_master)
        names = [entry.name for entry in fields(ContactPoints) if getattr(first, entry.name) is not None]
        return ContactPoints(**{name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in names})

    def _passes(self, interface: Interface) -> tuple[Pass, Pass]:
        """Return both passes. The last ones are kept, because exchanging the roles costs far more than a residual."""
        if self._last_passes is None or self._last_passes[0] is not interface:
            swapped, positions = interface.swap_roles(), np.arange(interface.n_unknowns)
            swapped_positions = np.roll(positions, -interface.dim * interface.n_slave_nodes)
            first, second = (self._inner.n_multipliers(side) for side in (interface, swapped))
            multipliers = interface.n_unknowns + np.arange(first + second)
            first_pass = Pass(interface, np.concatenate([positions, multipliers[:first]]), NAMES[0])
            second_pass = Pass(swapped, np.concatenate([swapped_positions, multipliers[first:]]), NAMES[1])
            self._last_passes = interface, (first_pass, second_pass)
        return self._last_passes[1]


def two_pass(*, penalty: float, inner: Callable[..., Any]) -> TwoPass:
    """Two passes of a formulation: the formulation, plus the same with slave and master exchanged.

    With a penalty two passes fail the flat patch test (case A1): springs on both sides give twice the pressure. With
    nodal multipliers that balance force and moment they pass it. All other promises are those of the formulation.

    Source: Zavarise & De Lorenzis (2009), Sections 1 and 5.
    """
    return TwoPass(Subject("inner", inner), penalty)


def _traits(inner: Traits) -> Traits:
    """Return what two passes promise, from what one pass promises.

    With a penalty, a penetration gives twice the pressure that it should, and where one pass is wrong, the other does
    not make it right. Where each pass is exact on a kink, so are both, and nothing is stated of what stiff springs do
    there. Springs twice as stiff as the penalty leave an error that falls as h alone. With nodal multipliers all gaps
    vanish at the nodes of both surfaces. Where force and moment balance, the force of a node is spread over the segment
    that it meets by the lever rule. The exact forces of a uniform pressure are such forces, with an overhang or
    without: they are those of trapezoids between neighbours in the union of the nodes that face a segment.
    """
    passes, kinked, independent, converges, inf_sup, locks = None, None, None, None, None, None
    # In the second pass nodes of the master enter past the ends of the slave. A formulation that does not cover an
    # overhang counts such a node at once, so that its force jumps.
    continuity = inner.promises.continuity
    if continuity != "jumps" and not inner.promises.patch.overhang:
        continuity = None
    witnesses = {
        part: name for part, name in inner.evidence.witnesses.items() if not part.startswith(("patch", "multipliers"))
    }
    if inner.rules.enforcement == "penalty" and inner.promises.locks is not None:
        locks = True  # Each pass forces the nodes of one surface onto the other.
        witnesses["stability.locking"] = "12 on 8, ε̂ = 1e8 E/h"
    if inner.rules.enforcement == "penalty" and inner.promises.converges is not None:
        converges = False
        witnesses |= dict.fromkeys(("accuracy.wavy", "accuracy.wavy-curved"), "upper slave, 10 E/h")
        witnesses["accuracy.hertz"] = "parabola-layer"
    if inner.rules.enforcement == "penalty" and inner.promises.patch.flat is not None:
        passes, witnesses["patch"] = False, "a1" if inner.abilities.in_plane else "crossed-diagonals"
        kinked = False if inner.promises.patch.kinked is False else None
        witnesses["patch.kinked"] = "edge of 53°, lower slave"
    elif inner.rules.enforcement == "multiplier":
        independent = inf_sup = False  # two nodes in one place have two multipliers for one gap
        witnesses |= {"multipliers": "a1", "stability.inf-sup": "matching"}
        if inner.rules.penalty == "nodal" and inner.promises.conserves_force and inner.promises.conserves_moment:
            passes = kinked = True
    # The second pass of a formulation that prefers no side reports each of its points once more, so that no length is
    # stated that weights add up to.
    penalty = inner.rules.penalty
    if inner.promises.unbiased and penalty == "distributed":
        penalty = None
    return inner.revise(
        penalty=penalty,
        flat=passes,
        normal=passes if passes or inner.promises.patch.normal is not None else None,
        single=passes if passes or inner.promises.patch.single is not None else None,
        kinked=kinked,
        overhang=passes,
        continuity=continuity,
        converges=converges,
        inf_sup=inf_sup,
        locks=locks,
        area=None,
        integrates_linear_gap=None,
        force_along=None,
        independent_multipliers=independent,
        unbiased=True,
        batched=True,
        witnesses=witnesses,
        published_forces=_add_exchanged(inner.evidence.published_forces),
        source=f"two passes of: {inner.evidence.source}" if inner.evidence.source else "",
    )


def _add_exchanged(forces: Mapping[str, str]) -> dict[str, str]:
    """Return the forces of two passes, wherever those of one pass are known on a case and with its roles exchanged.

    Two passes on case B add up what one pass makes of B and of B with the lengths of slave and master exchanged. There
    the slave's forces are those on the master of B.
    """
    both = {}
    for name, text in forces.items():
        other = name.removesuffix(_EXCHANGED) if name.endswith(_EXCHANGED) else name + _EXCHANGED
        if other in forces:
            passes = zip(parse_forces(text), reversed(parse_forces(forces[other])), strict=True)
            slave, master = (tuple(a + b for a, b in zip(*sides, strict=True)) for sides in passes)
            both[name] = format_forces(slave, master)
    return both
