"""Mutants with a wrong tangent, or numbers with a hidden unit in solving.

One entry, small blocks, the pattern, large problems; matrices of another iterate; what is small in a unit.
"""

import zlib

import numpy as np
from handles import HidesNumbers, WrongTangent

import contactverif_nts
from contactverif import Pairing
from zoo.making import BALANCED, PLANE, add, answers, mutant
from zoo.on_strips import ByDifferences

DIRECTIONAL, SPARSITY, LONG = "tangent.directional", "tangent.sparsity", "tangent.long"
UNITS = "newton.units"
GRADES = (2, 4, 6, 8)  # One entry is off by 10 to minus these powers of the largest entry of its block.
MANY = 100  # A problem with more segments than this on one side is large.


def _change_matrix(name, caught_by, base=BALANCED, into=PLANE):
    """Decorate `change(interface, matrix)`, which changes a dense tangent in place or returns another one."""

    def decorate(change):
        def tangent(right, interface, pairing, z):
            matrix = right(interface, pairing, z).toarray()
            other = change(interface, matrix)
            return matrix if other is None else other

        add(name, caught_by, answers("tangent", tangent, base), into)
        return change

    return decorate


def _is_large(interface):
    return max(len(interface.slave), len(interface.master)) > MANY


def _blocks(matrix):
    """Return a view (n_nodes, n_nodes, 2, 2) of the blocks of K."""
    n = len(matrix) // 2
    return matrix.reshape(n, 2, n, 2).transpose(0, 2, 1, 3)


def _sizes(matrix):
    return np.abs(_blocks(matrix)).max(axis=(2, 3))


def _scale(right, interface, pairing, z):
    return (1 + 1e-4) * right(interface, pairing, z)


add("real numbers in a handle", DIRECTIONAL, HidesNumbers)
add("wrong tangent behind a handle", DIRECTIONAL, WrongTangent)
add("differences off by 1e-4, stated to 1e-8", SPARSITY, answers("tangent", _scale, ByDifferences))
_change_matrix("tangent symmetrised", DIRECTIONAL)(lambda interface, k: (k + k.T) / 2)


