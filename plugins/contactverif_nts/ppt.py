"""VTS-PPT, one kernel with three presets.

| preset | transmission | tangent | free end |
|---|---|---|---|
| `vts-ppt` | printed | exact | truncate |
| `vts-ppt-basic` | printed | that of VTS-ME, Eqs. 10–11: linear convergence | truncate |
| `vts-ppt-balanced` | action equals reaction | exact | cover |

At a free end of the master, *truncate* keeps the force of the slave and loses the master's part of it, *extend* reads
Box 3 literally, *cover* takes only what faces the master into the area of competence.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.formulation import ContactPoints, Pairing, Traits
from contactverif.contract.interface import Interface
from contactverif.contract.state_vector import join_rows, split_state, split_states
from contactverif.geometry.projection import search_tree
from contactverif_nts import box3, walk
from contactverif_nts.eq6 import CURRENT
from contactverif_nts.options import AREAS, check_count, check_free_end, check_penalty, chosen

_PAPER = "Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416, Boxes 1–3, Appendix A"
_FREE_ENDS = {"truncate": walk.TRUNCATE, "extend": walk.EXTEND, "cover": walk.COVER}
_NAMES = ("master", "first", "last", "frame", "cut_p", "cut_q", "clip_p", "clip_q", "active")
_PRINTED = Traits(
    passes_flat_patch=True,
    covers_overhang=False,
    tangent="exact",
    symmetric=False,
    conserves_force=False,
    conserves_moment=False,
    area="current",
    penalty="distributed",
    batched=True,
    takes_complex=True,
    witnesses={"balance.force": "tilted", "balance.moment": "tilted", "patch.dead-zone": "dead-zone"},
    source=_PAPER,
)


@dataclass(frozen=True, slots=True, eq=False)
class PatchTestPassing:
    """n virtual slave nodes on each slave segment, each against all master segments under its area of competence.

    Attributes
    ----------
    penalty : float
        Stiffness; with multipliers (trait `enforcement`) the scale c of the decision λ − c g ≥ 0.
    transmission : int
        Box3.PRINTED or box3.BALANCED.
    consistent : bool
        The tangent is exact; else that of VTS-ME.
    current_area : bool
        Areas of competence are measured in the current configuration, else in the reference.
    free_end : int
        Walk.TRUNCATE, EXTEND or COVER.
    tau : float
        How far past a free end of the master a foot still counts, in lengths of the segment.
    """

    traits: Traits
    penalty: float
    n: int
    transmission: int
    consistent: bool
    current_area: bool
    free_end: int
    tau: float

    def n_multipliers(self, interface: Interface, /) -> int:
        """One for each virtual slave node, in the order of the segments; none where a penalty holds them."""
        return self.n * len(interface.slave) if self.traits.enforcement == "multiplier" else 0

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """What the area of competence of each virtual slave node covers, and whether it is in contact."""
        x, multipliers = split_state(interface, z)
        master = interface.master
        found = walk.pair(
            x,
            interface.slave.segments,
            master.segments,
            master.neighbours,
            *search_tree(master, x),
            self.n,
            self.free_end,
            self.tau,
            multipliers,
            self.penalty,
        )
        return Pairing(dict(zip(_NAMES, found, strict=True)))

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Forces (..., n_unknowns), Box 3; behind them the constraints of multipliers."""
        return join_rows(*box3.residual(*split_states(interface, z), *self._arguments(interface, pairing)), z)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.coo_array:
        """Derivative of the residual, Appendix A; that of one segment only where not consistent."""
        if not self.consistent:
            pairing = Pairing({**pairing, "first": pairing["master"], "last": pairing["master"]})
        rows, columns, values = box3.tangent(*split_state(interface, z), *self._arguments(interface, pairing))
        return sparse.coo_array((values, (rows, columns)), shape=(z.size, z.size))

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Each virtual slave node, with its gap and pressure and the ends Q, P of its area of competence."""
        x, multipliers = split_state(interface, z)
        slave, master = interface.slave.segments, interface.master.segments
        ends = np.array(
            [
                box3.area_of_competence(x, slave, master, point, self.n, *cut)
                for point, cut in enumerate(zip(pairing["frame"], pairing["cut_p"], pairing["cut_q"], strict=True))
            ]
        )  # (n_points, 2): P and Q
        c = ends.mean(axis=1)
        segment = np.repeat(np.arange(len(slave)), self.n)
        x_a, x_b = np.swapaxes(x[slave[segment]], 0, 1)
        position = (1 - c[:, None]) / 2 * x_a + (1 + c[:, None]) / 2 * x_b
        x1, x2 = np.swapaxes(x[master[pairing["master"]]], 0, 1)
        length = np.linalg.norm(x2 - x1, axis=1)
        t = (x2 - x1) / length[:, None]
        normal = np.column_stack([t[:, 1], -t[:, 0]])
        gap = ((position - x1) * normal).sum(axis=1)
        pressure = multipliers if len(multipliers) else -self.penalty * gap
        lengths = interface.slave.lengths(x if self.current_area else interface.nodes)
        return ContactPoints(
            slave_segment=segment,
            c=c,
            master_segment=pairing["master"],
            xi=((position - x1) * t).sum(axis=1) / length,
            position=position,
            normal=normal,
            gap=gap,
            pressure=np.where(pairing["active"], pressure, 0.0),
            weight=lengths[segment] * (ends[:, 0] - ends[:, 1]) / 2,
            active=pairing["active"],
            area_from=ends[:, 1],
            area_to=ends[:, 0],
        )

    def _arguments(self, interface: Interface, pairing: Pairing) -> tuple[Any, ...]:
        return (
            interface.nodes,
            interface.slave.segments,
            interface.master.segments,
            interface.master.neighbours,
            *(pairing[name] for name in _NAMES),
            self.n,
            self.transmission,
            self.current_area,
            self.penalty,
        )


def vts_ppt(*, penalty: float, n: int = 2, free_end: str = "truncate", tau: float = 1e-2) -> PatchTestPassing:
    """VTS-PPT as printed, with its consistent tangent.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per length per length of penetration.
    n : int
        Number of virtual slave nodes on a slave segment, ≥ 1; the paper has 2.
    free_end : str
        "truncate" (default), "extend" (Box 3 literally) or "cover".
    tau : float
        How far past a free end of the master a foot still counts, in lengths of its segment.
    """
    return PatchTestPassing(
        traits=replace(_PRINTED, covers_overhang=free_end == "cover"),
        penalty=check_penalty(penalty),
        n=check_count(n),
        transmission=box3.PRINTED,
        consistent=True,
        current_area=True,
        free_end=chosen("free_end", free_end, _FREE_ENDS),
        tau=check_free_end(tau),
    )


def vts_ppt_basic(*, penalty: float, n: int = 2, free_end: str = "truncate", tau: float = 1e-2) -> PatchTestPassing:
    """VTS-PPT as printed with the tangent of VTS-ME (Eqs. 10–11): Newton converges linearly.

    Parameters are those of `vts_ppt`.
    """
    witnesses = {**_PRINTED.witnesses, "tangent.directional": "offset-c", "newton": "example-1bis"}
    consistent = vts_ppt(penalty=penalty, n=n, free_end=free_end, tau=tau)
    traits = replace(consistent.traits, tangent="approximate", witnesses=witnesses)
    return replace(consistent, consistent=False, traits=traits)


def vts_ppt_balanced(
    *, penalty: float, n: int = 2, area: str = "current", free_end: str = "cover", tau: float = 1e-2
) -> PatchTestPassing:
    """VTS-PPT with action equal to reaction on tilted and bent surfaces and at free ends, and its exact tangent.

    Parameters
    ----------
    area : str
        "current" or "reference", where areas of competence are measured.
    penalty, n, free_end, tau : float or int or str
        As for `vts_ppt`; free_end is "cover" by default.
    """
    current = chosen("area", area, AREAS) == CURRENT
    covers = free_end == "cover" or None  # else an overhang breaks the balance, and nothing is promised of it
    traits = replace(
        _PRINTED,
        covers_overhang=covers,
        conserves_force=covers,
        conserves_moment=covers,
        area="current" if current else "reference",
        witnesses={},
    )
    return replace(
        vts_ppt(penalty=penalty, n=n, free_end=free_end, tau=tau),
        transmission=box3.BALANCED,
        current_area=current,
        traits=traits,
    )
