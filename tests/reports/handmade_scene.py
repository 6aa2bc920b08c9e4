"""SolvedScene scenes made by hand, from the contracts alone: nothing is solved here."""

import numpy as np

from contactverif import Body, Case, Interface, Placing, Rectangle, Surface, block, rigid_surface
from contactverif.contract.arrays import FloatArray
from contactverif_reports.plot.solved_scene import PointPressures, Solution, SolvedScene

PRESSURE = 100.0


def bodies(*, wide: float = 0.0, angle: float = 0.0, rigid_master: bool = False) -> tuple[Body, Body]:
    """Three slave cells on two master cells, the master wider by that much on either side."""
    axis = (float(np.cos(angle)), float(np.sin(angle)))
    upper = block(
        Rectangle([0, 1, 3, 6], [0, 2]), contact="bottom", pressure=PRESSURE, name="slave", placing=Placing(axis=axis)
    )
    places = np.array([-wide, 2.0, 6.0 + wide])
    if rigid_master:
        turned = np.column_stack([places[::-1], 0 * places]) @ upper.frame.T
        return upper, rigid_surface(turned, axis=axis, name="master")
    lower = block(
        Rectangle(places, [-3, 0]), contact="top", approach=0.0, pressure=PRESSURE, name="master",
        contact_range=(0.0, 6.0), placing=Placing(axis=axis),
    )  # fmt: skip
    return upper, lower


def make_solved_scene(
    *,
    penetration: float = 0.01,
    wide: float = 0.0,
    angle: float = 0.0,
    rigid_master: bool = False,
    names: tuple[str, ...] = ("one", "two"),
    ends: tuple[str, ...] = ("converged", "2-cycle"),
) -> SolvedScene:
    """Return a scene under uniform pressure: the slave has moved towards the master by the penetration."""
    pair = bodies(wide=wide, angle=angle, rigid_master=rigid_master)
    first = len(pair[0].contact_nodes)
    numbers = (np.arange(first), np.arange(first, first + len(pair[1].contact_nodes)))
    segments = [np.searchsorted(body.contact_nodes, body.contact) for body in pair]
    nodes = np.vstack([body.nodes[body.contact_nodes] for body in pair])
    case = Case(Interface(nodes, Surface(segments[0]), Surface(segments[1] + first)), nodes.ravel(), 1e4)
    down = pair[0].frame @ np.array([0.0, -penetration])
    moves = tuple(np.broadcast_to(down * (index == 0), body.nodes.shape) for index, body in enumerate(pair))
    z = nodes.copy()
    z[:first] += down
    empty = SolvedScene(case, pair, numbers, ())
    stresses = tuple(_uniform(body) for body in pair)
    solutions = tuple(
        Solution(
            formulation=name,
            end=end,
            converged=end == "converged",
            displacements=moves,
            stresses=stresses,
            z=z.ravel(),
            forces=PRESSURE * empty.shares(z),
            residuals=np.array([1e2, 1e-3, 1e-14 if end == "converged" else 1e-3]),
            energies=np.array([1.0, 1e-9, np.nan]),
            floors=np.full(3, 1e-12),
            factors=np.ones(3),
            points=PointPressures(np.array([0, 1, 2]), np.zeros(3), np.array([[-1.0, 1.0]] * 3), np.full(3, PRESSURE)),
            pressure=PRESSURE,
            advice="" if end == "converged" else "try load steps",
        )
        for name, end in zip(names, ends, strict=True)
    )
    return SolvedScene(case, pair, numbers, solutions)


def _uniform(body: Body) -> FloatArray:
    """−PRESSURE across the body's axis and nothing else, in global axes (n_cells, 3)."""
    tensor = body.frame @ np.diag([0.0, -PRESSURE]) @ body.frame.T
    return np.tile([tensor[0, 0], tensor[1, 1], tensor[0, 1]], (len(body.cells), 1))
