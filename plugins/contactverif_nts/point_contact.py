"""NTS, NTS-AR, VTS-G and VTS-ME: points on slave segments, each against its nearest master segment by Eq. 6.

A method of this file is a list of points:

| method | points | area of a point |
|---|---|---|
| NTS | slave nodes | 1 (nodal penalty) |
| NTS-AR | slave nodes | half of each adjacent slave segment |
| VTS-G(n) | n Gauss points on each slave segment | w l_AB / 2 |
| VTS-ME(n) | c_k = −1 + (2k+1)/n on each slave segment | l_AB / n |

Force and moment are conserved by all of them: Eq. 6 spreads a force over 1 and 2 by the lever rule, and V lies on its
line of action. None of them passes the flat patch test on every mesh, and none covers an overhang. The traits name a
case that shows each failure.

Shares are linear along a slave segment as long as no inner master node lies within it. Any rule that is exact for
linear functions then passes the patch test, and all but NTS are. A master node in the middle of a slave segment bends
a share there. VTS-ME with an even n has the same points on both halves, so it is exact there too.

With multipliers λ ≥ 0 each point has a pressure of its own; for NTS it is the force. In z they stand behind the
positions. A point is active where λ − c g ≥ 0 and its foot is on the surface; the factory's penalty is the scale c > 0
of that decision, and no solution depends on it. With n ≥ 2 a segment carries more points than gaps can differ there, so
the multipliers are not unique. NTS has one constraint for each slave node, and those are independent.

Source: Zavarise & De Lorenzis (2009), Sections 4.1, 4.2 and 5.1.2; which methods with multipliers pass the patch test:
Sections 5.1.3, 6 and 7.1.
"""

from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from contactverif.compiler import TAKES_LONGDOUBLE, match_precision
from contactverif.contract.arrays import Array, FloatArray, IntArray, freeze
from contactverif.contract.formulation import ContactPoints, Pairing, check_count, check_penalty, check_tau, choose
from contactverif.contract.interface import Interface, split_state
from contactverif.contract.traits import Abilities, Evidence, PatchPromises, Promises, Rules, Traits, promise_at_ends
from contactverif.geometry.block_rows import Couplings, Fields, zero_matrix
from contactverif.geometry.projection import search_tree
from contactverif_nts import nts_force
from contactverif_nts.nts_force import AREAS

