"""Flat interfaces in space under uniform penetration, for the patch test: any two grids, moved and turned."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.faces import QUADRILATERAL, TRIANGLE
from contactverif.contract.interface import Interface
from contactverif.strategies.parts import depth_units, penalties, seeds
from contactverif.strategies.surfaces.space_motions import space_motions
from contactverif.strategies.surfaces.surface_pairs import SurfacePair, matched_pairs, surface_pairs

_QUARTERS = st.integers(1, 8)  # The penetration, in quarters of a unit of the least height of a face.


@random_source("contactverif.strategies.surfaces.uniform_surfaces.flat_surface_cases")
def flat_surface_cases(
    interface: Interface | None = None, faces: tuple[int, ...] = (TRIANGLE,)
) -> SearchStrategy[Case] | None:
    """Return cases of uniform penetration in space; the master covers the slave.

    Their parameters are "penetration" (|g| > 0, a length), "plane" (n_nodes, 2) (coordinates of the nodes in the plane
    of the interface, before any rigid motion), "domain" (4, 2) (the corners of the slave's domain there) and "normal"
    (3,) (the unit vector out of the master). Quadrilaterals are rectangles. There are no cases on an interface of the
    user.
    """
    return _flat_states(surface_pairs(faces=faces, straight=True)) if interface is None else None


@random_source("contactverif.strategies.surfaces.uniform_surfaces.skewed_surface_cases")
def skewed_surface_cases(
    interface: Interface | None = None, faces: tuple[int, ...] = (QUADRILATERAL,)
) -> SearchStrategy[Case] | None:
    """Return cases as `flat_surface_cases` does, on the same domain, with quadrilaterals of any convex shape."""
    return _flat_states(surface_pairs(same_domain=True, faces=faces)) if interface is None else None


@random_source("contactverif.strategies.surfaces.uniform_surfaces.matched_surface_cases")
def matched_surface_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases as `flat_surface_cases` does, with each master node over the slave on a slave node."""
    return _flat_states(matched_pairs()) if interface is None else None


@random_source("contactverif.strategies.surfaces.uniform_surfaces.overhung_surface_cases")
def overhung_surface_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases as `flat_surface_cases` does, with a master that goes beyond the slave on all sides."""
    return _flat_states(surface_pairs(same_domain=False)) if interface is None else None


@st.composite
def _flat_states(draw: DrawFn, pairs: SearchStrategy[SurfacePair]) -> Case:
    pair = draw(pairs)
    quarters, unit = draw(_QUARTERS), draw(depth_units())
    motion, penalty, seed = draw(space_motions()), draw(penalties()), draw(seeds())
    interface, plane, domain = pair.lay_out()
    heights = [side.heights(interface.nodes).min() for side in (interface.slave, interface.master)]
    penetration = quarters / 4 * unit * 2.0 ** np.floor(np.log2(min(heights)))
    current = interface.nodes.copy()
    current[: interface.n_slave_nodes, 2] -= penetration
    parameters = {
        "penetration": np.array(penetration * motion.scale),
        "plane": plane * motion.scale,
        "domain": domain * motion.scale,
        "normal": motion.normal,
    }
    reference = interface.at(interface.nodes * motion.scale)
    return Case(reference, motion(current).reshape(-1), penalty, parameters, seed)
