"""Bodies from meshes of scikit-fem with named boundaries: supports and loads are stated by boundary.

Rule for the next editor: a wrong argument is reported here by its name; what is wrong with a mesh is found by `Body`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import skfem

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.errors import MisuseError


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
