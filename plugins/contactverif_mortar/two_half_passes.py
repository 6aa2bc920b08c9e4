"""Mortar in two half passes: each body is pushed by what its own surface sees, and by nothing else.

In a half pass one surface is the slave. Gaps g along its normals are weighted over its nodes' shapes, and its nodal
pressures p_j = −ε̂ G_j push it alone:

    G_j = ∫N_j g / ∫N_j        R_j = ∫N_j p n, with n out of the slave

The other half pass does the same with the roles exchanged. No force is handed to the other body, so nothing is
integrated over the meshes of both, and a uniform pressure comes out exactly without cutting one mesh at the nodes of
the other. The price: forces balance only as well as both surfaces see the same gap.

Our choices: gaps and forces along the normal of a half pass's own segment; one cut where the covered part ends; and a
segment that is seen at more than 60° counts as unseen. Else roundoff would let a side face of a body, at 90° to the
other, look along it, and spoil the weighted gap at its corner.

Source: Duong, De Lorenzis & Sauer (2018), arXiv 1712.01179, after Sauer & De Lorenzis (2013).
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.option_checks import check_count, check_penalty, choose
from contactverif.contract.traits import Traits
from contactverif.geometry.compiled import TAKES_LONGDOUBLE
from contactverif_mortar import cell_forces
from contactverif_mortar.cell_contact_points import at_nodes
from contactverif_mortar.covered_ranges import Ranges
from contactverif_mortar.integration_cells import AREAS, Cells, Quadrature
from contactverif_mortar.pressure_shapes import Rows, Shapes, integrals
from contactverif_mortar.weighted_gaps import UNCOVERED, at_fixed_pressures, own_lengths

STEEPEST = -0.5  # The cosine between two segments that see each other; −1 where they are parallel.
PREFIXES = ("slave.", "master.")  # The surface that is pushed in each half pass.
HalfPasses = tuple[tuple[str, Interface, IntArray], ...]  # The prefix, the interface in its roles, the places in z.
_SOURCE = "Duong, De Lorenzis & Sauer, Comput. Methods Appl. Mech. Engrg 333 (2018), arXiv 1712.01179"


@dataclass(frozen=True, slots=True, eq=False)
class _Weighted:
    """The points of a half pass at some states, with ∫N_j and ∫N_j g (n_states, n_slave_nodes)."""

    ranges: Ranges
    points: Array
    shapes: Shapes
    ends: IntArray
    areas: Array
    with_gap: Array


@dataclass(frozen=True, slots=True, eq=False)
class TwoHalfPasses:
    """The formulation.

    Attributes
    ----------
    traits : Traits
        The promises.
    penalty : float
        Distributed stiffness ε̂.
    rule : Quadrature
        The points on a covered range, and the configuration in which lengths are measured.
    """

    traits: Traits
    penalty: float
    rule: Quadrature
    _last: list[tuple[Interface, HalfPasses]] = field(default_factory=list, init=False, repr=False)

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find cells, ranges and active nodes of both half passes; each name begins with the surface that is pushed."""
        arrays = {}
        for prefix, sides, places in self._half_passes(interface):
            x = np.array(z)[places].reshape(-1, 2)
            cells = _find_cells(sides, x)
            ranges = Ranges.find(sides, x, cells, self.rule)
            _, gaps = self._gaps(sides, ranges, x)
            stored = {f"{prefix}cells.{name}": array for name, array in cells.as_arrays().items()}
            arrays.update({**stored, **ranges.as_arrays(prefix), f"{prefix}active": gaps <= 0})  # false where NaN
        return Pairing(arrays)

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        total = np.zeros_like(z)
        for prefix, sides, places in self._half_passes(interface):
            x = np.array(z)[..., places].reshape(-1, interface.n_nodes, 2)
            active = pairing[f"{prefix}active"]
            weighted = self._carrying(sides, pairing, prefix, x)
            pressure = np.zeros_like(weighted.areas)
            pressure[:, active] = -self.penalty * weighted.with_gap[:, active] / weighted.areas[:, active]
            at_points = weighted.shapes.at(pressure, weighted.ends)
            nodes = weighted.ranges.local_nodes(sides)
            forces = cell_forces.forces(weighted.points, at_points, nodes, interface.n_nodes)
            n_own = 2 * sides.n_slave_nodes  # A half pass pushes its own surface alone.
            total[..., places[:n_own]] += forces[:, : sides.n_slave_nodes].reshape(*z.shape[:-1], n_own)
        return total

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.coo_array:
        """Compute the derivative of the residual, sparse."""
        parts = [self._half_tangent(interface, pairing, z, *half_pass) for half_pass in self._half_passes(interface)]
        rows, columns, values = (np.concatenate(both) for both in zip(*parts, strict=True))
        return sparse.coo_array((values, (rows, columns)), shape=(z.size, z.size))

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the nodes of both surfaces with weighted gap and nodal pressure; the master's are a second pass."""
        half_passes = []
        for prefix, sides, places in self._half_passes(interface):
            x = np.array(z)[places].reshape(-1, 2)
            areas, gaps = self._gaps(sides, Ranges.from_pairing(pairing, prefix), x)
            active = pairing[f"{prefix}active"]
            pressure = np.where(active, -self.penalty * gaps, 0.0)
            cells = Cells(*(pairing[f"{prefix}cells.{entry.name}"] for entry in fields(Cells)))
            points = at_nodes(sides, cells, x, areas, gaps, pressure, active)
            half_passes.append(replace(points, on_master=np.full(len(gaps), prefix == PREFIXES[1])))
        names = [entry.name for entry in fields(ContactPoints)]
        return ContactPoints(**{name: np.concatenate([getattr(each, name) for each in half_passes]) for name in names})

    def _half_passes(self, interface: Interface) -> HalfPasses:
        """Return both half passes. The last ones are kept: exchanging the roles costs as much as finding the cells."""
        if not self._last or self._last[0][0] is not interface:
            self._last[:] = [(interface, _make_half_passes(interface))]
        return self._last[0][1]

    def _half_tangent(
        self, interface: Interface, pairing: Pairing, z: FloatArray, prefix: str, sides: Interface, places: IntArray
    ) -> tuple[IntArray, IntArray, FloatArray]:
        """Return rows, columns and values of the derivative of one half pass: Σ p_j ΔB_j + B Δp on its own rows."""
        x, active = np.array(z)[places].reshape(-1, 2), pairing[f"{prefix}active"]
        weighted = self._carrying(sides, pairing, prefix, x[None])
        areas = np.where(active, weighted.areas[0], 1.0)
        gaps = np.where(active, weighted.with_gap[0] / areas, 0.0)
        stiffness = np.where(active, self.penalty, 0.0)
        rows = Rows(
            weighted.ranges.gains(sides, x, self.rule),
            weighted.points[0],
            weighted.shapes,
            weighted.ranges.slave,
            weighted.ends,
            weighted.ranges.local_nodes(sides),
            len(sides.slave),
            interface.n_unknowns,
            dual=False,
        )
        derivative, influence = at_fixed_pressures(rows, -stiffness * gaps)
        whole = derivative - influence @ sparse.diags_array(stiffness) @ rows.weighted_gaps(gaps, areas)
        block = whole.tocsr()[: 2 * sides.n_slave_nodes].tocoo()
        return places[block.row], places[block.col], block.data

    def _carrying(self, sides: Interface, pairing: Pairing, prefix: str, x: Array) -> _Weighted:
        """Compute the points on the slave segments with an active node; the others carry no pressure."""
        ranges = Ranges.from_pairing(pairing, prefix).near(pairing[f"{prefix}active"], sides)
        return self._at(sides, ranges, x)

    def _at(self, sides: Interface, ranges: Ranges, x: Array) -> _Weighted:
        """Compute points, shapes and weighted gaps at the positions x (n_states, n_nodes, 2)."""
        points, ends = ranges.points(sides, x, self.rule), sides.slave.segments[ranges.slave]
        shapes = Shapes.standard(points)
        return _Weighted(ranges, points, shapes, ends, *integrals(shapes, points, ends, sides.n_slave_nodes))

    def _gaps(self, sides: Interface, ranges: Ranges, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ∫N_j and G_j (n_slave_nodes,) at x (n_nodes, 2); where nothing is covered they are zero and NaN."""
        weighted = self._at(sides, ranges, x[None])
        covered = weighted.areas[0] > UNCOVERED * own_lengths(sides, x if self.rule.current else sides.nodes)
        gaps = np.full(len(covered), np.nan)
        gaps[covered] = weighted.with_gap[0, covered] / weighted.areas[0, covered]
        return np.where(covered, weighted.areas[0], 0.0), gaps


def _find_cells(sides: Interface, x: FloatArray) -> Cells:
    """Return the cells of segments that meet at no more than 60°, at the positions x (n_nodes, 2)."""
    cells = Cells.find(sides, x, averaged=False)
    slave = np.diff(x[sides.slave.segments[cells.slave]], axis=1)[:, 0]
    master = np.diff(x[sides.master.segments[cells.master]], axis=1)[:, 0]
    sizes = np.linalg.norm(slave, axis=1) * np.linalg.norm(master, axis=1)
    return cells.select((slave * master).sum(axis=1) <= STEEPEST * sizes)


def _make_half_passes(interface: Interface) -> HalfPasses:
    """Return for each half pass its prefix, the interface in its roles, and the places of its positions in z."""
    positions = np.arange(interface.n_unknowns)
    swapped = interface.swap_roles()
    return (
        (PREFIXES[0], interface, positions),
        (PREFIXES[1], swapped, np.roll(positions, -2 * interface.n_slave_nodes)),
    )


def mortar_two_half_pass(*, penalty: float, area: str = "current", n: int = 2) -> TwoHalfPasses:
    """Mortar in two half passes: each surface weights its own gaps, and its pressures push its own body alone.

    It passes the flat patch test and covers an overhang, with Gauss points that know nothing of the nodes on the other
    side. Slave and master may be exchanged. Forces and moments balance as well as both surfaces see the same gap, which
    is not exactly: it fails where one surface is tilted against the other. It converges at soft penalties, and not at
    stiff ones where surfaces are not parallel, so it promises nothing there.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per length per length of penetration.
    area : str
        "current" or "reference": the configuration in which lengths are measured.
    n : int
        Number of Gauss points on the covered range of a segment, ≥ 2.

    References
    ----------
    Duong, De Lorenzis & Sauer, Comput. Methods Appl. Mech. Engrg 333 (2018), arXiv 1712.01179.
    """
    return TwoHalfPasses(
        Traits(
            passes_flat_patch=True,
            passes_normal_patch=True,
            passes_single_patch=True,
            passes_kinked_patch=True,
            covers_overhang=True,
            locks=True,
            tangent="exact",
            symmetric=False,
            conserves_force=False,
            conserves_moment=False,
            area="current" if choose("area", area, AREAS) else "reference",
            force_along="slave normal",
            local=True,
            unbiased=True,
            nodes_push=True,
            translation_stable=True,
            penalty="distributed",
            batched=True,
            takes_complex=True,
            takes_longdouble=TAKES_LONGDOUBLE,
            witnesses={
                "balance.force": "tilted",
                "balance.moment": "tilted",
                "symmetric": "offset-c",
                "stability.locking": "12 on 8, ε̂ = 1e8 E/h",
                "accuracy.wavy-curved": "upper slave, 100 E/h",
            },
            source=_SOURCE,
        ),
        check_penalty(penalty),
        Quadrature.gauss(max(2, check_count(n)), choose("area", area, AREAS)),
    )
