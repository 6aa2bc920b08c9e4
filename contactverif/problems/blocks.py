"""Two blocks, one on the other: the scene of the patch test, and everything that is known exactly about it.

Rule for the next editor: an exact answer is stated only where it holds for every formulation. Both blocks stand on
rollers at their sides, so that nothing strains laterally and the pressure and the gap are exact in whatever
configuration a method measures areas. Where one block is wider than the other, the pressure also acts on its part
beside the other, so that everything stays uniform.
"""

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.mechanics.bodies import UPRIGHT, Placing, Rectangle, block, rigid_surface
from contactverif.mechanics.scene import Scene, scene_of


def two_blocks(
    slave: Rectangle,
    master: Rectangle,
    *,
    penalty: float = 1.0,
    pressure: float | None = None,
    approach: float | None = None,
    tilt: float = 0.0,
    lowered: float | None = None,
    free_sides: bool = False,
    rigid_master: bool = False,
    placing: Placing = UPRIGHT,
    name: str = "",
) -> Scene:
    """Return the scene of a slave block that is pressed on a master block or on a rigid floor.

    The bottom of the slave touches the top of the master. The master is held below.

    Parameters
    ----------
    slave, master : Rectangle
        Grid lines and materials. The slave's lowest and the master's highest y agree.
    penalty : float
        The distributed stiffness ε̂, force per length per length of penetration.
    pressure : float | None
        The pressure on top of the slave, force per length. Either this or `approach` is given.
    approach : float | None
        The displacement of the top of the slave towards the master, a length.
    tilt : float
        Part of the approach that varies linearly, see `block`. With a tilt nothing is uniform, and no exact pressure is
        known.
    lowered : float | None
        The depth, a length, to which the slave is pushed in the first guess; `approach` by default, or pressure / ε̂.
    free_sides : bool
        True leaves the vertical sides of both blocks free. Areas change then, and the gap is not known exactly.
    rigid_master : bool
        True replaces the master by its top, held.
    placing : Placing
        Rotation, shift and scale of the whole scene.
    name : str
        The name of the scene.

    Returns
    -------
    Scene
        Its facts are "along" (n_nodes,), the coordinate of each contact node along the interface, a length, and
        "direction" (2,), the interface's unit vector. If the pressure is known exactly, then also "compliance" (2,),
        height over oedometric modulus of slave and master, and "pressure" or "approach".

    Examples
    --------
    >>> from contactverif import Rectangle, load_formulation, solve, two_blocks
    >>> scene = two_blocks(Rectangle([0, 1, 3], [0, 2]), Rectangle([0, 2, 3], [-2, 0]), penalty=10.0, pressure=0.1)
    >>> trace = solve(scene, load_formulation("vts-ppt").with_penalty(10.0))
    >>> trace.end.label
    'converged'
    """
    slave_x, slave_y, master_x, master_y = (
        np.asarray(values, dtype=np.float64) for values in (slave.x, slave.y, master.x, master.y)
    )
    if lowered is None:
        lowered = approach if approach is not None else (pressure or 0.0) / penalty / placing.scale
    upper = block(
        replace(slave, x=slave_x, y=slave_y),
        contact="bottom",
        pressure=pressure or 0.0,
        approach=approach,
        tilt=tilt,
        lowered=lowered,
        free_sides=free_sides,
        contact_range=(float(master_x[0]), float(master_x[-1])),
        placing=placing,
        name="slave",
    )
    lower: Body
    if rigid_master:
        points = np.column_stack([master_x[::-1], np.full(len(master_x), master_y[-1])])
        lower = rigid_surface(placing.place(points), axis=placing.axis, name="master")
    else:
        lower = block(
            replace(master, x=master_x, y=master_y),
            contact="top",
            pressure=pressure or 0.0,
            approach=0.0,
            free_sides=free_sides,
            contact_range=(float(slave_x[0]), float(slave_x[-1])),
            placing=placing,
            name="master",
        )
    facts = {
        "along": np.concatenate([slave_x, master_x[::-1] if rigid_master else master_x]) * placing.scale,
        "direction": np.array(placing.axis),
    }
    # The part of each block beside the other carries the pressure; an approach imposes none there.
    left, right = slave_x[0] - master_x[0], master_x[-1] - slave_x[-1]  # Lengths of the master beside the slave.
    whole_slave_touches = left >= 0 and right >= 0 if rigid_master else left == right == 0
    if tilt == 0 and not free_sides and (pressure is not None or whole_slave_touches):
        heights = (float(np.ptp(slave_y)), 0.0 if rigid_master else float(np.ptp(master_y)))
        compliances = [height / body.oedometric_modulus for height, body in zip(heights, (upper, lower), strict=True)]
        facts["compliance"] = np.array(compliances) * placing.scale
        if approach is not None:
            facts["approach"] = np.array(approach * placing.scale)
        else:
            facts["pressure"] = np.array(pressure)
    return Scene((upper, lower), penalty=penalty, facts=facts, name=name)


def is_uniform(case: Case) -> bool:
    """Return whether the pressure of the scene is known exactly, and the same everywhere."""
    return "compliance" in case.parameters


def pressure_of(case: Case, penalty: float) -> float:
    """Return the exact contact pressure of a uniform scene, force per length."""
    if "pressure" in case.parameters:
        return case.parameter("pressure")
    return case.parameter("approach") / (float(case.parameters["compliance"].sum()) + 1 / penalty)


def at_exact_solution(case: Case) -> Case:
    """Return a case of a uniform scene at its exact solution, where forces are the exact ones; any other as it is."""
    if not is_uniform(case):
        return case
    scene = scene_of(case)
    return replace(case, z=scene.positions(exact_unknowns(scene, pressure_of(case, case.penalty), case.penalty)))


def exact_unknowns(scene: Scene, pressure: float, penalty: float) -> FloatArray:
    """Return the unknowns q (n_free,) of the exact solution of a uniform scene.

    Both surfaces move along the normal alone: the master by p H2/M2, the slave by p/ε̂ more.
    """
    _, master = scene.facts["compliance"]
    down = {True: -pressure * (master + 1 / penalty), False: -pressure * master}
    return np.concatenate(
        [
            np.where(unknowns % scene.dim == scene.dim - 1, down[index in scene.slave], 0.0)
            for index, unknowns in zip(scene.bodies_in_reach, scene.unknowns, strict=True)
        ]
    )
