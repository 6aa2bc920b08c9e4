"""Two blocks, one on the other: the scene of the patch test, and what is known exactly about it.

Both blocks stand on rollers at their sides, so that nothing strains laterally: the pressure and the gap are exact
whatever the method's configuration. What of either block lies beside the other carries the pressure too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body, block, placed_at, rigid_surface
from contactverif.contract.case import Case
from contactverif.mechanics.scene import Scene


@dataclass(frozen=True, slots=True)
class Placing:
    """Where a scene that is drawn upright lies: scale × (its x along `axis`, its y across it, + shift)."""

    axis: tuple[float, float] = (1.0, 0.0)
    shift: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0


def two_blocks(
    slave_x: ArrayLike,
    slave_y: ArrayLike,
    master_x: ArrayLike,
    master_y: ArrayLike,
    *,
    young: Sequence[float] = (1.0, 1.0),
    poisson: Sequence[float] = (0.0, 0.0),
    penalty: float = 1.0,
    pressure: float | None = None,
    approach: float | None = None,
    tilt: float = 0.0,
    lowered: float | None = None,
    free_sides: bool = False,
    rigid_master: bool = False,
    placing: Placing = Placing(),
    name: str = "",
) -> Scene:
    """A slave block (its bottom touches) on a master block or a rigid floor, pressed together.

    Parameters
    ----------
    slave_x, slave_y, master_x, master_y : ArrayLike
        Ascending grid lines; the slave's lowest and the master's highest y agree. Where one block is wider, and
        a pressure is given, the pressure acts beside the other one too, so that all stays uniform.
    young, poisson : Sequence[float]
        Of slave and master.
    penalty : float
        Ε̂, also for the depth of the first guess.
    pressure : float | None
        On top of the slave, or.
    approach : float | None
        Of its top, a displacement; with `tilt` nothing is uniform any more, and no exact pressure is known.
    lowered : float | None
        How deep the slave is pushed in the first guess; by default `approach`, or p/ε̂.
    free_sides : bool
        Of both blocks; then the gap is not known exactly, since areas change.
    rigid_master : bool
        The master's top alone, held.

    Raises
    ------
    MisuseError
        As `Body` and `Scene` do.
    """
    slave_x, slave_y, master_x, master_y = (
        np.asarray(values, dtype=np.float64) for values in (slave_x, slave_y, master_x, master_y)
    )
    if lowered is None:
        lowered = approach if approach is not None else (pressure or 0.0) / penalty / placing.scale
    upper = block(
        slave_x,
        slave_y,
        contact="bottom",
        young=young[0],
        poisson=poisson[0],
        pressure=pressure or 0.0,
        approach=approach,
        tilt=tilt,
        lowered=lowered,
        free_sides=free_sides,
        over=(float(master_x[0]), float(master_x[-1])),
        axis=placing.axis,
        shift=placing.shift,
        scale=placing.scale,
        name="slave",
    )
    lower: Body
    if rigid_master:
        points = np.column_stack([master_x[::-1], np.full(len(master_x), master_y[-1])])
        placed = placed_at(points, placing.axis, placing.shift, placing.scale)
        lower = rigid_surface(placed, axis=placing.axis, name="master")
    else:
        lower = block(
            master_x,
            master_y,
            contact="top",
            young=young[1],
            poisson=poisson[1],
            pressure=pressure or 0.0,
            approach=0.0,
            free_sides=free_sides,
            over=(float(slave_x[0]), float(slave_x[-1])),
            axis=placing.axis,
            shift=placing.shift,
            scale=placing.scale,
            name="master",
        )
    facts = {
        "along": np.concatenate([slave_x, master_x[::-1] if rigid_master else master_x]) * placing.scale,
        "direction": np.array(placing.axis),
    }
    left, right = slave_x[0] - master_x[0], master_x[-1] - slave_x[-1]  # by how much the master is wider
    all_touch = left >= 0 and right >= 0 if rigid_master else left == right == 0
    if tilt == 0 and not free_sides and (pressure is not None or all_touch):
        heights = (np.ptp(slave_y), 0.0 if rigid_master else np.ptp(master_y))
        moduli = (upper.oedometric_modulus, lower.oedometric_modulus)
        facts["compliance"] = np.array([h / m for h, m in zip(heights, moduli, strict=True)]) * placing.scale
        if approach is not None:
            facts["approach"] = np.array(approach * placing.scale)
        else:
            facts["pressure"] = np.array(pressure)
    return Scene((upper, lower), penalty=penalty, facts=facts, name=name)


def is_uniform(case: Case) -> bool:
    """Whether the pressure of the scene is known, and the same everywhere."""
    return "compliance" in case.parameters


def overhangs(case: Case) -> bool:
    """Whether the slave of a uniform scene lies beside its master somewhere."""
    slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    return bool(slave.min() < master.min() or slave.max() > master.max())


def pressure_of(case: Case, penalty: float) -> float:
    """The exact contact pressure p of a uniform scene: given, or p = Δ / (H1/M1 + H2/M2 + 1/ε̂)."""
    if "pressure" in case.parameters:
        return case.parameter("pressure")
    return case.parameter("approach") / (float(case.parameters["compliance"].sum()) + 1 / penalty)


def exact_unknowns(scene: Scene, pressure: float, penalty: float) -> FloatArray:
    """The unknowns q (n_free,) of the exact solution: both surfaces move along the normal alone."""
    _, master = scene.facts["compliance"]
    down = {True: -pressure * (master + 1 / penalty), False: -pressure * master}
    return np.concatenate(
        [
            np.where(body.unknowns % 2 == 1, down[index in scene.slave], 0.0)
            for index, body in zip(scene.bodies_in_reach, scene.condensed_bodies, strict=True)
        ]
    )
