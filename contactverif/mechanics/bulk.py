"""The mechanics of one elastic body: stiffness, condensation onto its contact boundary, and recovery of the inside.

scikit-fem gives meshes, shape functions and quadrature. The form of linear elasticity is contracted here in one step
over all cells, because a loop over pairs of shape functions takes longer than all the rest of a small scene.

Rule for the next editor: the stiffness knows nothing of any contact formulation, since its nodal forces judge them all.
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

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray, dense
from contactverif.contract.body import Body
from contactverif.contract.errors import MisuseError

CACHE_SIZE = 512  # Number of condensed bodies that are remembered: penalties and formulations of one run share them.
DENSE_LIMIT = 600  # Largest number of unknowns for which a dense matrix is factorised as fast as a sparse one.
# A pivot below this share of its diagonal entry is zero: a loose part leaves less than 1e2 u, a long thin bar 1e6 u.
_PIVOT_FLOOR = 2.0**-40
_RESISTANCE_FLOOR = 1e-9  # A rigid motion of the body's size that meets less resistance than this is free.
_MOTION_FLOOR = 1e-6  # A smaller part of a free motion is not mentioned.
_MOTIONS = ("move along its first axis", "move along its second axis", "turn")


@dataclass(frozen=True, slots=True, eq=False)
class CondensedBody:
    """A body condensed onto its contact boundary. S q − g are the forces that contact must supply.

    `condense` makes one.

    Attributes
    ----------
    body : Body
        The body.
    unknowns : IntArray, shape (n,)
        The free components on the contact boundary: 2 × node + component, in the body's axes.
    stiffness : FloatArray, shape (n, n)
        The condensed stiffness S, symmetric, force per length.
    load : FloatArray, shape (n,)
        The condensed load g, a force, of nodal forces and of imposed displacements.
    """

    body: Body
    unknowns: IntArray
    stiffness: FloatArray
    load: FloatArray
    _interior: IntArray
    _particular: FloatArray  # (2 n_nodes,): the displacements if all unknowns are 0.
    _influence: FloatArray  # (n_interior, n): the effect of the unknowns on the interior.
    _gradients: FloatArray  # (n_cells, n_points, n_corners, 2): those of the shape functions, in the body's axes.

    def displacements(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Return the displacements of all nodes.

        Parameters
        ----------
        q : FloatArray, shape (n,)
            The unknowns, a length each.
        factor : float
            The share of loads and imposed displacements.

        Returns
        -------
        FloatArray, shape (n_nodes, 2)
            The displacements, a length each, in global axes.
        """
        u = factor * self._particular
        u[self._interior] += self._influence @ q
        u[self.unknowns] = q
        displacements: FloatArray = u.reshape(-1, 2) @ self.body.frame.T
        return displacements

    def stresses(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Return the stresses at the Gauss points.

        Parameters
        ----------
        q : FloatArray, shape (n,)
            The unknowns, a length each.
        factor : float
            The share of loads and imposed displacements.

        Returns
        -------
        FloatArray, shape (n_cells, n_points, 3)
            Normal stress along the first axis, normal stress across it, and shear stress, in the body's axes; force per
            length squared, positive in tension.
        """
        u = (self.displacements(q, factor) @ self.body.frame)[self.body.cells]  # (n_cells, n_corners, 2)
        gradient = np.einsum("eqad,eac->eqcd", self._gradients, u)
        strain = np.stack(
            [gradient[..., 0, 0], gradient[..., 1, 1], gradient[..., 0, 1] + gradient[..., 1, 0]], axis=-1
        )
        stresses: FloatArray = strain @ elasticity(self.body).T
        return stresses


def elasticity(body: Body) -> FloatArray:
    """Return the matrix (3, 3) from strains (along, across, shear angle) to stresses in plane strain."""
    lame = body.young * body.poisson / ((1 + body.poisson) * (1 - 2 * body.poisson))
    shear = body.young / (2 * (1 + body.poisson))
    return np.array([[lame + 2 * shear, lame, 0], [lame, lame + 2 * shear, 0], [0, 0, shear]])


def assemble_stiffness(body: Body) -> tuple[Any, FloatArray]:
    """Assemble the stiffness matrix of a body.

    Returns
    -------
    matrix : FloatArray or scipy.sparse array, shape (2 n_nodes, 2 n_nodes)
        The stiffness K in the body's axes: dense up to `DENSE_LIMIT` unknowns, else sparse.
    gradients : FloatArray, shape (n_cells, n_points, n_corners, 2)
        The gradients of the shape functions at the Gauss points, in the body's axes.
    """
    gradients, areas = _evaluate_shapes(body)  # (n_cells, n_points, n_corners, 2), (n_cells, n_points)
    n_cells, n_points, n_corners, _ = gradients.shape
    unit = np.zeros((n_cells, n_points, 3, n_corners, 2))  # Strains of unit displacements.
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


def _evaluate_shapes(body: Body) -> tuple[FloatArray, FloatArray]:
    """Return gradients of the shape functions, in the body's axes, and weights × areas at the Gauss points."""
    reference, weights = _reference_cell(body.cells.shape[1])  # (n_points, n_corners, 2), (n_points,)
    # Differences of nodes first: a cell far from the origin has the same stiffness to the last bit.
    corners = (body.nodes[body.cells] - body.nodes[body.cells[:, :1]]) @ body.frame  # (n_cells, n_corners, 2)
    jacobians = np.einsum("pad,eac->epcd", reference, corners)  # ∂x_c/∂X_d
    (a, b), (c, d) = jacobians.transpose(2, 3, 0, 1)  # Written out, so that another unit of length changes no bit.
    areas = (a * d - b * c) * weights
    return np.matmul(reference, np.linalg.inv(jacobians)), areas


@cache
def _reference_cell(corners: int) -> tuple[FloatArray, FloatArray]:
    """Return gradients of the shape functions on scikit-fem's reference cell at its Gauss points, and weights."""
    element, order = (skfem.ElementTriP1(), 1) if corners == 3 else (skfem.ElementQuad1(), 2)
    points, weights = get_quadrature(element.refdom, order)
    gradients = np.stack([element.lbasis(points, corner)[1] for corner in range(corners)])  # (n_corners, 2, n_points)
    return np.ascontiguousarray(gradients.transpose(2, 0, 1)), weights


def free_on_contact(body: Body) -> IntArray:
    """Return the free components (n,) on the contact boundary: 2 × node + component, in the body's axes, ascending."""
    on_contact = np.zeros(body.fixed.shape, bool)
    on_contact[body.contact_nodes] = True
    return np.flatnonzero((on_contact & ~body.fixed).reshape(-1))


@lru_cache(maxsize=CACHE_SIZE)
def condense(body: Body) -> CondensedBody:
    """Condense a body onto the free components of its contact boundary.

    The answer is remembered, so that a body is condensed once.

    Parameters
    ----------
    body : Body
        An elastic or a rigid body. A rigid one has no unknowns.

    Returns
    -------
    CondensedBody
        Stiffness and load on the contact boundary, and whatever is needed to recover the interior.

    Raises
    ------
    MisuseError
        If a part of the body is held neither by a support nor by the contact boundary.
    """
    unknowns = free_on_contact(body)
    free = ~body.fixed.reshape(-1)
    free[unknowns] = False
    interior = np.flatnonzero(free)
    imposed = body.imposed.reshape(-1)
    if body.rigid:
        none = np.zeros((0, 0))
        return CondensedBody(body, unknowns, none, np.zeros(0), interior, imposed, none, np.zeros((0, 1, 4, 2)))
    matrix, gradients = assemble_stiffness(body)
    forces = body.load.reshape(-1) - matrix @ imposed
    across = matrix[interior][:, unknowns]
    responses = _solve_interior(body, matrix[interior][:, interior], np.column_stack([dense(across), forces[interior]]))
    influence, response = -responses[:, :-1], responses[:, -1]
    particular = imposed.copy()
    particular[interior] = response
    condensed = dense(matrix[unknowns][:, unknowns]) + across.T @ influence
    load = forces[unknowns] - across.T @ response
    return CondensedBody(
        body, unknowns, (condensed + condensed.T) / 2, load, interior, particular, influence, gradients
    )


def _solve_interior(body: Body, matrix: Any, right: FloatArray) -> FloatArray:
    """Return the displacements of the interior (n_interior, n_right) under the forces `right`."""
    if not len(right):
        return right
    if sparse.issparse(matrix):
        try:
            factors = splu(matrix.tocsc())
        except RuntimeError:  # The matrix is exactly singular.
            raise _loose_part_error(body) from None
        pivots = np.abs(factors.U.diagonal()[factors.perm_c])
        answer: FloatArray = factors.solve(right)
    else:
        factor, info = lapack.dpotrf(matrix, lower=1)
        if info != 0:
            raise _loose_part_error(body)
        pivots = factor.diagonal() ** 2
        answer, _ = lapack.dpotrs(factor, right, lower=1)
    if not (pivots > _PIVOT_FLOOR * matrix.diagonal()).all():
        raise _loose_part_error(body)
    return answer


def _loose_part_error(body: Body) -> MisuseError:
    actual = "a part that hangs neither on a support nor on the contact boundary"
    return MisuseError(f"{body.name}: cells", actual, "one connected mesh, or supports for each part")


def loose_modes(body: Body) -> list[str]:
    """Return the rigid motions of a body that neither its supports nor frictionless contact resist, in words.

    Contact resists a motion only if the motion has a component along the normal of a contact edge.

    Returns
    -------
    list[str]
        Any of "move along its first axis", "move along its second axis" and "turn"; empty if the body is held.
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
    # Motions are numbers without dimension, of order 1: resistance below the floor is roundoff.
    free = motions[sizes <= _RESISTANCE_FLOOR * max(sizes.max(), 1.0)]
    return [
        words for words, part in zip(_MOTIONS, free.T, strict=True) if len(free) and np.abs(part).max() > _MOTION_FLOOR
    ]


def body_from_mesh(
    mesh: Any,
    *,
    contact: str,
    supports: Mapping[str, Literal["along", "across", "both"]],
    young: float = 1.0,
    poisson: float = 0.0,
    displacements: Mapping[str, tuple[float, float]] | None = None,
    pressures: Mapping[str, float] | None = None,
    name: str = "mesh",
) -> Body:
    """Return a body from a scikit-fem mesh of first-order triangles or quadrilaterals with named boundaries.

    Parameters
    ----------
    mesh : skfem.MeshTri or skfem.MeshQuad
        The mesh. ``mesh.with_boundaries({name: function})`` names its boundaries.
    contact : str
        The boundary that may touch something.
    supports : Mapping[str, Literal['along', 'across', 'both']]
        The components that are fixed on each supported boundary: "along" the x-axis, "across" it, or "both".
    young : float
        Young's modulus E > 0, force per length squared.
    poisson : float
        Poisson's ratio, −1 < ν < 1/2.
    displacements : Mapping[str, tuple[float, float]] | None
        The displacement (along, across), a length each, of each supported boundary that moves.
    pressures : Mapping[str, float] | None
        The pressure on each loaded boundary, force per length, positive towards the body.
    name : str
        The name of the body in messages and drawings.

    Returns
    -------
    Body
        The body on the nodes and cells of the mesh; its axes are x and y.

    Raises
    ------
    MisuseError
        If the mesh has no such boundary, a displacement is imposed where nothing is fixed, or as `Body` does.

    Examples
    --------
    >>> import numpy as np, skfem
    >>> from contactverif import body_from_mesh
    >>> mesh = skfem.MeshTri().refined(2).with_boundaries({"low": lambda x: x[1] == 0, "top": lambda x: x[1] == 1})
    >>> body = body_from_mesh(mesh, contact="low", supports={"top": "both"}, displacements={"top": (0.0, -0.1)})
    >>> len(body.contact), body.fixed.sum()
    (4, np.int64(10))
    """
    if getattr(mesh, "elem", None) not in (skfem.ElementTriP1, skfem.ElementQuad1):
        raise MisuseError("mesh", f"a {type(mesh).__name__}", "a MeshTri or a MeshQuad of first order")
    if not isinstance(supports, Mapping):
        raise MisuseError("supports", f"a {type(supports).__name__}", "{boundary: 'along', 'across' or 'both'}")
    displacements, pressures = displacements or {}, pressures or {}
    points, cells = np.asarray(mesh.p).T, np.asarray(mesh.t).T
    cells = np.where((_signed_areas(points[cells]) < 0)[:, None], cells[:, ::-1], cells)
    edges = {tag: _edges(mesh, cells, tag) for tag in dict.fromkeys([contact, *supports, *pressures])}
    fixed, imposed = _supports(points, edges, supports, displacements)
    load = _loads(points, edges, pressures)
    return Body(points, cells, edges[contact], young, poisson, fixed, imposed, load, name=name)


def _supports(
    points: FloatArray,
    edges: Mapping[str, IntArray],
    supports: Mapping[str, str],
    displacements: Mapping[str, tuple[float, float]],
) -> tuple[BoolArray, FloatArray]:
    """Return which components are fixed, and the displacements imposed there, both (n_nodes, 2)."""
    fixed, imposed = np.zeros(points.shape, bool), np.zeros(points.shape)
    for tag, direction in supports.items():
        components = {"along": [0], "across": [1], "both": [0, 1]}.get(direction)
        if components is None:
            raise MisuseError(f"supports[{tag!r}]", repr(direction), "'along', 'across' or 'both'")
        nodes = np.unique(edges[tag])
        displacement = _check_displacement(tag, displacements.get(tag, (0.0, 0.0)), components)
        for component in components:
            fixed[nodes, component] = True
            imposed[nodes, component] = displacement[component]
    if unsupported := set(displacements) - set(supports):
        needed = "a boundary that supports name"
        raise MisuseError(f"displacements[{min(unsupported)!r}]", "no supports there", needed)
    return fixed, imposed


def _loads(points: FloatArray, edges: Mapping[str, IntArray], pressures: Mapping[str, float]) -> FloatArray:
    """Return the nodal forces (n_nodes, 2) of pressures on boundaries."""
    load = np.zeros(points.shape)
    for tag, pressure in pressures.items():
        if np.ndim(pressure) != 0 or np.asarray(pressure).dtype.kind not in "fiu":
            raise MisuseError(f"pressures[{tag!r}]", repr(pressure), "a number")
        first, second = edges[tag].T
        along = points[second] - points[first]
        for end in (first, second):
            np.add.at(load, end, pressure / 2 * np.column_stack([-along[:, 1], along[:, 0]]))
    return load


def _check_displacement(tag: str, values: Any, components: list[int]) -> FloatArray:
    """Return the displacement (2,) of a boundary, checked: 0 where nothing is fixed."""
    try:
        displacement = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        displacement = np.zeros(0)
    if displacement.shape != (2,):
        raise MisuseError(f"displacements[{tag!r}]", repr(values), "two numbers, along and across")
    if displacement[[component for component in (0, 1) if component not in components]].any():
        raise MisuseError(f"displacements[{tag!r}]", "a displacement of a free component", "0 where nothing is fixed")
    return displacement


def _signed_areas(corners: FloatArray) -> FloatArray:
    following = np.roll(corners, -1, axis=1)
    areas: FloatArray = (corners[..., 0] * following[..., 1] - corners[..., 1] * following[..., 0]).sum(axis=1) / 2
    return areas


def _edges(mesh: Any, cells: IntArray, tag: str) -> IntArray:
    """Return the edges (n, 2) of a named boundary, each with its cell on the left."""
    tags = getattr(mesh, "boundaries", None) or {}
    if tag not in tags:
        needed = f"one of {', '.join(sorted(tags))}" if tags else "a mesh with named boundaries (mesh.with_boundaries)"
        raise MisuseError("mesh", f"no boundary {tag!r}", needed)
    if not len(tags[tag]):
        raise MisuseError("mesh", f"no edges on boundary {tag!r}", "a boundary that has some")
    wanted = {tuple(sorted(edge)) for edge in np.asarray(mesh.facets).T[np.asarray(tags[tag])].tolist()}
    following = np.roll(cells, -1, axis=1)
    every = np.stack([cells, following], axis=-1).reshape(-1, 2).tolist()
    return np.array([edge for edge in every if tuple(sorted(edge)) in wanted], dtype=np.int64).reshape(-1, 2)
