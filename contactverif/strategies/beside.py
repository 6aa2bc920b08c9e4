"""States in space where a search may take the wrong face: slaves beside the master, and masters of two layers."""

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from contactverif.contract.case import Case, random_source
from contactverif.contract.interface import TRIANGLE, Interface, Surface
from contactverif.strategies import samples
from contactverif.strategies.surfaces import SurfaceGrid, flat_surface_cases, space_motions, surface_grids

_EXPONENTS = st.one_of(st.integers(0, 10), st.integers(-40, -1))  # Powers of two of the longest edge.
_EIGHTHS, _PLACES, _SIZES = st.integers(1, 8), st.integers(-4, 4), st.integers(-4, 1)
_COMPANY = st.sampled_from([None, None, 0, 1])  # The place of a face in contact among all, or none.


@random_source("contactverif.strategies.beside.beside_cases")
@samples.on_own_meshes
def beside_cases(draw: DrawFn, faces: tuple[int, ...] = (TRIANGLE,)) -> Case:
    """Return flat slaves, as deep as ones in contact, whose distance from the master is 1e-12 to 2000 longest edges.

    In half of the cases one more slave face is in contact, without a node of the others. The parameter "beside"
    (n_slave_nodes,) is 1 at a node that lies beside; the others are those of `hard_corner_states`, for the forces on
    these nodes, which are 0 from one longest master edge on. There are no cases on an interface of the user.
    """
    # Rectangles: far beside another quadrilateral a foot on its bilinear continuation may not exist.
    master, slave = (draw(surface_grids(most=most, faces=faces, straight=True)) for most in (3, 2))
    quarter, degrees = draw(st.integers(0, 3)), draw(st.one_of(st.just(0), st.integers(1, 89)))
    exponent, eighths, place, size = draw(_EXPONENTS), draw(_EIGHTHS), draw(_PLACES), 2.0 ** draw(_SIZES)
    depth = draw(_EIGHTHS) / 64 * draw(samples.depth_units()) * size
    motion, penalty, seed = draw(space_motions()), draw(samples.PENALTIES), draw(samples.SEEDS)
    company, below = draw(_COMPANY), master.points()
    edges = below[master.faces()] - np.roll(below[master.faces()], 1, axis=1)
    longest = float(np.linalg.norm(edges, axis=2).max())
    distance = longest * 2.0**exponent * (1 + eighths / 8)
    # Complex numbers are places in the plane. The slave's square is turned as the way to it is turned off an edge.
    turn = np.exp(1j * np.deg2rad(degrees))
    away, half = 1j**quarter * turn, size * (turn.real + turn.imag) / 2
    nearest = 0.5 + 0.5j + 1j**quarter * (0.5 + 0.5j * (degrees > 0))  # The middle of a master edge, or a corner
    aside = place / 8 * (size if degrees else 1.0) * 1j
    here = nearest + away * (distance + half + aside + size * turn * ((slave.points() - 0.5) @ [1, 1j]))
    parts = [(np.column_stack([here.real, here.imag]), slave)]
    if company is not None:
        other = SurfaceGrid(1, 1, [0], [0], slave.corners)
        parts.insert(company, (0.375 + other.points() / 4, other))
    beside = np.concatenate([np.full(len(points), grid is slave, float) for points, grid in parts])
    first = len(parts[0][0])
    slave_faces = [grid.faces()[:, ::-1] + start for start, (_, grid) in zip((0, first), parts, strict=False)]
    plane = np.vstack([*(points for points, _ in parts), below])
    master_faces = np.random.default_rng(seed).permutation(master.faces() + len(beside))
    current = np.column_stack([plane, np.where(np.arange(len(plane)) < len(beside), -depth, 0.0)])
    surfaces = Surface(np.vstack(slave_faces)), Surface(master_faces)
    interface = Interface(current * [1.0, 1.0, 0.0] * motion.scale, *surfaces)
    bounds = np.array([0.0, 0.0 if distance >= longest else depth * size**2 * motion.scale**3])
    parameters = {
        "beside": beside,
        "axis": motion.normal,
        "edges": np.stack([motion.normal] * 2),
        **dict.fromkeys(("bounds", "segment_bounds"), bounds),
        "penetration": np.array(depth * motion.scale),
    }
    return Case(interface, motion(current).reshape(-1), penalty, parameters, seed)


@samples.on_own_meshes
def layered_cases(draw: DrawFn) -> Case:
    """Return flat cases with a copy of the master behind it, by 1/8 to 30 penetrations: either may be nearer."""
    cases = flat_surface_cases()
    assert cases is not None
    case, eighths, exponent = draw(cases), draw(st.integers(1, 7)), draw(st.integers(-3, 4))
    slave, master, n_slave = case.interface.slave, case.interface.master, case.interface.n_slave_nodes
    behind = 2.0**exponent * (1 + eighths / 8) * case.parameter("penetration") * case.parameters["normal"]
    copy = master.faces + len(master.nodes)
    nodes, positions = (np.vstack([x, x[n_slave:] - behind]) for x in (case.interface.nodes, case.positions))
    interface = Interface(nodes, slave, Surface(np.vstack([master.faces, copy])))
    return replace(case, interface=interface, z=positions.reshape(-1), parameters={})
