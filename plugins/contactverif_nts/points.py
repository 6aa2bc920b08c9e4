"""NTS, NTS-AR, VTS-G and VTS-ME: a list of points, each held by Eq. 6. A method here is where its points are.

| method | points | area of a point |
|---|---|---|
| NTS | slave nodes | 1 (nodal penalty) |
| NTS-AR | slave nodes | half of each adjacent slave segment |
| VTS-G(n) | n Gauss points a slave segment | w l_AB / 2 |
| VTS-ME(n) | c_k = −1 + (2k+1)/n | l_AB / n |
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray, freeze
from contactverif.contract.formulation import ContactPoints, Pairing, Traits
from contactverif.contract.interface import Interface
from contactverif.contract.state_vector import join_rows, split_state, split_states
from contactverif.geometry.projection import search_tree
from contactverif_nts import eq6
from contactverif_nts.options import AREAS, check_count, check_free_end, check_penalty, chosen

_PAPER = "Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416"


@dataclass(frozen=True, slots=True, eq=False)
class PointContact:
    """Points on slave segments, each against its nearest master segment.

    Attributes
    ----------
    c, weight : FloatArray, shape (n_slots,)
        Places on a slave segment in [−1, 1], and their shares of its length.
    penalty : float
        Stiffness; with multipliers (trait `enforcement`) the scale c of the decision λ − c g ≥ 0.
    at_nodes : bool
        The points are the slave nodes, each once: slot 0 begins its segment, slot 1 ends it.
    area_from : int
        Eq6.NODAL, CURRENT or REFERENCE.
    free_end : float
        Τ, how far past a free end of the master a foot still counts, in lengths of the segment.
    """

    traits: Traits
    penalty: float
    c: FloatArray
    weight: FloatArray
    at_nodes: bool
    area_from: int
    free_end: float

    def n_multipliers(self, interface: Interface, /) -> int:
        """One for each point, in their order; none where a penalty holds them."""
        return len(self._points(interface)[0]) if self.traits.enforcement == "multiplier" else 0

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """The nearest master segment of each point, and whether it is in contact."""
        x, multipliers = split_state(interface, z)
        segment, other, slot = self._points(interface)
        partner, active = eq6.pair(
            x,
            interface.slave.segments,
            interface.master.segments,
            interface.master.neighbours,
            *search_tree(interface.master, x),
            segment,
            slot,
            self.c,
            self.free_end,
            multipliers,
            self.penalty,
        )
        return Pairing({"segment": segment, "other": other, "slot": slot, "master": partner, "active": active})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Forces (..., n_unknowns), Eq. 6 summed over the points; behind them the constraints of multipliers."""
        return join_rows(*eq6.residual(*split_states(interface, z), *self._arguments(interface, pairing)), z)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.coo_array:
        """The exact derivative of the residual, sparse."""
        rows, columns, values = eq6.tangent(*split_state(interface, z), *self._arguments(interface, pairing))
        return sparse.coo_array((values, (rows, columns)), shape=(z.size, z.size))

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Each point, with its gap and pressure; areas of competence end at the middle of a segment or share it out."""
        x, multipliers = split_state(interface, z)
        ends = x[interface.slave.segments[pairing["segment"]]]  # (n_points, 2, dim)
        c = self.c[pairing["slot"]]
        position = (1 - c[:, None]) / 2 * ends[:, 0] + (1 + c[:, None]) / 2 * ends[:, 1]
        x1, x2 = np.swapaxes(x[interface.master.segments[pairing["master"]]], 0, 1)
        length = np.linalg.norm(x2 - x1, axis=1)
        t = (x2 - x1) / length[:, None]
        normal = np.column_stack([t[:, 1], -t[:, 0]])
        gap = ((position - x1) * normal).sum(axis=1)
        measured = interface.nodes if self.area_from == eq6.REFERENCE else x
        lengths = np.append(interface.slave.lengths(measured), 0.0)  # the last is that of no segment, −1
        weight = self.weight[pairing["slot"]] * (lengths[pairing["segment"]] + lengths[pairing["other"]])
        if self.area_from == eq6.NODAL:
            weight = np.ones_like(gap)
        pressure = multipliers if len(multipliers) else -self.penalty * gap
        nowhere = np.full_like(gap, np.nan)  # no decision hangs on where an area of competence ends
        return ContactPoints(
            slave_segment=pairing["segment"],
            c=c,
            master_segment=pairing["master"],
            xi=((position - x1) * t).sum(axis=1) / length,
            position=position,
            normal=normal,
            gap=gap,
            pressure=np.where(pairing["active"], pressure, 0.0),
            weight=weight,
            active=pairing["active"],
            area_from=nowhere,
            area_to=nowhere,
        )

    def _points(self, interface: Interface) -> tuple[IntArray, IntArray, IntArray]:
        """Slave segment, other slave segment at a slave node (−1 none) and slot of each point."""
        slave = interface.slave
        if not self.at_nodes:
            segment = np.repeat(np.arange(len(slave)), len(self.c))
            return segment, np.full_like(segment, -1), np.tile(np.arange(len(self.c)), len(slave))
        last = np.flatnonzero(slave.neighbours[:, 1] < 0)  # the only segments whose second node begins no segment
        segment = np.concatenate([np.arange(len(slave)), last])
        slot = np.concatenate([np.zeros(len(slave), np.int64), np.ones(len(last), np.int64)])
        other = np.concatenate([slave.neighbours[:, 0], np.full_like(last, -1)])
        return segment, other, slot

    def _arguments(self, interface: Interface, pairing: Pairing) -> tuple[Any, ...]:
        return (
            interface.nodes,
            interface.slave.segments,
            interface.master.segments,
            pairing["segment"],
            pairing["other"],
            pairing["slot"],
            pairing["master"],
            pairing["active"],
            self.c,
            self.weight,
            self.area_from,
            self.penalty,
        )


def nts(*, penalty: float, tau: float = 1e-2) -> PointContact:
    """Node to segment: a spring at each slave node.

    Parameters
    ----------
    penalty : float
        Nodal stiffness ε > 0, force per length.
    tau : float
        How far past a free end of the master a foot still counts, in lengths of its segment.
    """
    traits = _traits(False, "a1", "nodal", None, symmetric=True)
    return _points_at([-1.0, 1.0], [0.5, 0.5], traits, penalty, tau, eq6.NODAL, at_nodes=True)


def nts_ar(*, penalty: float, area: str = "current", tau: float = 1e-2) -> PointContact:
    """Node to segment with area regularisation: each slave node has the springs of its area of competence.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per length per length of penetration.
    area : str
        "current" or "reference", where lengths are measured.
    tau : float
        How far past a free end of the master a foot still counts, in lengths of its segment.
    """
    area_from = chosen("area", area, AREAS)
    traits = _traits(False, "b", "distributed", area_from)
    return _points_at([-1.0, 1.0], [0.5, 0.5], traits, penalty, tau, area_from, at_nodes=True)


def vts_g(*, penalty: float, n: int = 2, area: str = "current", tau: float = 1e-2) -> PointContact:
    """Virtual slave nodes at the n Gauss points of each slave segment.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per length per length of penetration.
    n : int
        Number of Gauss points a slave segment, ≥ 1.
    area : str
        "current" or "reference", where lengths are measured.
    tau : float
        How far past a free end of the master a foot still counts, in lengths of its segment.
    """
    c, weights = np.polynomial.legendre.leggauss(check_count(n))
    area_from = chosen("area", area, AREAS)
    traits = _traits(False, "b", "distributed", area_from)
    return _points_at(c, weights / 2, traits, penalty, tau, area_from)


def vts_me(*, penalty: float, n: int = 2, area: str = "current", tau: float = 1e-2) -> PointContact:
    """Virtual slave nodes in the middle of n equal parts of each slave segment: moments balance on one master segment.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per length per length of penetration.
    n : int
        Number of virtual slave nodes a slave segment, ≥ 1; 2 are the quarter points.
    area : str
        "current" or "reference", where lengths are measured.
    tau : float
        How far past a free end of the master a foot still counts, in lengths of its segment.
    """
    n = check_count(n)
    area_from = chosen("area", area, AREAS)
    c = -1 + (2 * np.arange(n) + 1) / n
    traits = _traits(False, "c-prime", "distributed", area_from)
    return _points_at(c, np.full(n, 1 / n), traits, penalty, tau, area_from)


def _traits(passes: bool, witness: str, penalty: str, area_from: int | None, symmetric: bool | None = None) -> Traits:
    areas = {eq6.CURRENT: "current", eq6.REFERENCE: "reference", None: None}
    return Traits(
        passes_flat_patch=passes,
        covers_overhang=False,
        tangent="exact",
        symmetric=area_from == eq6.REFERENCE if symmetric is None else symmetric,
        conserves_force=True,
        conserves_moment=True,
        area=areas[area_from],  # type: ignore[arg-type]
        penalty=penalty,  # type: ignore[arg-type]
        batched=True,
        takes_complex=True,
        witnesses={"patch": witness, "patch.dead-zone": "dead-zone"},
        source=_PAPER,
    )


def _points_at(
    c: ArrayLike, weight: ArrayLike, traits: Traits, penalty: float, tau: float, area_from: int, at_nodes: bool = False
) -> PointContact:
    return PointContact(
        traits,
        check_penalty(penalty),
        freeze(c, np.float64),
        freeze(weight, np.float64),
        at_nodes,
        area_from,
        check_free_end(tau),
    )