_PAPER = "Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416"
# Up to so many points on a segment, forces are seen not to converge. With 6 to 20, `accuracy.wavy` still sees it on a
# slave four times coarser than the master, but in `accuracy.hertz` the error of the bodies hides theirs.
FEW_POINTS = 5
# The forces that a uniform pressure p = 1 makes on named flat cases, in rationals, as Eq. 6 gives them by hand. A slave
# node has the force of its springs: 1 with nodal springs, the length of its area of competence with distributed ones.
# Each force is shared between the nodes of the master segment below by the lever rule. In a case whose name ends in
# "-swapped" slave and master have exchanged their lengths. The paper prints those of NTS-AR and VTS-ME on the master
# for the cases B and C (Figs. 8, 16 and 20). No kernel may compute this table: the kernels are held to it.
_TABLES = {
    "nts": {
        "a1": "1 1 1; 3/2 3/2",
        "a2": "1 1 1 1 1; 25/8 15/8",
        "b": "1 1 1 1 1; 4/3 4/3 5/6 1/2 1",
        "c": "1 1 1 1 1; 4/3 4/3 2/3 2/3 1",
        "c-prime": "1 1 1 1 1; 4/3 4/3 17/24 5/8 1",
        "a1-swapped": "1 1; 1 0 1",
        "a2-swapped": "1 1; 1 0 0 0 1",
        "b-swapped": "1 1 1 1 1; 1 1/2 1 1 3/2",
        "c-swapped": "1 1 1 1 1; 1 1/2 1 5/4 5/4",
        "c-prime-swapped": "1 1 1 1 1; 1 1/2 1 6/5 13/10",
    },
    "nts-ar": {
        "a1": "1 2 1; 2 2",
        "a2": "1/2 1 3/2 3 2; 4 4",
        "b": "1 2 3 4 2; 5/3 10/3 3 2 2",
        "c": "1 2 3 4 2; 5/3 10/3 7/3 8/3 2",
        "c-prime": "1 2 3 4 2; 5/3 10/3 5/2 5/2 2",
        "a1-swapped": "2 2; 2 0 2",
        "a2-swapped": "4 4; 4 0 0 0 4",
        "b-swapped": "3/2 3 7/2 3 1; 3/2 3/2 13/4 13/4 5/2",
        "c-swapped": "3/2 3 3 3 3/2; 3/2 3/2 3 15/4 9/4",
        "c-prime-swapped": "3/2 3 31/10 3 7/5; 3/2 3/2 61/20 73/20 23/10",
    },
    "vts-me": {
        "a1": "1 2 1; 2 2",
        "a2": "1/2 1 3/2 3 2; 4 4",
        "b": "1 2 3 4 2; 3/2 3 7/2 3 1",
        "c": "1 2 3 4 2; 3/2 3 17/6 10/3 4/3",
        "c-prime": "1 2 3 4 2; 3/2 3 3 45/14 9/7",
        "a1-swapped": "2 2; 1 2 1",
        "a2-swapped": "4 4; 0 0 4 2 2",
        "b-swapped": "3/2 3 7/2 3 1; 15/16 33/16 97/32 127/32 2",
        "c-swapped": "3/2 3 3 3 3/2; 15/16 33/16 3 129/32 63/32",
        "c-prime-swapped": "3/2 3 31/10 3 7/5; 15/16 33/16 2409/800 3207/800 99/50",
    },
}
FORCE_TABLES = {name: MappingProxyType(table) for name, table in _TABLES.items()}
# What all methods promise whose points press on master segments along their normals.
POINT_TRAITS = Traits(
    promises=Promises(
        patch=PatchPromises(flat=False, kinked=False, overhang=False),
        tangent="exact",
        conserves_force=True,
        conserves_moment=True,
        local=True,
        nodes_push=True,
        opens_at_ends=True,
        unbiased=False,
        continuity="jumps",
        translation_stable=True,
    ),
    rules=Rules(gap="closest point", force_along="master normal"),
    abilities=Abilities(batched=True, takes_complex=True, takes_longdouble=TAKES_LONGDOUBLE),
    evidence=Evidence(
        witnesses={"patch.tilted": "tilted", "symmetric": "offset-c", "swap": "tilted", "continuity": "sliding"}
    ),
)


