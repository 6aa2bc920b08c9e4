"""The classes of flat meshes on which simple formulations pass the patch test.

Zavarise and De Lorenzis order their cases by where the inner nodes of the master lie:

| class | inner master nodes lie | cases | passes |
|---|---|---|---|
| normal | on slave nodes | A1, A2 | NTS-AR, VTS-G, VTS-ME, and all that pass the next class |
| single | on slave nodes or in the middle of slave segments | B | VTS-ME with an even n, VTS-PPT, mortar, … |

In the normal class the shape functions of the master are linear along each slave segment, so the trapezoidal rule, and
any better one, transmits a uniform pressure exactly. In the single class they may have a bend in the middle.

Source: Zavarise & De Lorenzis (2009), Sections 4 and 5.1.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.contract.interface import Interface

_ROUNDING = 64 * UNIT_ROUNDOFF  # Nodes this close, over the largest coordinate, coincide.


def is_of_class(interface: Interface, along: ArrayLike, *, midpoints: bool) -> bool:
    """Return whether all inner master nodes of a flat interface lie on slave nodes, or in the middle of slave segments.

    Parameters
    ----------
    interface : Interface
        A flat interface.
    along : ArrayLike, shape (n_nodes,)
        The coordinate of each node along it, a length.
    midpoints : bool
        Also accept the middle of a slave segment.
    """
    places = np.asarray(along, dtype=np.float64)
    slave, master = interface.slave.segments, interface.master.segments
    inner = places[np.intersect1d(master[:, 0], master[:, 1])]
    allowed = places[np.unique(slave)]
    if midpoints:
        allowed = np.append(allowed, places[slave].mean(axis=1))
    distances = np.abs(inner[:, None] - allowed).min(axis=1)
    return bool((distances <= _ROUNDING * np.abs(places).max()).all())