def _spoil_entry(power):
    """Put an error into one entry of the block of a slave node with itself, in the middle of a large interface."""

    def spoil(interface, matrix):
        if _is_large(interface):
            node = interface.slave.segments[interface.slave.chain_order[len(interface.slave) // 2], 0]
            _blocks(matrix)[node, node, 0, 1] += 10.0**-power * _sizes(matrix)[node, node]

    return spoil


for _power in GRADES:
    _change_matrix(f"one entry off by 1e-{_power} of its block, above 100 segments", LONG)(_spoil_entry(_power))
_change_matrix("one entry off by 1e-6 in springs at nodes, above 100 segments", LONG, contactverif_nts.nts)(
    _spoil_entry(6)
)


@_change_matrix("stiffness of a master node wrong above 100 segments", LONG)
def _(interface, matrix):
    """Forget how the last master nodes of a large interface feel one another."""
    if _is_large(interface):
        _blocks(matrix)[-2:, -2:] = 0.0
        node = max(interface.n_slave_nodes, interface.n_nodes - MANY // 2)
        _blocks(matrix)[node, node] *= 1.5


@_change_matrix("one entry of a tiny block off by 1e-6", SPARSITY)
def _(interface, matrix):
    """Put an error of 1e-6 into an entry of the smallest block that is below 1e-4 of its row, and no roundoff."""
    sizes = _sizes(matrix)
    shares = sizes / np.maximum(sizes.max(axis=1, keepdims=True), np.finfo(float).tiny)
    shares[(shares < 1e-7) | (shares > 1e-4)] = np.inf
    row, column = np.unravel_index(shares.argmin(), shares.shape)
    if np.isfinite(shares[row, column]):
        _blocks(matrix)[row, column, 1, 0] += 1e-6 * sizes[row, column]


@_change_matrix("tiny blocks off by 1e-6, up to 100 segments", SPARSITY)
def _(interface, matrix):
    """Make blocks between 1e-7 and 1e-4 of their row too large by 1e-6, whatever the axes and numbers are.

    `tangent.long` looks at the blocks of large interfaces, so these are right.
    """
    if not _is_large(interface):
        blocks = _blocks(matrix)
        sizes = np.sqrt((blocks**2).sum(axis=(2, 3)))
        rows = sizes.max(axis=1, keepdims=True)
        blocks[(sizes > 1e-7 * rows) & (sizes < 1e-4 * rows)] *= 1 + 1e-6


@_change_matrix("sign of small blocks", SPARSITY)
def _(interface, matrix):
    sizes = _sizes(matrix)
    small = (sizes > 0) & (sizes < 1e-3 * sizes.max(axis=1, keepdims=True))
    _blocks(matrix)[small] *= -1


@_change_matrix("blocks of two master nodes off by 1e-5", SPARSITY)
def _(interface, matrix):
    n = interface.n_slave_nodes
    blocks = _blocks(matrix)[n:, n:]
    blocks[~np.eye(len(blocks), dtype=bool)] *= 1 + 1e-5


@_change_matrix("entries between master nodes from the mesh alone", SPARSITY)
def _(interface, matrix):
    """Allot the entries between master nodes by neighbours on a segment, and no others."""
    n = interface.n_slave_nodes
    allotted = np.eye(interface.n_nodes, dtype=bool)
    first, second = interface.master.segments.T
    allotted[first, second] = allotted[second, first] = True
    _blocks(matrix)[n:, n:][~allotted[n:, n:]] = 0.0


@mutant("tangent kept from the first iterate", "newton.order", "tangent", memory=dict)
def _(memory, right, interface, pairing, z):
    """Use the matrix of the first iterate on a mesh for all others: modified Newton by accident."""
    if memory.get("interface") is not interface:
        memory.update(interface=interface, tangent=right(interface, pairing, z))
    return memory["tangent"]


@mutant("noise of 1e-6 in the tangent", "objectivity", "tangent")
def _(right, interface, pairing, z):
    """Change each tangent by other numbers for each state: it would pass for a kink if it were asked itself."""
    matrix = np.array(right(interface, pairing, z).toarray())
    random = np.random.default_rng(zlib.crc32(z.tobytes()))
    return matrix * (1 + 1e-6 * random.uniform(-1, 1, matrix.shape))


_change_matrix("small stiffness on the diagonal of the tangent", UNITS)(
    lambda interface, matrix: matrix + 1e-9 * np.eye(len(matrix))
)
# In newtons and millimetres, to save places in the matrix.
_change_matrix("small entries of the tangent dropped", UNITS)(
    lambda interface, matrix: np.where(np.abs(matrix) < 1e-3, 0.0, matrix)
)


@mutant("active above an absolute pressure", UNITS, "pair", contactverif_nts.vts_me)
def _(right, interface, z):
    """Count a point as active only above a small pressure; lengths alone do not change a pressure."""
    pairing = right(interface, z)
    pressed = right.__self__.contact_points(interface, pairing, z).pressure > 1e-9
    return Pairing({**pairing, "active": pairing["active"] & pressed})


def _encodes_numbers(*, penalty):
    """Store ξ and the area as bits in the pairing: they are frozen with it, and no difference shows a forgotten Δξ."""
    inner = contactverif_nts.vts_me(penalty=penalty)

    def bits(values):
        return np.unpackbits(np.ascontiguousarray(values, float).view(np.uint8)).astype(bool)

    class Encoded:
        traits = inner.traits.revise(takes_complex=False, batched=False)

        def pair(self, interface, z):
            pairing = inner.pair(interface, z)
            points = inner.contact_points(interface, pairing, z)
            return {**pairing, "xi": bits(points.xi), "area": bits(points.weight)}

        def residual(self, interface, pairing, z):
            x, forces = z.reshape(-1, 2), np.zeros_like(z).reshape(-1, 2)
            xi, area = (np.packbits(pairing[name]).view(float) for name in ("xi", "area"))
            for point in np.flatnonzero(pairing["active"]):
                a, b = interface.slave.segments[pairing["segment"][point]]
                node_1, node_2 = interface.master.segments[pairing["master"][point]]
                c = inner.c[pairing["slot"][point]]
                t = (x[node_2] - x[node_1]) / np.linalg.norm(x[node_2] - x[node_1])
                normal = np.array([t[1], -t[0]])
                v = (1 - c) / 2 * x[a] + (1 + c) / 2 * x[b]
                force = penalty * ((v - x[node_1]) @ normal) * area[point] * normal
                shares = ((a, (1 - c) / 2), (b, (1 + c) / 2), (node_1, xi[point] - 1), (node_2, -xi[point]))
                for node, share in shares:
                    forces[node] += share * force
            return forces.reshape(-1)

        def tangent(self, interface, pairing, z):
            columns, others = (
                [self.residual(interface, pairing, z + step * d) for d in np.eye(z.size)] for step in (2e-6, -2e-6)
            )
            return (np.column_stack(columns) - np.column_stack(others)) / 4e-6

    return Encoded()


add("numbers encoded in the pairing", DIRECTIONAL, _encodes_numbers)