@dataclass(frozen=True, slots=True, eq=False)
class PointContact:
    """A formulation that is a list of points on slave segments."""

    traits: Traits
    penalty: float  # Stiffness; with multipliers (trait `enforcement`) the scale c of the decision λ − c g ≥ 0.
    c: FloatArray  # (n_slots,) Places on a slave segment in [−1, 1], and their shares of its length.
    weight: FloatArray
    at_nodes: bool  # The points are the slave nodes, each once: slot 0 begins its segment, slot 1 ends it.
    area_from: int  # `nts_force.NODAL`, `nts_force.CURRENT` or `nts_force.REFERENCE`.
    tau: float  # The part of a master segment by which a foot may lie past its free end and still count.

    def n_multipliers(self, interface: Interface, /) -> int:
        """Return the number of multipliers: one for each point, in their order, or 0 for a penalty."""
        return len(self._points(interface)[0]) if self.traits.rules.enforcement == "multiplier" else 0

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the nearest master segment of each point, and decide which points are active."""
        state = split_state(interface, z)
        segment, other, slot = self._points(interface)
        tree, surfaces = search_tree(interface.master, state[0]), surfaces_of(interface, interface.nodes)
        points, options = (segment, slot, self.c), (self.tau, self.penalty)
        nearest, active = nts_force.pair(state, surfaces, tree, points, options)
        return Pairing({"segment": segment, "other": other, "slot": slot, "master": nearest, "active": active})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns) of Eq. 6 and, behind them, the constraints of multipliers."""
        return nts_force.residual_of(nts_force.add_residual, interface, z, self._arguments(interface, pairing, z))

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> scipy.sparse.csr_array:
        """Compute the derivative of the residual, sparse."""
        x, multipliers = split_state(interface, z)
        surfaces, points, options = self._arguments(interface, pairing, z)
        first_multiplier = interface.n_nodes if len(multipliers) else -1
        couplings = nts_force.list_couplings(surfaces, points, self.c, self.area_from, first_multiplier)
        matrix = zero_matrix(interface.n_nodes, len(multipliers), Couplings(*couplings))
        csr = matrix.indptr, matrix.indices, matrix.data
        nts_force.add_tangent(csr, x, multipliers, surfaces, points, options)
        return matrix

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the points with their gaps and pressures.

        The ends of areas of competence are NaN: the points stand for areas, but no decision depends on where they end.
        """
        x, multipliers = split_state(interface, z)
        place = place_points(interface, x, pairing["segment"], self.c[pairing["slot"]], pairing["master"])
        gap = place["gap"]
        measured = interface.nodes if self.area_from == nts_force.REFERENCE else x
        lengths = np.append(interface.slave.lengths(measured), 0.0)  # the last one stands for "no segment", −1
        weight = self.weight[pairing["slot"]] * (lengths[pairing["segment"]] + lengths[pairing["other"]])
        if self.area_from == nts_force.NODAL:
            weight = np.ones_like(gap)
        pressure = multipliers if len(multipliers) else -self.penalty * gap
        undefined = np.full_like(gap, np.nan)
        return ContactPoints(
            **place,
            pressure=np.where(pairing["active"], pressure, 0.0),
            weight=weight,
            active=pairing["active"],
            area_from=undefined,
            area_to=undefined,
        )

    def _points(self, interface: Interface) -> tuple[IntArray, IntArray, IntArray]:
        """Return slave segment, other slave segment at a slave node (−1 if there is none) and slot of each point."""
        slave = interface.slave
        if not self.at_nodes:
            segment = np.repeat(np.arange(len(slave)), len(self.c))
            return segment, np.full_like(segment, -1), np.tile(np.arange(len(self.c)), len(slave))
        last = np.flatnonzero(slave.neighbours[:, 1] < 0)  # the only segments whose second node begins no segment
        segment = np.concatenate([np.arange(len(slave)), last])
        slot = np.concatenate([np.zeros(len(slave), np.int64), np.ones(len(last), np.int64)])
        other = np.concatenate([slave.neighbours[:, 0], np.full_like(last, -1)])
        return segment, other, slot

    def _arguments(self, interface: Interface, pairing: Pairing, z: Array) -> tuple[Fields, Fields, Fields]:
        reference, c, weight = match_precision(z, interface.nodes, self.c, self.weight)
        points = tuple([pairing[name] for name in nts_force.Points._fields])
        return surfaces_of(interface, reference), points, (c, weight, self.area_from, self.penalty)


def surfaces_of(interface: Interface, reference: FloatArray) -> Fields:
    """Return the arrays of an interface as kernels unpack them."""
    master = interface.master
    return reference, interface.slave.segments, master.segments, master.neighbours


def place_points(
    interface: Interface, x: FloatArray, segment: IntArray, c: FloatArray, master: IntArray
) -> dict[str, Any]:
    """Return what contact points at c on slave segments see of their master segments, by the names of the fields."""
    ends = x[interface.slave.segments[segment]]  # (n_points, 2, dim)
    x1, x2 = np.swapaxes(x[interface.master.segments[master]], 0, 1)
    length = np.linalg.norm(x2 - x1, axis=1)
    t = (x2 - x1) / length[:, None]
    d = (1 - c[:, None]) / 2 * (ends[:, 0] - x1) + (1 + c[:, None]) / 2 * (ends[:, 1] - x1)  # differences first
    return {
        "slave_segment": segment,
        "c": c,
        "master_segment": master,
        "xi": (d * t).sum(axis=1) / length,
        "position": (1 - c[:, None]) / 2 * ends[:, 0] + (1 + c[:, None]) / 2 * ends[:, 1],
        "normal": np.column_stack([t[:, 1], -t[:, 0]]),
        "gap": (d[:, 0] * (x2 - x1)[:, 1] - d[:, 1] * (x2 - x1)[:, 0]) / length,
    }


def nts(*, penalty: float, tau: float = 1e-2) -> PointContact:
    """Node to segment: a spring at each slave node.

    The nodal springs know nothing of areas, so a uniform pressure does not come out on meshes of unequal segments: it
    fails the flat patch test (case A1). Its tangent is exact and symmetric.

    Source: Zavarise & De Lorenzis (2009), Section 4.1, Eq. 6 with F = ε g.
    """
    traits = _traits("a1", "nodal", None, symmetric=True, passes_normal=False, table="nts")
    return _points_at([-1.0, 1.0], [0.5, 0.5], traits, penalty, tau, nts_force.NODAL, at_nodes=True)


def nts_ar(*, penalty: float, area: str = "current", tau: float = 1e-2) -> PointContact:
    """Node to segment with area regularisation: each slave node has the springs of its area of competence.

    The slave side is loaded exactly, the master side is not where a slave node's area covers several master segments:
    it fails the flat patch test (case B). Its tangent is exact, and symmetric with reference areas.

    Source: Zavarise & De Lorenzis (2009), Section 4.2, Eq. 6 with F = ε̂ g a.
    """
    area_from = choose("area", area, AREAS)
    traits = _traits("b", "distributed", area_from, table="nts-ar")
    return _points_at([-1.0, 1.0], [0.5, 0.5], traits, penalty, tau, area_from, at_nodes=True)


def vts_g(*, penalty: float, n: int = 2, area: str = "current", tau: float = 1e-2) -> PointContact:
    """VTS-G: virtual slave nodes at the n Gauss points of each slave segment.

    A Gauss point does not balance the moment of the part of the segment that it stands for, so it fails the flat patch
    test (case B). Its tangent is exact, and symmetric with reference areas.

    Source: Zavarise & De Lorenzis (2009), Section 5.1.2, Eq. 6 with F = ε̂ g w l_AB / 2.
    """
    c, weights = np.polynomial.legendre.leggauss(check_count(n))
    area_from = choose("area", area, AREAS)
    traits = _traits("b", "distributed", area_from, linear=n > 1, n_points=n)
    return _points_at(c, weights / 2, traits, penalty, tau, area_from)


def vts_me(*, penalty: float, n: int = 2, area: str = "current", tau: float = 1e-2) -> PointContact:
    """VTS-ME: virtual slave nodes in the middle of n equal parts of each slave segment.

    Moments balance where each part faces one master segment only, as in case B. Where a part covers several, it fails
    the flat patch test (case C′; with an odd n also case B). Its tangent is exact, and symmetric with reference areas.

    Source: Zavarise & De Lorenzis (2009), Section 5.1.2, Eq. 6 with F = ε̂ g l_AB / n.
    """
    n = check_count(n)
    area_from = choose("area", area, AREAS)
    c = -1 + (2 * np.arange(n) + 1) / n
    even = n % 2 == 0
    witness, table = "c-prime" if even else "b", "vts-me" if n == 2 else ""
    traits = _traits(witness, "distributed", area_from, n_points=n, passes_single=even, table=table)
    return _points_at(c, np.full(n, 1 / n), traits, penalty, tau, area_from)


def nts_lm(*, penalty: float, tau: float = 1e-2) -> PointContact:
    """Node to segment with a multiplier, a nodal force, at each slave node.

    It fails the flat patch test in one pass (case B): the multipliers fit the gaps at the slave nodes only, and the
    master nodes get what Eq. 6 hands on. Its constraints are independent, and its saddle point is symmetric.

    Source: Zavarise & De Lorenzis (2009), Section 5.1.3; rows and tangent: here.
    """
    springs = nts(penalty=penalty, tau=tau)
    # On A1 and A2 nodal forces are free to be the right ones.
    witnesses = {**springs.traits.evidence.witnesses, "patch": "b"}
    traits = springs.traits.revise(
        normal=True, enforcement="multiplier", independent_multipliers=True, inf_sup=True, witnesses=witnesses
    )
    return replace(springs, traits=traits)


def vts_me_lm(*, penalty: float, n: int = 2, area: str = "current", tau: float = 1e-2) -> PointContact:
    """VTS-ME with a multiplier, a pressure, at each virtual slave node.

    Its promises are those of `vts_me`: it fails the flat patch test (case C′). With n ≥ 2 its multipliers are not
    unique (case A1).

    Source: Zavarise & De Lorenzis (2009), Sections 5.1.3 and 6; rows and tangent: here.
    """
    springs = vts_me(penalty=penalty, n=n, area=area, tau=tau)
    return replace(springs, traits=with_multipliers(springs.traits, n))


@cache  # No promise depends on the penalty, and a formulation is made for the penalty of each case.
def _traits(
    patch_witness: str,
    penalty: str,
    area_from: int | None,
    *,
    n_points: int = 0,
    symmetric: bool | None = None,
    linear: bool = False,
    passes_normal: bool = True,
    passes_single: bool = False,
    table: str = "",
) -> Traits:
    """Return the promises of a method that fails the flat patch test, and all else it fails, on `patch_witness`.

    Its points, `n_points` a segment or the slave nodes alone, integrate a linear gap exactly if `linear`. Its forces
    are those of `FORCE_TABLES`.
    """
    areas = {nts_force.CURRENT: "current", nts_force.REFERENCE: "reference", None: None}
    traits = POINT_TRAITS.revise(
        normal=passes_normal,
        single=passes_single,
        locks=None if n_points else False,
        converges=False if n_points <= FEW_POINTS else None,
        symmetric=area_from == nts_force.REFERENCE if symmetric is None else symmetric,
        integrates_linear_gap=None if area_from is None else linear,
        area=areas[area_from],
        penalty=penalty,
        witnesses={
            "patch": patch_witness,
            "patch.dead-zone": "dead-zone",
            "patch.kinked": "edge of 53°, lower slave",
            **POINT_TRAITS.evidence.witnesses,
            "accuracy.hertz": "parabola-layer",
            "accuracy.wavy": "upper slave, 10 E/h",
            "accuracy.wavy-curved": "upper slave, 100 E/h",
        },
        published_forces=FORCE_TABLES.get(table, {}),
        source=_PAPER,
    )
    return add_locking(traits, n_points)


def add_locking(traits: Traits, n: int) -> Traits:
    """Return the promises of springs at n points between the nodes of each slave segment, which lock if n ≥ 2.

    They are more conditions than gaps can differ between nodes. One point is not, and nothing is promised of it.
    """
    if n < 2:
        return traits
    witnesses = {"stability.locking": "12 on 8, ε̂ = 1e8 E/h", "accuracy.wavy-curved": "upper slave, 100 E/h"}
    return traits.revise(locks=True, witnesses={**traits.evidence.witnesses, **witnesses})


def _points_at(
    c: ArrayLike, weight: ArrayLike, traits: Traits, penalty: float, tau: float, area_from: int, at_nodes: bool = False
) -> PointContact:
    return PointContact(
        traits=promise_at_ends(traits, tau),
        penalty=check_penalty(penalty),
        c=freeze(c, np.float64),
        weight=freeze(weight, np.float64),
        at_nodes=at_nodes,
        area_from=area_from,
        tau=check_tau(tau),
    )


def with_multipliers(traits: Traits, n: int) -> Traits:
    """Return the promises of springs at n virtual slave nodes a segment, for multipliers in their place.

    Where nodes coincide, some pressures at n ≥ 2 points a segment move nothing. At one point a segment, a pressure that
    alternates moves less and less as the mesh is refined: the inf-sup constant β falls as h. Nodal forces converge, for
    which such a pressure hardly counts, but the error of pressures is only bounded by that of gaps over β. On a slave
    four times finer than the master they do not converge (`accuracy.wavy`: off by 0.016, 0.082, 0.025 and 0.032 on
    finer and finer meshes; means over two neighbours by 0.011, 0.008, 0.003 and 0.002). So no convergence is promised.

    With n ≥ 3 there are more pressures than nodal forces, so that some of them give the exact ones on a kink, too.
    """
    witnesses = {**traits.evidence.witnesses, "stability.inf-sup": "matching"}
    if n > 1:
        witnesses["multipliers"] = "a1"
    return traits.revise(
        enforcement="multiplier",
        independent_multipliers=n == 1,
        converges=False if n == 1 and traits.promises.converges is False else None,
        kinked=traits.promises.patch.kinked if n < 3 or traits.promises.patch.kinked else None,
        inf_sup=False,
        locks=None,
        integrates_linear_gap=None,
        witnesses=witnesses,
    )
