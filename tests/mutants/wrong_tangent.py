"""Mutants with a right residual and a wrong tangent: one entry, small blocks, the pattern, and large problems."""

from collections.abc import Callable
from typing import Any

import numpy as np
from handles import HidesNumbers, WrongTangent
from mutate import Mutant, wrap

import contactverif_nts

DIRECTIONAL, SPARSITY, LONG = "tangent.directional", "tangent.sparsity", "tangent.long"
GRADES = (2, 4, 6, 8)  # One entry is off by 10 to minus these powers of the largest entry of its block.
MANY = 100  # A problem with more segments than this on one side is large.


def _change_tangent(change: Callable[[Any, Any], None]) -> Callable[..., Any]:
    """Return the factory of the balanced VTS-PPT with a change of its tangent; `change` gets the interface and K."""

    def tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        matrix = right(interface, pairing, z).toarray()
        change(interface, matrix)
        return matrix

    return lambda *, penalty: wrap(penalty, tangent=tangent)


def _is_large(interface: Any) -> bool:
    return max(len(interface.slave), len(interface.master)) > MANY


def _blocks(matrix: Any) -> Any:
    """Return a view (n_nodes, n_nodes, 2, 2) of the blocks of K."""
    n = len(matrix) // 2
    return matrix.reshape(n, 2, n, 2).transpose(0, 2, 1, 3)


def _sizes(matrix: Any) -> Any:
    return np.abs(_blocks(matrix)).max(axis=(2, 3))


def _spoil_entry(power: int, make: Any = contactverif_nts.vts_ppt_balanced) -> Callable[..., Any]:
    """Put an error into one entry of the block of a slave node with itself, in the middle of a large interface."""

    def tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        matrix = right(interface, pairing, z).toarray()
        if _is_large(interface):
            node = interface.slave.segments[interface.slave.chain_order[len(interface.slave) // 2], 0]
            _blocks(matrix)[node, node, 0, 1] += 10.0**-power * _sizes(matrix)[node, node]
        return matrix

    return lambda *, penalty: wrap(penalty, make, tangent=tangent)


def _one_tiny_entry(interface: Any, matrix: Any) -> None:
    """Put an error of 1e-6 into an entry of the smallest block that is below 1e-4 of its row, and no roundoff."""
    sizes = _sizes(matrix)
    shares = sizes / np.maximum(sizes.max(axis=1, keepdims=True), np.finfo(float).tiny)
    shares[(shares < 1e-7) | (shares > 1e-4)] = np.inf
    row, column = np.unravel_index(shares.argmin(), shares.shape)
    if np.isfinite(shares[row, column]):
        _blocks(matrix)[row, column, 1, 0] += 1e-6 * sizes[row, column]


def _tiny_blocks(interface: Any, matrix: Any) -> None:
    """Make blocks between 1e-7 and 1e-4 of their row too large by 1e-6, whatever the axes and numbers are.

    `tangent.long` looks at the blocks of large interfaces, so these are right.
    """
    if _is_large(interface):
        return
    blocks = _blocks(matrix)
    sizes = np.sqrt((blocks**2).sum(axis=(2, 3)))
    rows = sizes.max(axis=1, keepdims=True)
    blocks[(sizes > 1e-7 * rows) & (sizes < 1e-4 * rows)] *= 1 + 1e-6


def _small_signs(interface: Any, matrix: Any) -> None:
    """Turn the sign of all blocks that are small in their row."""
    sizes = _sizes(matrix)
    small = (sizes > 0) & (sizes < 1e-3 * sizes.max(axis=1, keepdims=True))
    _blocks(matrix)[small] *= -1


def _master_blocks(interface: Any, matrix: Any) -> None:
    """Make the blocks of a master node with another one too large by 1e-5."""
    n = interface.n_slave_nodes
    blocks = _blocks(matrix)[n:, n:]
    blocks[~np.eye(len(blocks), dtype=bool)] *= 1 + 1e-5


def _mesh_pattern(interface: Any, matrix: Any) -> None:
    """Allot the entries between master nodes from the mesh alone: neighbours on a segment, and no others."""
    n = interface.n_slave_nodes
    allotted = np.eye(interface.n_nodes, dtype=bool)
    first, second = interface.master.segments.T
    allotted[first, second] = allotted[second, first] = True
    _blocks(matrix)[n:, n:][~allotted[n:, n:]] = 0.0


def _rows_behind(interface: Any, matrix: Any) -> None:
    """Forget how the last master nodes of a large interface feel one another."""
    if _is_large(interface):
        _blocks(matrix)[-2:, -2:] = 0.0
        node = max(interface.n_slave_nodes, interface.n_nodes - MANY // 2)
        _blocks(matrix)[node, node] *= 1.5


MUTANTS = (
    Mutant("real numbers in a handle", DIRECTIONAL, HidesNumbers),
    Mutant("wrong tangent behind a handle", DIRECTIONAL, WrongTangent),
    *(
        Mutant(f"one entry off by 1e-{power} of its block, above 100 segments", LONG, _spoil_entry(power))
        for power in GRADES
    ),
    Mutant(
        "one entry off by 1e-6 in springs at nodes, above 100 segments", LONG, _spoil_entry(6, contactverif_nts.nts)
    ),
    Mutant("stiffness of a master node wrong above 100 segments", LONG, _change_tangent(_rows_behind)),
    Mutant("one entry of a tiny block off by 1e-6", SPARSITY, _change_tangent(_one_tiny_entry)),
    Mutant("tiny blocks off by 1e-6, up to 100 segments", SPARSITY, _change_tangent(_tiny_blocks)),
    Mutant("sign of small blocks", SPARSITY, _change_tangent(_small_signs)),
    Mutant("blocks of two master nodes off by 1e-5", SPARSITY, _change_tangent(_master_blocks)),
    Mutant("entries between master nodes from the mesh alone", SPARSITY, _change_tangent(_mesh_pattern)),
)
