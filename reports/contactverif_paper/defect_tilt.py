"""Defect 1 of VTS-PPT as it is published: action is not reaction where the slave is tilted against the master.

A virtual slave node whose area of competence lies over several master segments gives each its projected length
(Box 3), but keeps its own force on the whole length. Where the slave is tilted by θ against the master, 1 − cos θ of
the force is lost. No case of the paper shows it: slave and master are parallel in contact, or nearly so on the disk.

Source: Zavarise & De Lorenzis (2009), Section 5.1.1, Boxes 1–3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface
from contactverif_paper.figure_style import REFERENCE_LINE, Series, add_legend, new_panels, plot_logarithmic
from contactverif_paper.paper_columns import Formulations, series_columns, values_column
from contactverif_paper.paper_formulations import BALANCED, STS, VTS_ME, VTS_PPT, PaperFormulation, subject_of
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement
from contactverif_reports.html.pages import number

TILTS = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4])  # Radians.
DEPTH = 1.0 / 8  # The penetration of the slave's first node over its length.
_PENALTY = 8.0
FORMULATIONS = (VTS_ME, VTS_PPT, BALANCED, STS)
_FORCE_LOSS = "force lost between slave and master over the slave's force"
_MASTER = (-1.0, 0.25, 0.75, 2.0)  # The area of each virtual slave node crosses a node, up to θ = 0.5.


def nodal_forces(formulation: PaperFormulation, theta: float, master: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Return positions and forces, both (n_nodes, 2), slave nodes first, at a tilt in radians.

    The slave has unit length and begins at x = 0; `master` is the ascending x of the master's nodes.
    """
    chain = np.column_stack([master[::-1], np.zeros(len(master))])
    interface = Interface.from_chains(np.array([[0.0, 0.0], [1.0, 0.0]]), chain)
    x = np.vstack([[0.0, -DEPTH], [np.cos(theta), -DEPTH - np.sin(theta)], chain])
    plugin, z = subject_of(formulation).with_penalty(_PENALTY), x.reshape(-1)
    forces: FloatArray = -plugin.residual(interface, plugin.pair(interface, z), z).reshape(-1, 2)
    return x, forces


@dataclass(frozen=True, slots=True, eq=False)
class Imbalance:
    """The loss of force, |ΣR|, and of moment about the slave's middle, |Σ x×R|, over the tilt."""

    force: Annotated[Series, series_columns("tilt", "rad", "tilt of the slave", _FORCE_LOSS)]
    moment: Annotated[Series, values_column("tilt", "moment lost over the slave's force times its length")]
    formulations: Formulations = FORMULATIONS


def compute(report_progress: Progress) -> Imbalance:
    """Compute what is lost between slave and master."""
    report_progress("balance under tilt")
    both = np.array([[_imbalance(formulation, theta) for theta in TILTS] for formulation in FORMULATIONS])
    return Imbalance(Series(FORMULATIONS, TILTS, both[..., 0]), Series(FORMULATIONS, TILTS, both[..., 1]))


def statements(imbalance: Imbalance) -> Iterator[Statement]:
    """Say how much is lost."""
    losses = [imbalance.force.near(VTS_PPT, theta) for theta in (0.1, 0.3)]
    yield Statement(
        "Section 5.1.1, Boxes 1–3",
        "that slave and master share a normal is assumed for simplicity, and said not to matter",
        "action is not reaction where areas lie over several segments: the master gets 1 − cos θ less than the "
        f"slave, {number(losses[0])} of the force at θ = 0.1 and {number(losses[1])} at 0.3, and a moment is lost "
        "with it",
        Agreement.DEFECT if max(losses) > 1e-6 else Agreement.AGREES,
        "defect-tilt",
    )


@PaperFigure.define(
    "defect-tilt",
    "(a) Force and (b) moment that are lost between slave and master when the slave is tilted.",
)
def plot(imbalance: Imbalance) -> Figure:
    """Draw both losses over the tilt."""
    figure, (force, moment) = new_panels(3.6, 2)
    force.plot(TILTS[1:], 1 - np.cos(TILTS[1:]), **REFERENCE_LINE)
    plot_logarithmic(force, imbalance.force)
    plot_logarithmic(moment, imbalance.moment)
    force.set_ylabel("|ΣR| / slave force (–)")
    moment.set_ylabel("|Σx×R| / (force × length) (–)")
    for axes in (force, moment):
        axes.set_xlabel("tilt θ (rad)")
    add_legend(figure, FORMULATIONS, reference="1 − cos θ", columns=3)
    return figure


def _imbalance(formulation: PaperFormulation, theta: float) -> tuple[float, float]:
    """Return the losses of force and of moment."""
    x, forces = nodal_forces(formulation, theta, _MASTER)
    size = float(np.linalg.norm(forces[:2].sum(axis=0)))
    arms = x - x[:2].mean(axis=0)
    moment = float((arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum())
    return float(np.linalg.norm(forces.sum(axis=0))) / size, abs(moment) / size


ITEM = Item(
    name="defect_tilt",
    title="Defect 1: action is not reaction under tilt",
    compute=compute,
    statements=statements,
    figures=(plot,),
    text="No case of the paper shows it: slave and master are parallel in contact, or nearly so on the disk. "
    "vts-ppt-balanced hands the master what the slave has, in proportion to Box 3.",
)
