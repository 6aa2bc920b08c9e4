"""The directions along which a tangent is compared with differences: random ones, regions, and where it was wrong.

A region is the nodes of one chain, or all multipliers. A defect that is small beside the rest of the matrix stands out
where only its region moves.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csgraph, csr_array

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Surface
from contactverif_properties.shared.directions import random_directions

# Combinations of directions that are shorter than this share s of the longest are left out. A central difference is
# exact to u^(2/3), and its noise grows by 1/s as the combination is made as long as the others. Both are equal at
# s = u^(1/3): what is left out is no larger than the noise of what stays.
_SMALLEST_SHARE = UNIT_ROUNDOFF ** (1 / 3)


def first_directions(case: Case, n_random: int) -> FloatArray:
    """Return random directions that move all unknowns, then one for each chain and one for the multipliers.

    Parameters
    ----------
    case : Case
        The case, with its multipliers if any.
    n_random : int
        The number of directions that move all unknowns.

    Returns
    -------
    FloatArray, shape (n_directions, n_unknowns + n_multipliers)
        Entries in [−1, 1]; the largest of each direction is ±1.
    """
    regions = _regions(case)
    moves = random_directions(case.seed, n_random + len(regions), case.z.size)
    local = np.zeros((len(regions), case.z.size))
    for number, unknowns in enumerate(regions):
        part = moves[n_random + number, unknowns]
        local[number, unknowns] = part / np.abs(part).max()
    return np.vstack([moves[:n_random], local])


def defect_directions(directions: FloatArray, defects: FloatArray) -> FloatArray:
    """Return the largest defect as a direction, and the leading singular direction of what maps one to the other.

    Parameters
    ----------
    directions : FloatArray, shape (n_directions, n)
        Directions d.
    defects : FloatArray, shape (n_directions, n)
        The tangent times d, minus the difference quotient along d.

    Returns
    -------
    FloatArray, shape (2, n) or (0, n)
        Two directions whose largest entry is ±1; none where there is no defect. The singular direction is the one in
        the span of `directions` with the largest defect for its length.
    """
    worst = defects[np.abs(defects).max(axis=1).argmax()]
    if not worst.any():
        return np.empty((0, directions.shape[1]))
    basis, sizes, weights = np.linalg.svd(directions.T, full_matrices=False)
    spanned = sizes > _SMALLEST_SHARE * sizes[0]  # There may be more directions than unknowns.
    on_basis = defects.T @ (weights[spanned].T / sizes[spanned])  # The map on the basis, (n, n_spanned).
    singular = basis[:, spanned] @ np.linalg.svd(on_basis, full_matrices=False)[2][0]
    both = np.array([worst, singular])
    scaled: FloatArray = both / np.abs(both).max(axis=1, keepdims=True)
    return scaled


def _regions(case: Case) -> list[IntArray]:
    """Return the unknowns of each chain, and those of all multipliers."""
    nodes = [chain for side in (case.interface.slave, case.interface.master) for chain in _chains(side)]
    regions = [np.sort(np.concatenate([2 * chain, 2 * chain + 1])) for chain in nodes]
    if case.n_multipliers:
        regions.append(np.arange(case.interface.n_unknowns, case.z.size))
    return regions


def _chains(surface: Surface) -> list[IntArray]:
    """Return the nodes of each chain of a surface."""
    n_nodes = int(surface.segments.max()) + 1
    links = csr_array((np.ones(len(surface)), tuple(surface.segments.T)), shape=(n_nodes, n_nodes))
    _, label = csgraph.connected_components(links, directed=False)
    nodes = surface.nodes
    return [nodes[label[nodes] == number] for number in np.unique(label[nodes])]
