"""The mechanics of one elastic body: stiffness, condensation onto its contact boundary, and recovery of the inside.

scikit-fem gives meshes, shape functions and quadrature. The form of linear elasticity is contracted here in one step
over all cells, because a loop over pairs of shape functions takes longer than all the rest of a small scene.

Rule for the next editor: the stiffness knows nothing of any contact formulation, since its nodal forces judge them all.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np
import skfem
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import splu
from skfem.quadrature import get_quadrature

from contactverif.contract.arrays import FloatArray, IntArray, dense
from contactverif.contract.body import Body
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE, SPACE, unit_normals

# The numbers of condensed bodies and of scenes that are remembered: two formulations share those of 100 cases.
CACHE_SIZE, SCENES_SIZE = 256, 128
SHARED_SIZE = 64  # Number of factorised meshes that are remembered: loads, places and penalties share them.
DENSE_SHARE = 0.25  # From this share of entries on, a matrix of any size is factorised sooner if it is dense.
DENSE_LIMIT = 600  # Largest number of unknowns for which a dense matrix is factorised as fast as a sparse one.
# A pivot below this share of its diagonal entry is zero: a loose part leaves less than 1e2 u, a long thin bar 1e6 u.
_PIVOT_FLOOR = 2.0**-40
_RESISTANCE_FLOOR = 1e-9  # A rigid motion of the body's size that meets less resistance than this is free.
# A smallest resistance, squared, above this share of the largest is far from the floor and from roundoff.
_SAFE_RESISTANCE = 1e-6
# The matrix is symmetric and positive definite, so pivots lie on the diagonal and an ordering of A + Aᵀ fills less.
_SYMMETRIC = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
_AXES = "first", "second", "third"
_MOTION_FLOOR = 1e-6  # A smaller part of a free motion is not mentioned.
_MOTIONS = {
    PLANE: ("move along its first axis", "move along its second axis", "turn"),
    SPACE: tuple(f"{verb} {axis} axis" for verb in ("move along its", "turn about its") for axis in _AXES),
}


class _Matrices(NamedTuple):
    """The matrices that follow from mesh, material and supports of a body; loads have no part in them."""

    unknowns: IntArray  # (n,) The free components on the contact boundary.
    interior: IntArray  # All others that are free.
    whole: Any  # (dim × n_nodes, dim × n_nodes) The stiffness matrix.
    across: Any  # (n_interior, n) The part of it that couples the interior with the unknowns.
    # Returns the displacements of the interior under forces (n_interior,) or (n_interior, n_right).
    solve: Callable[[FloatArray], FloatArray]
    influence: Callable[[FloatArray], FloatArray]  # From the unknowns (n,) to their effect on the interior.
    condensed: FloatArray  # (n, n) The condensed stiffness, symmetric.
    gradients: FloatArray  # (n_cells, n_points, n_corners, dim): those of the shape functions, in the body's axes.


_NONE, _EMPTY = np.zeros(0, np.int64), np.zeros((0, 0))
_NOTHING = _NONE, _NONE, _EMPTY, _EMPTY, _EMPTY.dot, _EMPTY.dot, _EMPTY  # That is known of a rigid body.


@dataclass(frozen=True, slots=True, eq=False)
class CondensedBody:
    """A body condensed onto its contact boundary by `condense`. S q − g are the forces that contact must supply."""

    body: Body
    load: FloatArray  # (n,) The condensed load g, a force, of nodal forces and of imposed displacements.
    _particular: FloatArray  # (dim × n_nodes,): the displacements if all unknowns are 0.
    _matrices: _Matrices

    @property
    def unknowns(self) -> IntArray:
        """The free components (n,) on the contact boundary: dim × node + component, in the body's axes."""
        return self._matrices.unknowns

    @property
    def stiffness(self) -> FloatArray:
        """The condensed stiffness S (n, n), symmetric, force per length."""
        return self._matrices.condensed

    def displacements(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Return the displacements (n_nodes, dim) of all nodes, a length each, in global axes.

        `q` (n,) are the unknowns, and `factor` is the share of loads and imposed displacements.
        """
        u = factor * self._particular
        u[self._matrices.interior] += self._matrices.influence(q)
        u[self.unknowns] = q
        return u.reshape(self.body.nodes.shape) @ self.body.frame.T

    def stresses(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Return the stresses (n_cells, n_points, 3 or 6) at the Gauss points, in the body's axes.

        They are a force per length squared, positive in tension: along its axes, then shear, in the plane one, in space
        across the first, the second and the third axis. The arguments are those of `displacements`.
        """
        u = (self.displacements(q, factor) @ self.body.frame)[self.body.cells]  # (n_cells, n_corners, dim)
        gradient = np.einsum("eqad,eac->eqcd", self._matrices.gradients, u)
        normal = np.moveaxis(np.diagonal(gradient, axis1=-2, axis2=-1), -1, 0)
        shear = [gradient[..., i, j] + gradient[..., j, i] for i, j in _SHEARS[self.body.dim]]
        return np.stack([*normal, *shear], axis=-1) @ elasticity(self.body).T


# {dim: the axes between which each angle of shear is}
_SHEARS = {PLANE: ((0, 1),), SPACE: ((1, 2), (0, 2), (0, 1))}


def elasticity(body: Body) -> FloatArray:
    """Return the matrix from strains (along the axes, shear angles) to stresses: (3, 3) in plane strain, (6, 6)."""
    lame = body.young * body.poisson / ((1 + body.poisson) * (1 - 2 * body.poisson))
    shear = body.young / (2 * (1 + body.poisson))
    dim = body.dim
    matrix = shear * np.diag([*[2.0] * dim, *[1.0] * len(_SHEARS[dim])])
    matrix[:dim, :dim] += lame
    return matrix


def assemble_stiffness(body: Body) -> tuple[Any, FloatArray]:
    """Return K (dim × n_nodes, dim × n_nodes) and the shape functions' gradients, both in the body's axes.

    K is dense up to `DENSE_LIMIT` unknowns, else sparse. Gradients are (n_cells, n_points, n_corners, dim).
    """
    dim = body.dim
    reference, weights = _reference_cell(body.cells.shape[1], dim)  # (n_points, n_corners, dim), (n_points,)
    # Differences of nodes first: a cell far from the origin has the same stiffness to the last bit.
    corners = (body.nodes[body.cells] - body.nodes[body.cells[:, :1]]) @ body.frame  # (n_cells, n_corners, dim)
    jacobians = np.einsum("pad,eac->epcd", reference, corners)  # ∂x_c/∂X_d
    columns = np.moveaxis(jacobians, -1, 0)
    if dim == PLANE:  # Written out, so that another unit of length changes no bit.
        areas = (columns[0][..., 0] * columns[1][..., 1] - columns[1][..., 0] * columns[0][..., 1]) * weights
    else:
        areas = (np.cross(columns[0], columns[1]) * columns[2]).sum(axis=-1) * weights
    gradients = np.matmul(reference, np.linalg.inv(jacobians))
    n_cells, n_points, n_corners, _ = gradients.shape
    unit = np.zeros((n_cells, n_points, dim + len(_SHEARS[dim]), n_corners, dim))  # Strains of unit displacements.
    for axis in range(dim):
        unit[:, :, axis, :, axis] = gradients[..., axis]
    for row, (i, j) in enumerate(_SHEARS[dim], dim):
        unit[:, :, row, :, j], unit[:, :, row, :, i] = gradients[..., i], gradients[..., j]
    strains = unit.reshape(n_cells, n_points, -1, dim * n_corners)
    blocks = np.matmul(strains.swapaxes(2, 3), elasticity(body) @ strains * areas[..., None, None]).sum(axis=1)
    unknowns = (dim * body.cells[:, :, None] + np.arange(dim)).reshape(n_cells, -1)
    rows, columns = unknowns[:, :, None], unknowns[:, None, :]
    size = body.nodes.size
    if size <= DENSE_LIMIT:
        places = (rows * size + columns).ravel()
        return np.bincount(places, weights=blocks.ravel(), minlength=size * size).reshape(size, size), gradients
    rows, columns = np.broadcast_arrays(rows, columns)
    return sparse.csr_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)), gradients


