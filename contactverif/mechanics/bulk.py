"""What an elastic body does under load: stiffness, condensation onto its contact boundary, and recovery of the inside.

scikit-fem gives meshes, shape functions and quadrature; the form of linear elasticity is contracted here in one go over
all cells, because a loop over pairs of shape functions takes longer than all the rest of a small scene.
The stiffness knows nothing of any contact formulation: its nodal forces judge them all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any, Literal

import numpy as np
import skfem
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import splu
from skfem.quadrature import get_quadrature

from contactverif.contract.arrays import FloatArray, IntArray, dense
from contactverif.contract.body import Body
from contactverif.contract.errors import MisuseError

CACHE_SIZE = 512  # condensed bodies, so that penalties and formulations of one run share them
DENSE_LIMIT = 600  # unknowns up to which a matrix without structure is as quick to factorise
_LEFT = 2.0**-40  # of a diagonal entry after elimination: less than 1e2 u of a loose part, 1e6 u of a long thin bar
_FREE = 1e-9  # of a rigid motion of the body's size: less resistance is none
_PART = 1e-6  # of a loose motion: a smaller part of it is not worth a word
_MODES = ("move along its first axis", "move along its second axis", "turn")


@dataclass(frozen=True, slots=True, eq=False)
class CondensedBody:
    """A body as its contact boundary feels it: S q − g are the forces that somebody else must bring.

    Attributes
    ----------
    body : Body
        Whose.
    unknowns : IntArray, shape (n,)
        Free components on the contact boundary, 2 × node + component in the body's axes.
    stiffness : FloatArray, shape (n, n)
        S, symmetric.
    load : FloatArray, shape (n,)
        g, of nodal forces and of imposed displacements.
    """

    body: Body
    unknowns: IntArray
    stiffness: FloatArray
    load: FloatArray
    _interior: IntArray
    _particular: FloatArray  # displacements (2 n_nodes,) where all unknowns are 0
    _influence: FloatArray  # of the unknowns on the interior (n_interior, n)
    _gradients: FloatArray  # (n_cells, n_points, n_corners, 2), in the body's axes

    def displacements(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Displacements (n_nodes, 2) in global axes at the unknowns q (n,), loads and supports × factor."""
        u = factor * self._particular
        u[self._interior] += self._influence @ q
        u[self.unknowns] = q
        displacements: FloatArray = u.reshape(-1, 2) @ self.body.frame.T
        return displacements

    def stresses(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Stresses (n_cells, n_points, 3) at the Gauss points: along, across and shear, in the body's axes."""
        u = (self.displacements(q, factor) @ self.body.frame)[self.body.cells]  # (n_cells, n_corners, 2)
        gradient = np.einsum("eqad,eac->eqcd", self._gradients, u)
        strain = np.stack(
            [gradient[..., 0, 0], gradient[..., 1, 1], gradient[..., 0, 1] + gradient[..., 1, 0]], axis=-1
        )
        stresses: FloatArray = strain @ elasticity(self.body).T
        return stresses


def elasticity(body: Body) -> FloatArray:
    """The matrix (3, 3) from strains (along, across, shear angle) to stresses in plane strain."""
    lame = body.young * body.poisson / ((1 + body.poisson) * (1 - 2 * body.poisson))
    shear = body.young / (2 * (1 + body.poisson))
    return np.array([[lame + 2 * shear, lame, 0], [lame, lame + 2 * shear, 0], [0, 0, shear]])


def stiffness(body: Body) -> tuple[Any, FloatArray]:
    """K (2 n_nodes, 2 n_nodes) in the body's axes, and the gradients of shape functions at the Gauss points.

    K is an array where that is small, else a sparse one.
    """
    gradients, areas = _shapes(body)  # (n_cells, n_points, n_corners, 2), (n_cells, n_points)
    n_cells, n_points, n_corners, _ = gradients.shape
    unit = np.zeros((n_cells, n_points, 3, n_corners, 2))  # strains of unit displacements
    unit[:, :, 0, :, 0] = unit[:, :, 2, :, 1] = gradients[..., 0]
    unit[:, :, 1, :, 1] = unit[:, :, 2, :, 0] = gradients[..., 1]
    strains = unit.reshape(n_cells, n_points, 3, 2 * n_corners)
    blocks = np.matmul(strains.swapaxes(2, 3), elasticity(body) @ strains * areas[..., None, None]).sum(axis=1)
    unknowns = (2 * body.cells[:, :, None] + np.arange(2)).reshape(n_cells, -1)
    rows, columns = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
    size = 2 * len(body.nodes)
    if size <= DENSE_LIMIT:
        places = (rows * size + columns).ravel()
        return np.bincount(places, weights=blocks.ravel(), minlength=size * size).reshape(size, size), gradients
    return sparse.csr_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)), gradients


