"""VTS-PPT: n virtual slave nodes on each slave segment, each against all master segments under its area of competence.

One kernel has three presets:

| preset | transmission | tangent | free end |
|---|---|---|---|
| `vts-ppt` | printed | exact | truncate |
| `vts-ppt-basic` | printed | that of VTS-ME, Eqs. 10–11: Newton's method converges linearly | truncate |
| `vts-ppt-balanced` (ours) | action equals reaction | exact | cover |

The option `free_end` acts at free ends of the master only, because the paper is silent about them. Everywhere else
Box 3 stands as printed. `vts_ppt_force` says what each word means.

Rule for the next editor: traits are promises that the harness checks. A preset that promises more needs a proof or an
exact test; a preset that promises "does not" names the case that shows it.

Source: Zavarise & De Lorenzis (2009), Boxes 1–3, Appendix A.
"""

from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
import scipy

from contactverif.compiler import match_precision
from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_count, check_penalty, check_tau, choose
from contactverif.contract.interface import Interface, split_state
from contactverif.contract.traits import Traits, promise_at_ends
from contactverif.geometry.block_rows import NO_NODE, Couplings, Fields, zero_matrix
from contactverif.geometry.projection import search_tree
from contactverif.geometry.threads import run_in_threads, share_couplings, split_range
from contactverif_nts import vts_ppt_force, vts_ppt_tangent
from contactverif_nts.nts_force import AREAS, CURRENT, residual_of
from contactverif_nts.point_contact import POINT_TRAITS, add_locking, place_points, surfaces_of, with_multipliers
from contactverif_nts.vts_ppt_force import COVER, FREE_ENDS, TRUNCATE, Areas

_PAPER = "Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416, Boxes 1–3, Appendix A"
_PRINTED = POINT_TRAITS.revise(
    flat=True,
    normal=True,
    single=True,
    kinked=True,
    converges=True,
    symmetric=False,
    conserves_force=False,
    conserves_moment=False,
    integrates_linear_gap=False,
    # Where a walk stops before a segment that is seen edge-on, the segment before it is continued. The share of its
    # other node is below zero as soon as what is continued is longer than the segment. "cover" cuts the area there, but
    # in the frame of the segment of the uncut V, and the walk of V′ may stop earlier in its own frame.
    nodes_push=None,
    area="current",
    penalty="distributed",
    witnesses={
        "balance.force": "tilted",
        "balance.moment": "tilted",
        "patch.dead-zone": "dead-zone",
        **POINT_TRAITS.evidence.witnesses,
    },
    published_forces={"c": "1 2 3 4 2; 3/2 3 3 3 3/2"},  # Fig. 20
    source=_PAPER,
)