@cache
def _reference_cell(corners: int, dim: int) -> tuple[FloatArray, FloatArray]:
    """Return gradients of the shape functions on scikit-fem's reference cell at its Gauss points, and weights."""
    element, order, numbers = _ELEMENTS[dim, corners]
    points, weights = get_quadrature(element.refdom, order)
    gradients = np.stack([element.lbasis(points, corner)[1] for corner in numbers])  # (n_corners, dim, n_points)
    return np.ascontiguousarray(gradients.transpose(2, 0, 1)), weights


# {(dim, corners): the element, the degree that its quadrature is exact for, and its number of each corner of a cell}
_ELEMENTS: dict[tuple[int, int], tuple[Any, int, Sequence[int]]] = {
    (PLANE, 3): (skfem.ElementTriP1(), 1, range(3)),
    (PLANE, 4): (skfem.ElementQuad1(), 2, range(4)),
    (SPACE, 4): (skfem.ElementTetP1(), 1, range(4)),
    (SPACE, 8): (skfem.ElementHex1(), 2, (7, 4, 1, 5, 6, 2, 0, 3)),
}


def free_on_contact(body: Body) -> IntArray:
    """Return the free components (n,) on the contact boundary: dim × node + component, in its axes, ascending."""
    nodes = body.contact_nodes
    components: IntArray = body.dim * nodes[:, None] + np.arange(body.dim)
    return components[~body.fixed[nodes]]


