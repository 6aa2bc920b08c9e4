"""Blocks in space over flat grids of faces: tetrahedra behind triangles, hexahedra behind quadrilaterals.

A block is its contact surface, extruded. Its sides cannot move sideways, so that the pressure of two blocks is uniform
and known exactly, whatever the grids. Where the master is larger than the slave, the pressure also acts on its part
beside the slave, and the other way round.
"""

from collections.abc import Sequence

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.interface import TRIANGLE, Interface, Surface
from contactverif.mechanics.bodies import grid_cells
from contactverif.mechanics.scene import Scene
from contactverif.oracle.flat_answers import uniform_surface_weights
from contactverif.problems.flat_states import AT_REST, SpaceMotion


def extrude(faces: IntArray, n_nodes: int, n_layers: int) -> IntArray:
    """Return the cells (n_cells, 4 or 8) behind faces (n_faces, 3 or 4) of nodes numbered from 0, seen from outside.

    Layer k has the nodes of the faces + k n_nodes. A prism behind a triangle is cut into three tetrahedra, on its sides
    along the diagonals that begin at the lower number, so that neighbours share them.
    """
    if faces.shape[1] != TRIANGLE:
        cells = np.hstack([faces[:, ::-1], faces[:, ::-1] + n_nodes])
    else:
        a, b, c = np.sort(faces, axis=1).T
        # Sorted corners run as those of the face do, or against them: then two change places.
        first = faces.argmin(axis=1)[:, None]
        along = (np.take_along_axis(faces, (first + 1) % 3, axis=1) == b[:, None])[:, 0]
        d, e, f = a + n_nodes, b + n_nodes, c + n_nodes
        parts = ((a, b, c, f), (a, b, f, e), (a, e, f, d))
        cells = np.vstack([np.where(along, [p, r, q, s], [p, q, r, s]).T for p, q, r, s in parts])
    return np.vstack([cells + layer * n_nodes for layer in range(n_layers)])


