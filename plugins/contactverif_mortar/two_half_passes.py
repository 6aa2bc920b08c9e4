"""Mortar in two half passes: each body is pushed by what its own surface sees, and by nothing else.

In a half pass one surface is the slave. Gaps g along its normals are weighted over its nodes' shapes, and its nodal
pressures p_j = −ε̂ G_j push it alone:

    G_j = ∫N_j g / ∫N_j        R_j = ∫N_j p n, with n out of the slave

The other half pass does the same with the roles exchanged. No force is handed to the other body, so nothing is
integrated over the meshes of both, and a uniform pressure comes out exactly without cutting one mesh at the nodes of
the other. The price: forces balance only as well as both surfaces see the same gap.

Gauss points are spread over the `Ranges` of a segment as a whole. So a gap that is smooth is integrated well, and one
with a bend inside is not integrated exactly.

Our choices: gaps and forces along the normal of a half pass's own segment; one cut where the covered part ends; and a
segment that is seen at more than 60° counts as unseen. Else roundoff would let a side face of a body, at 90° to the
other, look along it, and spoil the weighted gap at its corner.

Source: Duong, De Lorenzis & Sauer (2018), arXiv 1712.01179, after Sauer & De Lorenzis (2013).
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from contactverif.compiler import compile_maker
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_count, check_penalty, choose
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif.geometry.block_rows import Couplings, NumberArray, TangentOfBoth, zero_matrix
from contactverif_mortar.cell_frame import ForcesAndTangent, NodeState
from contactverif_mortar.integration_cells import (
    AREAS,
    CELL_TRAITS,
    LOCKING_WITNESSES,
    Cells,
    Quadrature,
    Ranges,
    Sides,
    near,
    report_nodes,
)
from contactverif_mortar.node_factors import RowGroups, group_nodes
from contactverif_mortar.shape_rows import Weighted, add_shaped_rows, divide_covered, own_lengths, weigh_points

STEEPEST = -0.5  # The cosine between two segments that see each other; −1 where they are parallel.
PREFIXES = ("slave.", "master.")  # The surface that is pushed in each half pass.
_SOURCE = "Duong, De Lorenzis & Sauer, Comput. Methods Appl. Mech. Engrg 333 (2018), arXiv 1712.01179"


@dataclass(frozen=True, slots=True, eq=False)
class TwoHalfPasses(TangentOfBoth):
    """The formulation."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.
    rule: Quadrature  # The points on a covered range, and the configuration in which lengths are measured.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find cells and ranges of both half passes, by the surface that is pushed, and the active nodes of both."""
        x, arrays = np.array(z).reshape(-1, 2), {}
        active = np.zeros(interface.n_nodes, dtype=np.bool_)
        for prefix, sides in _both_sides(interface):
            cells = _find_cells(sides, x)
            ranges = Ranges.find(sides, x, cells, self.rule)
            _, gaps = self._gaps(sides, ranges, x)
            active |= gaps <= 0  # false where NaN
            arrays.update({f"{prefix}cells.{name}": array for name, array in cells._asdict().items()})
            arrays.update({prefix + name: array for name, array in ranges._asdict().items()})
        return Pairing({**arrays, "active": active})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        x, active = np.array(z).reshape(-1, interface.n_nodes, 2), pairing["active"]
        total = np.zeros_like(x)
        for half_pass in self._carrying(interface, pairing, x):
            pressure = np.zeros_like(half_pass.areas)
            own = active & (half_pass.areas != 0).any(axis=0)
            pressure[:, own] = -self.penalty * half_pass.with_gap[:, own] / half_pass.areas[:, own]
            pushed = half_pass.sides.slave.nodes  # A half pass pushes its own surface alone.
            total[:, pushed] += half_pass.forces(pressure)[:, pushed]
        return total.reshape(z.shape)

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ForcesAndTangent:
        """Compute forces (n_unknowns,) and their derivative, Σ p_j ΔB_j + B Δp on the rows of the pushed surface."""
        x, active = np.array(z).reshape(-1, 2), pairing["active"]
        half_passes = self._carrying(interface, pairing, x[None])
        groups = [
            group_nodes(interface.n_nodes, each.sides.slave.segments, each.parts.slave, local, active, dual=False)
            for each in half_passes
            for local in [each.parts.local_nodes(each.sides)]
        ]
        matrix = zero_matrix(interface.n_nodes, 0, _couple(active, half_passes, groups))
        forces: FloatArray = np.zeros(interface.n_unknowns)
        for each, of_rows in zip(half_passes, groups, strict=True):
            areas = np.where(active & (each.areas[0] != 0), each.areas[0], 1.0)
            gaps = each.with_gap[0] / areas
            weights = np.where(active, -self.penalty, 0.0)
            state = NodeState(weights * gaps, weights, gaps, areas)
            rows = add_shaped_rows(each, self.rule, x, of_rows, state, 2, forces, matrix)
            rows.multiply(0, interface.n_nodes)
        return forces, matrix

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the nodes of both surfaces with weighted gap and nodal pressure; the master's are a second pass."""
        x, half_passes = np.array(z).reshape(-1, 2), []
        for prefix, sides in _both_sides(interface):
            areas, gaps = self._gaps(sides, Ranges.from_pairing(pairing, prefix), x)
            active, numbers = pairing["active"], sides.slave.nodes
            pressure = np.where(active, -self.penalty * gaps, 0.0)
            cells = Cells.from_pairing(pairing, f"{prefix}cells.")
            points = report_nodes(sides, cells, x, areas, gaps, pressure, active)
            on_master = np.full(interface.n_nodes, prefix == PREFIXES[1])
            half_passes.append((replace(points, on_master=on_master), numbers))
        names = [entry.name for entry in fields(ContactPoints)]
        return ContactPoints(
            **{name: np.concatenate([getattr(each, name)[numbers] for each, numbers in half_passes]) for name in names}
        )

    def _carrying(self, interface: Interface, pairing: Pairing, x: Array) -> list[Weighted]:
        """Compute the points on the segments with an active node; the others carry no pressure."""
        active = pairing["active"]
        return [
            weigh_points(sides, near(Ranges.from_pairing(pairing, prefix), active, sides), self.rule, x, dual=False)
            for prefix, sides in _both_sides(interface)
        ]

    def _gaps(self, sides: Sides, ranges: Ranges, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ∫N_j and G_j (n_nodes,) at x (n_nodes, 2); where nothing is covered they are zero and NaN."""
        half_pass = weigh_points(sides, ranges, self.rule, x[None], dual=False)
        lengths = own_lengths(sides, x if self.rule.current else sides.nodes)
        return divide_covered(half_pass.areas[0], half_pass.with_gap[0], lengths)


def _both_sides(interface: Interface) -> tuple[tuple[str, Sides], ...]:
    nodes, slave, master = interface.nodes, interface.slave, interface.master
    return (PREFIXES[0], Sides(nodes, slave, master)), (PREFIXES[1], Sides(nodes, master, slave))


def _find_cells(sides: Sides, x: FloatArray) -> Cells:
    """Return the cells of segments that meet at no more than 60°, at the positions x (n_nodes, 2)."""
    cells = Cells.find(sides, x, averaged=False)
    slave = np.diff(x[sides.slave.segments[cells.slave]], axis=1)[:, 0]
    master = np.diff(x[sides.master.segments[cells.master]], axis=1)[:, 0]
    sizes = np.linalg.norm(slave, axis=1) * np.linalg.norm(master, axis=1)
    return cells.select((slave * master).sum(axis=1) <= STEEPEST * sizes)


def _couple(active: BoolArray, half_passes: list[Weighted], groups: list[RowGroups]) -> Couplings:
    """Return the couplings of both half passes: around an active node, the nodes of its segments feel its group."""
    parts = [
        _couple_half_pass(active, each.sides.slave.segments, of_rows.nodes, of_rows.starts)
        for each, of_rows in zip(half_passes, groups, strict=True)
    ]
    nodes = np.concatenate([part[0] for part in parts])
    shift = len(parts[0][0])
    starts = np.concatenate([parts[0][1][:-1], parts[1][1] + shift])
    return Couplings(nodes, starts, np.concatenate([parts[0][2], parts[1][2] + shift]))


@compile_maker
def _couple_half_pass(
    active: BoolArray, slave: IntArray, nodes: NumberArray, starts: IntArray
) -> tuple[NumberArray, IntArray, IntArray]:
    """Return the couplings of one half pass; each holds a group, and behind it once more the nodes that are pushed."""
    around = np.full((len(active), 3), -1, dtype=np.int64)
    for s in range(len(slave)):
        a, b = slave[s, 0], slave[s, 1]
        around[a, 1], around[b, 1], around[a, 2], around[b, 0] = a, b, b, a
    together, count = np.empty(len(nodes) + 3 * len(active), dtype=np.int32), 0
    begins, first_row = np.zeros(len(active) + 1, dtype=np.int64), np.empty(len(active), dtype=np.int64)
    for j in range(len(active)):
        for place in range(starts[j], starts[j + 1]):
            together[count] = nodes[place]
            count += 1
        first_row[j] = count
        for side in range(3):
            if starts[j + 1] > starts[j] and around[j, side] >= 0:
                together[count] = around[j, side]
                count += 1
        begins[j + 1] = count
    return together[:count].copy(), begins, first_row


def mortar_two_half_pass(*, penalty: float, area: str = "current", n: int = 2) -> TwoHalfPasses:
    """Mortar in two half passes: each surface weights its own gaps, and its pressures push its own body alone.

    It passes the flat patch test and covers an overhang, with Gauss points that know nothing of the nodes on the other
    side. Slave and master may be exchanged. Forces and moments balance as well as both surfaces see the same gap, which
    is not exactly: it fails where one surface is tilted against the other. It converges at soft penalties, and not at
    stiff ones where surfaces are not parallel, so it promises nothing there. `n` ≥ 2 is the number of Gauss points on
    the covered range of a segment. With two of them the two surfaces weigh different gaps where nodes do not match.
    From 60 E/h on, the unsymmetric stiffness is then almost singular at some penalties: 12 on 8 segments were 3.4 times
    too compliant at 100 E/h, and 0.85 times at 110 E/h. Five points move this beyond 1e3 E/h. For that reason nothing
    is promised of kinks with stiff springs either.

    Source: Duong, De Lorenzis & Sauer, Comput. Methods Appl. Mech. Engrg 333 (2018), arXiv 1712.01179.
    """
    current = choose("area", area, AREAS)
    witnesses = {"balance.force": "tilted", "balance.moment": "tilted", "symmetric": "offset-c", **LOCKING_WITNESSES}
    traits = CELL_TRAITS.revise(
        # With three normals and stiff springs some n are near a singular penalty: with n = 4, 8, 16 and 32 the error
        # falls by 0.76 to 0.93 decades over one of ε̂.
        kinked=None,
        converges=None,
        locks=True,
        conserves_force=False,
        conserves_moment=False,
        continuity=None,
        integrates_linear_gap=None,
        unbiased=True,
        area=area,
        gap=None,
        witnesses=witnesses,
        source=_SOURCE,
    )
    return TwoHalfPasses(traits, check_penalty(penalty), Quadrature.gauss(check_count(n, least=2), current))