@lru_cache(maxsize=CACHE_SIZE)
def condense(body: Body) -> CondensedBody:
    """Condense a body onto the free components of its contact boundary.

    The answer is remembered, so that a body is condensed once. Bodies that differ in their loads, their imposed
    displacements or their place alone share one factorisation.
    """
    imposed = body.imposed.reshape(-1)
    if body.rigid:
        gradients = np.zeros((0, 1, body.cells.shape[1], body.dim))
        return CondensedBody(body, np.zeros(0), imposed, _Matrices(*_NOTHING, gradients))
    corners = body.nodes[body.cells] - body.nodes[body.cells[:, :1]]
    arrays = (corners, body.cells, body.fixed, body.contact_nodes, body.axis)
    key = (body.cells.shape, body.young, body.poisson, *(array.tobytes() for array in arrays))
    matrices = _factorise(_ElasticPart(key, body))
    forces = body.load.reshape(-1)
    if imposed.any():
        forces = forces - matrices.whole @ imposed
    response = matrices.solve(forces[matrices.interior])
    particular = imposed.copy()
    particular[matrices.interior] = response
    load = forces[matrices.unknowns] - matrices.across.T @ response
    return CondensedBody(body, load, particular, matrices)


@dataclass(frozen=True, slots=True)
class _ElasticPart:
    """An elastic body seen without its loads and its place: those of one key have the same matrices, bit by bit."""

    key: tuple[object, ...]  # The shape of each cell, material and supports.
    body: Body = field(compare=False)


@lru_cache(maxsize=SHARED_SIZE)
def _factorise(part: _ElasticPart) -> _Matrices:
    body = part.body
    unknowns = free_on_contact(body)
    free = ~body.fixed.reshape(-1)
    free[unknowns] = False
    interior = np.flatnonzero(free)
    whole, gradients = assemble_stiffness(body)
    inner = whole[interior]
    across, (solve, order) = inner[:, unknowns], _interior_solver(body, inner[:, interior])
    condensed = None if order is None else _last_block(whole, interior[order], unknowns)
    effect: FloatArray | None = None
    if condensed is None:
        effect = -solve(dense(across))
        condensed = dense(whole[unknowns][:, unknowns]) + across.T @ effect

    def influence(q: FloatArray) -> FloatArray:
        return -solve(across @ q) if effect is None else effect @ q

    return _Matrices(unknowns, interior, whole, across, solve, influence, (condensed + condensed.T) / 2, gradients)