def space_blocks(
    interface: Interface,
    plane: FloatArray,
    domain: FloatArray,
    *,
    layers: tuple[Sequence[float], Sequence[float]],
    materials: tuple[tuple[float, float], tuple[float, float]],
    penalty: float,
    pressure: float | None = None,
    approach: float | None = None,
    tilt: tuple[float, float] = (0.0, 0.0),
    rigid_master: bool = False,
    lowered: float | None = None,
    motion: SpaceMotion = AT_REST,
) -> Scene:
    """Return the scene of a slave block that is pressed down on a master block, or on a rigid floor.

    Parameters
    ----------
    interface : Interface
        The contact surfaces in the plane z = 0, or near it: the layers of cells even out their heights.
    plane : FloatArray, shape (n_nodes, 2)
        The coordinates of its nodes in that plane.
    domain : FloatArray, shape (n_corners, 2)
        The corners of what both surfaces cover.
    layers : tuple[Sequence[float], Sequence[float]]
        The heights of the layers of cells of slave and master, a length each.
    materials : tuple[tuple[float, float], tuple[float, float]]
        Young's modulus and Poisson's ratio of slave and master.
    penalty : float
        The distributed stiffness ε̂, force per area per length of penetration.
    pressure : float | None
        The pressure on top of the slave, force per area, and on what either surface has beside the other. Either this
        or `approach` is given.
    approach : float | None
        The displacement of the top of the slave towards the master, a length.
    tilt : tuple[float, float]
        The further approach of the top for each unit of length along both coordinates of the plane, from the middle of
        the domain. With a tilt no exact pressure is known.
    rigid_master : bool
        True replaces the master by its surface, held.
    lowered : float | None
        The depth to which the slave is pushed in the first guess; `approach` by default, or pressure / ε̂.
    motion : SpaceMotion
        The rotation, shift and scale of the drawing; lengths of all other arguments are those before it.

    Returns
    -------
    Scene
        Its facts are "plane", "domain", "normal" (3,) out of the master, and, if the pressure is known exactly,
        "compliance" (2,) and "pressure" or "approach".
    """
    n_slave, axes, scale = interface.n_slave_nodes, motion.axes, motion.scale
    whole, beside = np.zeros((2, len(plane)))  # The loads of the far side, and of what is beside the other surface.
    if pressure is not None:
        low, high = plane.min(axis=0), plane.max(axis=0)
        around = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        whole = pressure * scale**2 * uniform_surface_weights(interface, plane, around)
        beside = whole - pressure * scale**2 * uniform_surface_weights(interface, plane, domain)
    places, heights = (np.split(part, [n_slave]) for part in (plane, interface.nodes[:, 2]))
    bodies, compliances, middle = [], [], domain.mean(axis=0)
    if lowered is None:
        lowered = approach if approach is not None else (pressure or 0.0) / penalty / scale
    for index, (surface, start) in enumerate(((interface.slave, 0), (interface.master, n_slave))):
        faces, flat, sign = surface.faces - start, places[index], (1.0, -1.0)[index]
        n, rigid = len(flat), bool(index and rigid_master)
        levels = np.cumsum([0.0, *([] if rigid else layers[index])])
        flattening = np.outer(1 - levels / levels[-1] if levels[-1] else [1.0], heights[index]).reshape(-1)
        nodes = np.column_stack([np.tile(flat, (len(levels), 1)), np.repeat(sign * levels, n) + flattening])
        fixed, imposed, load = (np.zeros(nodes.shape, kind) for kind in (bool, float, float))
        fixed[:, :2] = np.tile(_mark_rollers(Surface(faces), flat), (len(levels), 1))
        far = slice(len(nodes) - n, len(nodes))
        if rigid:
            fixed[:] = True
        elif index:
            fixed[far, 2] = True
        elif approach is not None:
            fixed[far, 2], imposed[far, 2] = True, -(approach + (flat - middle) @ tilt) * scale
        else:
            load[far, 2] = -whole[:n_slave]
        if not rigid:
            load[:n, 2] += sign * beside[start : start + n]
        body = Body(
            nodes=motion(nodes),
            cells=np.zeros((0, 8), np.int64) if rigid else extrude(faces, n, len(levels) - 1),
            contact=faces,
            young=materials[index][0],
            poisson=materials[index][1],
            fixed=fixed,
            imposed=imposed,
            load=load,
            axis=axes[:2],
            start=np.array([0.0, 0.0, 0.0 if index else -lowered * scale]),
            name=("slave", "master")[index],
        )
        bodies.append(body)
        compliances.append(levels[-1] / body.oedometric_modulus * scale)
    facts = {"plane": plane * scale, "domain": domain * scale, "normal": axes[2]}
    if not any(tilt) and not interface.nodes[:, 2].any():
        facts["compliance"] = np.array(compliances)
        facts |= {"approach": np.array(approach * scale)} if approach is not None else {"pressure": np.array(pressure)}
    return Scene(tuple(bodies), penalty=penalty, facts=facts)


def rectangle(x: FloatArray, y: FloatArray, corners: int) -> tuple[FloatArray, IntArray]:
    """Return the points (n, 2) of a grid and its faces, counter-clockwise in the plane."""
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    number = np.arange(len(points)).reshape(len(x), len(y))
    faces = grid_cells(number.T)
    return points, np.vstack([faces[:, :3], faces[:, [0, 2, 3]]]) if corners == TRIANGLE else faces


def facing_grids(
    slave: tuple[FloatArray, FloatArray], master: tuple[FloatArray, FloatArray], corners: int
) -> tuple[Interface, FloatArray]:
    """Return the interface of two grids in the plane z = 0, each with its x and y, and the plane (n_nodes, 2)."""
    (above, below), (under, upper) = (rectangle(*lines, corners) for lines in (slave, master))
    flat = [np.column_stack([points, np.zeros(len(points))]) for points in (above, under)]
    return Interface.from_faces(flat[0], below[:, ::-1], flat[1], upper), np.vstack([above, under])


def _mark_rollers(surface: Surface, plane: FloatArray) -> BoolArray:
    """Return which of both components (n, 2) of each node the rollers at the sides hold.

    A side along an axis is held across it; one that is inclined against the axes holds both.
    """
    face, edge = np.nonzero(surface.neighbours < 0)
    ends = np.stack([surface.faces[face, edge], surface.faces[face, (edge + 1) % surface.faces.shape[1]]], axis=1)
    rollers = np.zeros(plane.shape, bool)
    across = np.diff(plane[ends], axis=1)[:, 0, ::-1] != 0  # Across an edge along the first axis is the second one.
    np.logical_or.at(rollers, ends, across[:, None])
    return rollers