def _shapes(body: Body) -> tuple[FloatArray, FloatArray]:
    """Gradients of the shape functions in the body's axes, and weights × areas, at the Gauss points of each cell."""
    reference, weights = _reference(body.cells.shape[1])  # (n_points, n_corners, 2), (n_points,)
    corners = (body.nodes @ body.frame)[body.cells]  # (n_cells, n_corners, 2)
    jacobians = np.einsum("pad,eac->epcd", reference, corners)  # ∂x_c/∂X_d
    (a, b), (c, d) = jacobians.transpose(2, 3, 0, 1)  # written out, so that another unit of length changes no bit
    areas = (a * d - b * c) * weights
    return np.matmul(reference, np.linalg.inv(jacobians)), areas


@cache
def _reference(corners: int) -> tuple[FloatArray, FloatArray]:
    """Gradients of the shape functions on scikit-fem's reference cell at its Gauss points, and their weights."""
    element, order = (skfem.ElementTriP1(), 1) if corners == 3 else (skfem.ElementQuad1(), 2)
    points, weights = get_quadrature(element.refdom, order)
    gradients = np.stack([element.lbasis(points, corner)[1] for corner in range(corners)])  # (n_corners, 2, n_points)
    return np.ascontiguousarray(gradients.transpose(2, 0, 1)), weights


def free_on_contact(body: Body) -> IntArray:
    """Free components (n,) on the contact boundary, 2 × node + component in the body's axes, ascending."""
    on_contact = np.zeros(body.fixed.shape, bool)
    on_contact[body.contact_nodes] = True
    return np.flatnonzero((on_contact & ~body.fixed).reshape(-1))


@lru_cache(maxsize=CACHE_SIZE)
def condense(body: Body) -> CondensedBody:
    """The body condensed onto the free components of its contact boundary; once for each body.

    Raises
    ------
    MisuseError
        If a part of the body hangs on nothing even while its contact boundary is held.
    """
    unknowns = free_on_contact(body)
    free = ~body.fixed.reshape(-1)
    free[unknowns] = False
    interior = np.flatnonzero(free)
    imposed = body.imposed.reshape(-1)
    if body.rigid:
        none = np.zeros((0, 0))
        return CondensedBody(body, unknowns, none, np.zeros(0), interior, imposed, none, np.zeros((0, 1, 4, 2)))
    matrix, gradients = stiffness(body)
    forces = body.load.reshape(-1) - matrix @ imposed
    across = matrix[interior][:, unknowns]
    solved = _solved(body, matrix[interior][:, interior], np.column_stack([dense(across), forces[interior]]))
    influence, own = -solved[:, :-1], solved[:, -1]
    particular = imposed.copy()
    particular[interior] = own
    condensed = dense(matrix[unknowns][:, unknowns]) + across.T @ influence
    load = forces[unknowns] - across.T @ own
    return CondensedBody(
        body, unknowns, (condensed + condensed.T) / 2, load, interior, particular, influence, gradients
    )


def _solved(body: Body, matrix: Any, right: FloatArray) -> FloatArray:
    """The interior's answer (n_interior, …) to unit displacements of the unknowns and to loads."""
    if not len(right):
        return right
    if sparse.issparse(matrix):
        try:
            factors = splu(matrix.tocsc())
        except RuntimeError:  # scipy's word for an exactly singular matrix
            raise _loose(body) from None
        left = np.abs(factors.U.diagonal()[factors.perm_c])
        answer: FloatArray = factors.solve(right)
    else:
        factor, info = lapack.dpotrf(matrix, lower=1)
        if info != 0:
            raise _loose(body)
        left = factor.diagonal() ** 2
        answer, _ = lapack.dpotrs(factor, right, lower=1)
    if not (left > _LEFT * matrix.diagonal()).all():
        raise _loose(body)
    return answer


def _loose(body: Body) -> MisuseError:
    found = "a part that hangs neither on a support nor on the contact boundary"
    return MisuseError(f"{body.name}: cells", found, "one connected mesh, or supports for each part")


def loose_modes(body: Body) -> list[str]:
    """How the body can move as a rigid one though neither its supports nor contact without friction resist, in words.

    A motion that has no component along the normal of any contact edge is resisted by no contact.
    """
    nodes = body.nodes @ body.frame
    centre, size = nodes.mean(axis=0), np.ptp(nodes, axis=0).max()
    offset = (nodes - centre) / size
    modes = np.zeros((*nodes.shape, 3))
    modes[:, 0, 0] = modes[:, 1, 1] = 1
    modes[:, 0, 2], modes[:, 1, 2] = -offset[:, 1], offset[:, 0]
    along = nodes[body.contact[:, 1]] - nodes[body.contact[:, 0]]
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    pressed = [np.einsum("ec,ecm->em", normals, modes[body.contact[:, end]]) for end in (0, 1)]
    resisted = np.concatenate([modes[body.fixed], *pressed])
    _, sizes, motions = np.linalg.svd(resisted, full_matrices=True)
    sizes = np.concatenate([sizes, np.zeros(3 - len(sizes))])
    # motions are numbers without dimension, of order 1: what resists by less than _FREE resists by roundoff
    free = motions[sizes <= _FREE * max(sizes.max(), 1.0)]
    return [words for words, part in zip(_MODES, free.T, strict=True) if len(free) and np.abs(part).max() > _PART]