@dataclass(frozen=True, slots=True, eq=False)
class PatchTestPassing:
    """A VTS-PPT formulation."""

    traits: Traits
    # Distributed stiffness ε̂; with multipliers (trait `enforcement`) the scale c of the decision λ − c g ≥ 0.
    penalty: float
    n: int  # Number of virtual slave nodes on a slave segment.
    transmission: int  # `vts_ppt_force.PRINTED` or `vts_ppt_force.BALANCED`.
    consistent: bool  # The tangent is exact; else it is that of VTS-ME.
    # Areas of competence are measured in the current configuration; else in the reference configuration.
    current_area: bool
    free_end: int  # `vts_ppt_force.TRUNCATE`, `EXTEND` or `COVER`.
    tau: float  # The part of a master segment by which a foot may lie past its free end and still count.
    # How many threads share the pairing and the tangent of a large interface; the answers have the same bits.
    threads: int

    def n_multipliers(self, interface: Interface, /) -> int:
        """Return the number of multipliers: one for each virtual slave node, or 0 for a penalty."""
        return self.n * len(interface.slave) if self.traits.rules.enforcement == "multiplier" else 0

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the master segments under each area of competence, and decide which virtual slave nodes are active."""
        state = split_state(interface, z)
        tree = search_tree(interface.master, state[0])
        surfaces = surfaces_of(interface, interface.nodes)
        balanced = self.transmission == vts_ppt_force.BALANCED
        search = self.n, self.free_end, self.tau, self.penalty, balanced
        areas = vts_ppt_force.pair(state, surfaces, tree, search, self.threads)
        return Pairing(dict(zip(Areas._fields, areas, strict=True)))

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns) of Box 3 and, behind them, the constraints of multipliers."""
        return residual_of(vts_ppt_force.add_residual, interface, z, self._arguments(interface, pairing, z))

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> scipy.sparse.csr_array:
        """Compute the derivative of the residual; that of Eq. 6 alone where the preset is not consistent."""
        if not self.consistent:
            pairing = Pairing({**pairing, "first": pairing["master"], "last": pairing["master"]})
        return self._sweep(interface, pairing, z)[1]

    def residual_and_tangent(
        self, interface: Interface, pairing: Pairing, z: FloatArray, /
    ) -> tuple[FloatArray, scipy.sparse.csr_array]:
        """Compute residual and tangent in one sweep, or one after the other where the preset is not consistent."""
        if not self.consistent:
            return self.residual(interface, pairing, z), self.tangent(interface, pairing, z)
        return self._sweep(interface, pairing, z)

    def _sweep(
        self, interface: Interface, pairing: Pairing, z: FloatArray
    ) -> tuple[FloatArray, scipy.sparse.csr_array]:
        state, arguments = split_state(interface, z), self._arguments(interface, pairing, z)
        n_nodes, n_multipliers = interface.n_nodes, len(state[1])
        group, first_multiplier = (1, n_nodes) if n_multipliers else (self.n, NO_NODE)
        couplings = vts_ppt_tangent.list_couplings(*arguments[:2], self.n, group, first_multiplier)
        matrix = zero_matrix(n_nodes, n_multipliers, Couplings(couplings[0], couplings[1], couplings[1][:-1]))
        rows, csr = np.zeros(z.size), (matrix.indptr, matrix.indices, matrix.data)
        shares = share_couplings(
            n_nodes + n_multipliers, couplings[0], couplings[1], split_range(len(couplings[2]), self.threads)
        )
        sweep = partial(vts_ppt_tangent.add_forces_and_tangent, rows, csr, state, arguments, couplings)
        run_in_threads([partial(sweep, tuple(share)) for share in shares])
        return rows, matrix

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return each virtual slave node with its gap, its pressure and the ends Q, P of its area of competence.

        Where nothing of an area faces the master, the point has the whole area and no weight.
        """
        x, multipliers = split_state(interface, z)
        slave, master = interface.slave.segments, interface.master.segments
        ends = np.array(
            [
                vts_ppt_force.area_of_competence(x, slave, master, self.n, point, *cut)
                for point, cut in enumerate(zip(pairing["frame"], pairing["cut_p"], pairing["cut_q"], strict=True))
            ]
        )  # (n_points, 2): P and Q
        shares = np.maximum(ends[:, 0] - ends[:, 1], 0.0) / 2
        whole = np.array([vts_ppt_force.middle_of_part(point, self.n, 1.0) for point in range(self.n)])
        whole = np.tile(np.column_stack([whole + 1 / self.n, whole - 1 / self.n]), (len(slave), 1))
        ends = np.where(shares[:, None] > 0, ends, whole)
        segment = np.repeat(np.arange(len(slave)), self.n)
        place = place_points(interface, x, segment, ends.mean(axis=1), pairing["master"])
        pressure = multipliers if len(multipliers) else -self.penalty * place["gap"]
        lengths = interface.slave.lengths(x if self.current_area else interface.nodes)
        return ContactPoints(
            **place,
            pressure=np.where(pairing["active"], pressure, 0.0),
            weight=lengths[segment] * shares,
            active=pairing["active"],
            area_from=ends[:, 1],
            area_to=ends[:, 0],
        )

    def _arguments(self, interface: Interface, pairing: Pairing, z: Array) -> tuple[Fields, Fields, Fields]:
        (reference,) = match_precision(z, interface.nodes)
        areas = tuple([pairing[name] for name in Areas._fields])
        return surfaces_of(interface, reference), areas, (self.n, self.transmission, self.current_area, self.penalty)


def vts_ppt(
    *, penalty: float, n: int = 2, free_end: str = "truncate", tau: float = 1e-2, threads: int = 1
) -> PatchTestPassing:
    """VTS-PPT as printed: each virtual slave node presses on all master segments under its area of competence.

    It passes the flat patch test on any mesh, because Box 3 integrates a uniform pressure exactly over the part of each
    master segment that the area covers. It does not conserve force and moment where the surfaces are tilted: the slave
    pushes with lengths along itself, the master with lengths projected on it. It does not cover an overhang.

    Source: Zavarise & De Lorenzis (2009), Boxes 1–3; tangent: Appendix A.
    """
    rule = choose("free_end", free_end, FREE_ENDS)
    return PatchTestPassing(
        traits=promise_at_ends(_promises_as_printed(rule, check_count(n)), tau),
        penalty=check_penalty(penalty),
        n=check_count(n),
        transmission=vts_ppt_force.PRINTED,
        consistent=True,
        current_area=True,
        free_end=rule,
        tau=check_tau(tau),
        threads=check_count(threads, "threads"),
    )


def vts_ppt_basic(
    *, penalty: float, n: int = 2, free_end: str = "truncate", tau: float = 1e-2, threads: int = 1
) -> PatchTestPassing:
    """VTS-PPT as printed with the tangent of VTS-ME: Newton's method converges linearly.

    The forces and their promises are those of `vts_ppt`. The tangent is promised to be approximate: it treats each
    virtual slave node as if it pressed on one master segment only.

    Source: Zavarise & De Lorenzis (2009), Boxes 1–3; tangent: Eqs. 10–11.
    """
    consistent = vts_ppt(penalty=penalty, n=n, free_end=free_end, tau=tau, threads=threads)
    traits = promise_at_ends(_basic_promises(consistent.free_end, n), tau)
    return replace(consistent, consistent=False, traits=traits)


def vts_ppt_balanced(
    *, penalty: float, n: int = 2, area: str = "current", free_end: str = "cover", tau: float = 1e-2, threads: int = 1
) -> PatchTestPassing:
    """VTS-PPT with action equal to reaction on tilted and bent surfaces and at free ends (ours).

    The master nodes share the force of the virtual slave node in the proportions of Box 3. So force and moment are
    conserved, and the flat patch test passes as with `vts_ppt`. With "cover", the default, it also covers an overhang.
    With "extend" force and moment are conserved, too. With "truncate" the master's last nodes get the whole force, S
    being the sum of the truncated parts: force is conserved, and moment is not where an area overhangs a free end.

    A walk does not begin where the whole area of competence lies past one end of V's master segment: its part of that
    segment is negative, and S may vanish. Eq. 6 holds there, which is balanced as well.

    Source: Zavarise & De Lorenzis (2009), Boxes 1–3 and Appendix A; balance and "cover": here.
    """
    current = choose("area", area, AREAS) == CURRENT
    consistent = vts_ppt(penalty=penalty, n=n, free_end=free_end, tau=tau, threads=threads)
    return replace(
        consistent,
        transmission=vts_ppt_force.BALANCED,
        current_area=current,
        traits=promise_at_ends(_balanced_promises(consistent.free_end, n, current), tau),
    )


def vts_ppt_lm(
    *,
    penalty: float,
    n: int = 2,
    transmission: str = "printed",
    free_end: str = "",
    tau: float = 1e-2,
    threads: int = 1,
) -> PatchTestPassing:
    """VTS-PPT with a multiplier, a pressure, at each virtual slave node.

    It passes the flat patch test, as `vts_ppt` does. Box 3 spreads its forces and Eq. 6 measures its gaps, so its
    tangent is unsymmetric. With n ≥ 2 its multipliers are not unique (case A1). With a fine slave the saddle point is
    singular in the positions too, and Newton's method may find no solution though there is an exact one (case C with
    each segment divided by two). With n = 1 neither happens.

    Source: Zavarise & De Lorenzis (2009), Sections 6 and 7.1; rows and tangent: here.
    """
    make = choose("transmission", transmission, {"printed": vts_ppt, "balanced": vts_ppt_balanced})
    springs = make(penalty=penalty, n=n, tau=tau, threads=threads, **({"free_end": free_end} if free_end else {}))
    return replace(springs, traits=with_multipliers(springs.traits, n))


# No promise depends on the penalty, and a formulation is made for the penalty of each case. So promises are kept.
@cache
def _promises_as_printed(free_end: int, n: int) -> Traits:
    return add_locking(_PRINTED.revise(overhang=free_end == COVER), n)


@cache
def _basic_promises(free_end: int, n: int) -> Traits:
    consistent = _promises_as_printed(free_end, n)
    witnesses = {**consistent.evidence.witnesses, "tangent": "offset-c", "newton": "example-1bis"}
    return consistent.revise(tangent="approximate", witnesses=witnesses)


@cache
def _balanced_promises(free_end: int, n: int, current: bool) -> Traits:
    """Return the promises of `vts_ppt_balanced`.

    The parts of all segments together have S and, by the lever rule, the moment of the whole area, also where the last
    one is continued. Truncated parts have S as well, but their middle lies elsewhere than that of the area.
    """
    covers = free_end == COVER
    traits = _PRINTED.revise(
        overhang=covers,
        conserves_force=True,
        conserves_moment=None if free_end == TRUNCATE else True,
        area="current" if current else "reference",
        witnesses={**({} if covers else {"patch.dead-zone": "dead-zone"}), **POINT_TRAITS.evidence.witnesses},
    )
    return add_locking(traits, n)