def _last_block(whole: Any, first: IntArray, last: IntArray) -> FloatArray | None:
    """Return the Schur complement of the `last` components of a sparse stiffness, from its factors L and U.

    What is eliminated `first` stands in an order that fills little. A shift of the last diagonal keeps a body that can
    move regular; it is taken off again. The answer is None where SuperLU has changed the order of the last components.
    """
    places = np.concatenate([first, last])
    shift = np.where(np.arange(len(places)) < len(first), 0.0, whole.diagonal().max())
    matrix = sparse.csc_array(whole[places][:, places] + sparse.diags_array(shift))
    factors = splu(matrix, **_SYMMETRIC | {"permc_spec": "NATURAL"})
    end = np.arange(len(first), len(places))
    if not ((factors.perm_c[end] == end).all() and (factors.perm_r[end] == end).all()):
        return None
    return np.asarray((factors.L[end][:, end] @ factors.U[end][:, end]).toarray() - np.diag(shift[end]))


def forget_condensed() -> None:
    """Let go of all condensed bodies and their factors."""
    condense.cache_clear()
    _factorise.cache_clear()


def _interior_solver(body: Body, matrix: Any) -> tuple[Callable[[FloatArray], FloatArray], IntArray | None]:
    """Return a solver for forces on the interior, and the order (n_interior,) of elimination of a sparse matrix."""
    order = None
    if not matrix.shape[0]:
        return lambda forces: forces, order
    actual = "a part that hangs neither on a support nor on the contact boundary"
    loose_part = MisuseError(f"{body.name}: cells", actual, "one connected mesh, or supports for each part")
    if sparse.issparse(matrix):
        try:
            factors = splu(matrix.tocsc(), **_SYMMETRIC)
        except RuntimeError:  # The matrix is exactly singular.
            raise loose_part from None
        pivots, order = np.abs(factors.U.diagonal()[factors.perm_c]), np.argsort(factors.perm_c)
        solve: Callable[[FloatArray], FloatArray] = factors.solve
    else:
        factor, info = lapack.dpotrf(matrix, lower=1)
        if info != 0:
            raise loose_part
        pivots, solve = factor.diagonal() ** 2, lambda forces: lapack.dpotrs(factor, forces, lower=1)[0]
    if not (pivots > _PIVOT_FLOOR * matrix.diagonal()).all():
        raise loose_part
    return solve, order


def loose_modes(body: Body) -> list[str]:
    """Return the rigid motions of a body that neither its supports nor frictionless contact resist, in words.

    Contact resists a motion only if the motion has a component along the normal of a contact edge or face.
    """
    nodes, dim = body.nodes @ body.frame, body.dim
    centre, size = nodes.mean(axis=0), np.ptp(nodes, axis=0).max()
    offset, units = (nodes - centre) / size, np.broadcast_to(np.eye(dim), (len(nodes), dim, dim))
    if dim == PLANE:
        turns = np.column_stack([-offset[:, 1], offset[:, 0]])[:, :, None]
    else:
        turns = np.cross(units, offset[:, None, :]).swapaxes(1, 2)
    modes = np.concatenate([units, turns], axis=2)  # (n_nodes, dim, n_modes)
    normals = unit_normals(nodes[body.contact])
    pressed = np.einsum("fkim,fi->fkm", modes[body.contact], normals).reshape(-1, modes.shape[2])
    resisted = np.concatenate([modes[body.fixed], pressed])
    sizes = np.linalg.eigvalsh(resisted.T @ resisted)
    if sizes[0] > _SAFE_RESISTANCE * max(sizes[-1], 1.0):
        return []
    # The triangle of QR has the same singular values, and no more rows than motions, however many supports there are.
    _, sizes, motions = np.linalg.svd(np.linalg.qr(resisted, mode="r"), full_matrices=True)
    sizes = np.concatenate([sizes, np.zeros(len(motions) - len(sizes))])
    # Motions are numbers without dimension, of order 1: resistance below the floor is roundoff.
    free = motions[sizes <= _RESISTANCE_FLOOR * max(sizes.max(), 1.0)]
    parts = zip(_MOTIONS[dim], np.abs(free).T, strict=True)
    return [words for words, part in parts if part.max(initial=0.0) > _MOTION_FLOOR]