def body_from_mesh(
    mesh: Any,
    *,
    contact: str,
    supports: Mapping[str, Literal["along", "across", "both"]],
    young: float = 1.0,
    poisson: float = 0.0,
    moved: Mapping[str, tuple[float, float]] | None = None,
    pressures: Mapping[str, float] | None = None,
    name: str = "mesh",
) -> Body:
    """A body from a scikit-fem mesh of first-order triangles or quadrilaterals with named boundaries.

    Parameters
    ----------
    mesh : Any
        `skfem.MeshTri` or `skfem.MeshQuad`.
    contact : str
        The boundary that may touch something.
    supports : Mapping[str, Literal['along', 'across', 'both']]
        {boundary: which components are fixed}, "along" the x-axis, "across" it, or both.
    moved : Mapping[str, tuple[float, float]] | None
        {boundary of supports: displacement (2,)} where it is not 0.
    pressures : Mapping[str, float] | None
        {boundary: pressure}, towards the body.

    Raises
    ------
    MisuseError
        If the mesh has no such boundary, or as `Body` does.
    """
    if getattr(mesh, "elem", None) not in (skfem.ElementTriP1, skfem.ElementQuad1):
        raise MisuseError("mesh", f"a {type(mesh).__name__}", "a MeshTri or a MeshQuad of first order")
    points, cells = np.asarray(mesh.p).T, np.asarray(mesh.t).T
    corners = points[cells]
    cells = np.where((_signed_areas(corners) < 0)[:, None], cells[:, ::-1], cells)
    if not isinstance(supports, Mapping):
        raise MisuseError("supports", f"a {type(supports).__name__}", "{boundary: 'along', 'across' or 'both'}")
    edges = {tag: _edges(mesh, cells, tag) for tag in dict.fromkeys([contact, *supports, *(pressures or {})])}
    fixed, imposed = np.zeros(points.shape, bool), np.zeros(points.shape)
    for tag, which in supports.items():
        components = {"along": [0], "across": [1], "both": [0, 1]}.get(which)
        if components is None:
            raise MisuseError(f"supports[{tag!r}]", repr(which), "'along', 'across' or 'both'")
        held, move = np.unique(edges[tag]), _moved(tag, (moved or {}).get(tag, (0.0, 0.0)), components)
        for component in components:
            fixed[held, component] = True
            imposed[held, component] = move[component]
    if loose := set(moved or {}) - set(supports):
        raise MisuseError(f"moved[{min(loose)!r}]", "no supports there", "a boundary that supports name")
    load = np.zeros(points.shape)
    for tag, pressure in (pressures or {}).items():
        if np.ndim(pressure) != 0 or np.asarray(pressure).dtype.kind not in "fiu":
            raise MisuseError(f"pressures[{tag!r}]", repr(pressure), "a number")
        first, second = edges[tag].T
        along = points[second] - points[first]
        for end in (first, second):
            np.add.at(load, end, pressure / 2 * np.column_stack([-along[:, 1], along[:, 0]]))
    return Body(points, cells, edges[contact], young, poisson, fixed, imposed, load, name=name)


def _moved(tag: str, move: Any, components: list[int]) -> FloatArray:
    """The displacement (2,) of a boundary, 0 where nothing is fixed."""
    try:
        displacement = np.array(move, dtype=np.float64)
    except (TypeError, ValueError):
        displacement = np.zeros(0)
    if displacement.shape != (2,):
        raise MisuseError(f"moved[{tag!r}]", repr(move), "two numbers, along and across")
    if displacement[[component for component in (0, 1) if component not in components]].any():
        raise MisuseError(f"moved[{tag!r}]", "a displacement of a free component", "0 where nothing is fixed")
    return displacement


def _signed_areas(corners: FloatArray) -> FloatArray:
    following = np.roll(corners, -1, axis=1)
    areas: FloatArray = (corners[..., 0] * following[..., 1] - corners[..., 1] * following[..., 0]).sum(axis=1) / 2
    return areas


def _edges(mesh: Any, cells: IntArray, tag: str) -> IntArray:
    """The edges (n, 2) of a named boundary, each with its cell on the left."""
    tags = getattr(mesh, "boundaries", None) or {}
    if tag not in tags:
        there = f"one of {', '.join(sorted(tags))}" if tags else "a mesh with named boundaries (mesh.with_boundaries)"
        raise MisuseError("mesh", f"no boundary {tag!r}", there)
    if not len(tags[tag]):
        raise MisuseError("mesh", f"no edges on boundary {tag!r}", "a boundary that has some")
    wanted = {tuple(sorted(edge)) for edge in np.asarray(mesh.facets).T[np.asarray(tags[tag])].tolist()}
    following = np.roll(cells, -1, axis=1)
    every = np.stack([cells, following], axis=-1).reshape(-1, 2).tolist()
    return np.array([edge for edge in every if tuple(sorted(edge)) in wanted], dtype=np.int64).reshape(-1, 2)
