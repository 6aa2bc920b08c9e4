"""Defect 2 of VTS-PPT as it is published: the forces jump between Eq. 6 and Box 3.

Where an area of competence lies over one segment Eq. 6 holds, and nothing is lost; over several segments Box 3 loses
1 − cos θ. So the forces jump when the end of an area passes a master node, by up to 1 − cos θ of the force of that
virtual slave node. Here two areas meet over the node, and their jumps partly cancel.

Source: Zavarise & De Lorenzis (2009), Eq. 6 and Box 3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray
from contactverif_paper.defect_tilt import DEPTH, TILTS, nodal_forces
from contactverif_paper.figure_style import (
    REFERENCE_LINE,
    Series,
    add_legend,
    new_panels,
    plot_logarithmic,
    plot_series,
    use_round_ticks,
)
from contactverif_paper.paper_columns import Column, Formulations, series_columns
from contactverif_paper.paper_formulations import BALANCED, STS, VTS_PPT, PaperFormulation
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement
from contactverif_reports.html.pages import number

FORMULATIONS = (VTS_PPT, BALANCED, STS)
SLIDING_TILT = 0.3  # Radians: the tilt at which the area slides past the node.
SHIFTS = np.linspace(-0.06, 0.06, 121) + 2.0**-12  # The end of the area past the node over the slave's length.
_TRANSMITTED = series_columns(
    "shift", "1", "end of the area past the node over the slave's length", "force on the master over that on the slave"
)
_NEAR = 2.0**-40  # The distance to either side of the jump over the slave's length.


@dataclass(frozen=True, slots=True, eq=False)
class Jump:
    """The jump of the forces where the end of an area of competence passes a master node."""

    jump: Annotated[Series, series_columns("tilt", "rad", "tilt of the slave", "largest jump over the slave's force")]
    known: Annotated[FloatArray, Column("tilt", "1", "the jump of the printed algorithm, by formula")]
    transmitted: Annotated[Series, _TRANSMITTED]  # At `SLIDING_TILT`.
    formulations: Formulations = FORMULATIONS


def compute(report_progress: Progress) -> Jump:
    """Compute forces beside the node and on both sides of it."""
    report_progress("jump between Eq. 6 and Box 3")
    transmitted = np.array([[_transmission(row, SLIDING_TILT, shift) for shift in SHIFTS] for row in FORMULATIONS])
    jumps = np.array([[_jump(row, theta) for theta in TILTS] for row in FORMULATIONS])
    return Jump(
        Series(FORMULATIONS, TILTS, jumps),
        np.array([jump_by_formula(theta) for theta in TILTS]),
        Series(FORMULATIONS, SHIFTS, transmitted),
    )


def jump_by_formula(theta: float) -> float:
    """Return the largest jump of the printed algorithm, over the slave's force.

    Eq. 6 gives (1 − ξ) F and ξ F, Box 3 cos θ of them. Left of the node the first area lies over one segment and the
    second over two, right of it the other way round; both forces share the node in the middle.
    """
    depth = DEPTH + np.array([0.25, 0.75]) * np.sin(theta)
    node = np.cos(theta) / 2
    lengths = np.array([node + 1.0, 2.0 - node])
    far_shares = np.cos(theta) / 4 / lengths  # The share of each force that the far node of its segment takes.
    force = depth / depth.sum()
    shared = force[1] * (1 - far_shares[1]) - force[0] * (1 - far_shares[0])
    return float((1 - np.cos(theta)) * max(force[0] * far_shares[0], force[1] * far_shares[1], abs(shared)))


def statements(result: Jump) -> Iterator[Statement]:
    """Say how large the jump is."""
    jumps = [result.jump.near(VTS_PPT, theta) for theta in (0.1, 0.3)]
    yield Statement(
        "Eq. 6 and Box 3",
        "one segment under the area: Eq. 6; several: Box 3; nothing is said of the change from one to the other",
        f"nodal forces jump: in the case drawn by {number(jumps[0], 2)} of the slave’s force at θ = 0.1 and by "
        f"{number(jumps[1], 2)} at 0.3; in others by up to 1 − cos θ of a virtual slave node’s own force, "
        f"{1 - np.cos(0.1):.2g} and {1 - np.cos(0.3):.2g}",
        Agreement.DEFECT if max(jumps) > 1e-6 else Agreement.AGREES,
        "defect-jump",
    )


@PaperFigure.define(
    "defect-jump",
    "(a) The force that reaches the master while the end of an area of competence slides past a master node, "
    "and (b) the largest jump of a nodal force there.",
)
def plot(result: Jump) -> Figure:
    """Draw the transmitted force beside the node, and the jump over the tilt."""
    figure, (sliding, jump) = new_panels(3.6, 2)
    plot_series(sliding, result.transmitted, markers=False)
    sliding.set_xlabel("area’s end past the node\n(slave lengths)")
    sliding.set_ylabel("master force / slave force (–)")
    sliding.set_title(f"θ = {SLIDING_TILT:g}")
    use_round_ticks(sliding)
    jump.plot(TILTS[1:], result.known[1:], **REFERENCE_LINE)
    plot_logarithmic(jump, result.jump)
    jump.set(xlabel="tilt θ (rad)", ylabel="largest jump / slave force (–)")
    add_legend(figure, FORMULATIONS, reference="formula, printed algorithm", columns=2)
    return figure


def _master(theta: float, shift: float) -> Sequence[float]:
    """Return a master with one inner node, `shift` behind the beginning of the second virtual slave node's area."""
    return (-1.0, np.cos(theta) / 2 + shift, 2.0)


def _transmission(formulation: PaperFormulation, theta: float, shift: float) -> float:
    """Return the size of the force on the master over that on the slave."""
    _, forces = nodal_forces(formulation, theta, _master(theta, shift))
    slave, master = (np.linalg.norm(forces[side].sum(axis=0)) for side in (slice(0, 2), slice(2, None)))
    return float(master / slave)


def _jump(formulation: PaperFormulation, theta: float) -> float:
    """Return the largest jump of a nodal force where two areas meet over a master node, over the slave's force."""
    before, behind = (nodal_forces(formulation, theta, _master(theta, sign * _NEAR))[1] for sign in (-1, 1))
    return float(np.linalg.norm(behind - before, axis=1).max() / np.linalg.norm(before[:2].sum(axis=0)))


ITEM = Item(
    name="defect_jump",
    title="Defect 2: forces jump between Eq. 6 and Box 3",
    compute=compute,
    statements=statements,
    attributes={"tilt_of_transmitted": SLIDING_TILT},
    figures=(plot,),
)
