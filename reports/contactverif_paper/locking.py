"""Section 6.3, continued: what constraints that are not inf-sup stable do at a high penalty.

The compliance and the pressures of two blocks under a wave of pressure, as the property `stability.locking` measures
them; and the pressures that real contact, which may open, has at the highest penalty.

Source: Zavarise & De Lorenzis (2009), Section 6.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray
from contactverif.contract.columns import Group
from contactverif.mechanics.newton import solve
from contactverif.problems.refined_blocks import (
    COLUMNS,
    LENGTH,
    MEAN_PRESSURE,
    PENALTIES,
    case_name,
    wave_blocks,
    wave_cases,
)
from contactverif_paper.figure_style import add_legend, line_style, new_panels
from contactverif_paper.paper_columns import Column, Formulations, to_group
from contactverif_paper.paper_formulations import (
    MORTAR,
    NTS_AR,
    STS,
    TWO_PASS,
    VTS_PPT,
    PaperFormulation,
    measure,
    subject_of,
)
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement

FORMULATIONS = (VTS_PPT, TWO_PASS, STS, NTS_AR, MORTAR)
WITH_PRESSURES = (STS, MORTAR)  # Their pressures in real contact are drawn.
FINER = COLUMNS[1]  # 12 slave segments on 8 master segments: every formulation that locks does so there.
REAL = COLUMNS[0]
STEPS = 10.0 ** np.arange(1, 7)  # Penalties ε̂ h/E of real contact; each starts from the solution before.
AMPLITUDE = 0.8  # The wave of real contact over its mean pressure.


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """Real contact, which may open, at the highest penalty."""

    x: Annotated[FloatArray, Column("point", "length", "place of the contact point")]
    pressure: Annotated[FloatArray, Column("point", "1", "pressure over the mean load at ε̂ = 1e6 E/h")]
    converged: bool  # At each penalty.


@dataclass(frozen=True, slots=True, eq=False)
class Locking:
    """Compliance and pressures."""

    # Since the softest penalty.
    drift: Annotated[FloatArray, Column("formulation penalty", "1", "loss of compliance beside matching meshes")]
    roughness: Annotated[
        FloatArray, Column("formulation penalty", "1", "range of pressures over that of matching meshes")
    ]
    contacts: tuple[Contact, ...]  # For each of `WITH_PRESSURES`.
    formulations: Formulations = FORMULATIONS
    penalty: Annotated[tuple[float, ...], Column("penalty", "1", "penalty ε̂ h/E")] = tuple(PENALTIES)


def compute(report_progress: Progress) -> Locking:
    """Solve two blocks at all penalties."""
    report_progress("Section 6.3, locking")
    cases = {case.name: case for case in wave_cases()}
    table = np.zeros((2, len(FORMULATIONS), len(PENALTIES)))
    for row, formulation in enumerate(FORMULATIONS):
        for column, penalty in enumerate(PENALTIES):
            measurement = measure("stability.locking", cases[case_name(FINER, penalty)], formulation)
            assert measurement is not None
            names = ("drift of the compliance", "roughness of the pressure")
            table[:, row, column] = [measurement.values[name] for name in names]
    drift, roughness = table
    return Locking(drift, roughness, tuple(map(_real_contact, WITH_PRESSURES)))


def _real_contact(formulation: PaperFormulation) -> Contact:
    """Solve at rising penalties."""
    start, converged = None, True
    for penalty in STEPS.tolist():
        scene = wave_blocks(*REAL, penalty, wave=AMPLITUDE * MEAN_PRESSURE)
        plugin = subject_of(formulation).for_case(scene.case())
        trace = solve(scene, plugin, start=start)
        start, converged = trace.solution, converged and trace.converged
    points = plugin.contact_points(scene.interface, plugin.pair(scene.interface, trace.z), trace.z)
    order = np.argsort(points.position[:, 0])
    return Contact(points.position[order, 0], points.pressure[order] / MEAN_PRESSURE, converged)


def statements(result: Locking) -> Iterator[Statement]:
    """Say what happens at a high penalty."""
    drift = dict(zip(FORMULATIONS, result.drift[:, -1], strict=True))
    rough, smooth = (f"{row.pressure.min():.2f} to {row.pressure.max():.1f}" for row in result.contacts)
    yield Statement(
        "Section 6.3",
        "what a high penalty does to VTS-PPT and to segment-to-segment is not said",
        f"both lock. From ε̂ = 10 to 1e8 E/h an interface of {FINER[0]} on {FINER[1]} segments loses "
        f"{drift[VTS_PPT]:.0%} (VTS-PPT), {drift[STS]:.0%} (segment-to-segment) and "
        f"{drift[TWO_PASS]:.0%} (two-pass NTS-AR) of its compliance to a wave of pressure; mortar "
        f"{abs(drift[MORTAR]):.1%}. Under a load of p̄ (1 + 0.8 cos(2πx/L)), p̄ = E/{1 / MEAN_PRESSURE:g}, with "
        f"{REAL[0]} on {REAL[1]} segments the pressures of segment-to-segment go from {rough} times the mean load p̄ at "
        f"1e6 E/h, those of mortar from {smooth}",
        Agreement.SILENT,
        "locking-stiff",
    )


@PaperFigure.define(
    "locking-stiff",
    f"(a) The compliance to a wave of pressure that an interface of {FINER[0]} on {FINER[1]} segments loses as "
    f"the penalty rises, beside matching meshes. (b) The pressures of {REAL[0]} on {REAL[1]} segments at "
    f"1e6 E/h under p̄ (1 + 0.8 cos(2πx/L)), p̄ = E/{1 / MEAN_PRESSURE:g}, in contact that may open.",
)
def plot(result: Locking) -> Figure:
    """Draw the loss of compliance over the penalty, and pressures of real contact."""
    figure, (loss, pressure) = new_panels(3.8, 2)
    for formulation, values in zip(FORMULATIONS, result.drift, strict=True):
        loss.semilogx(PENALTIES, 100 * values, **line_style(formulation, 1))
    loss.set(xlabel="penalty ε̂ h/E (–)", ylabel="loss of compliance (%)")
    for formulation, contact in zip(WITH_PRESSURES, result.contacts, strict=True):
        pressure.plot(contact.x / LENGTH, contact.pressure, **line_style(formulation, 1))
    pressure.set(xlabel="x / L (–)", ylabel="pressure / mean load (–)")
    add_legend(figure, FORMULATIONS, columns=3)
    return figure


def datasets(result: Locking) -> dict[str, Group]:
    """Return compliance, roughness, and the pressures of real contact."""
    contacts = zip(WITH_PRESSURES, result.contacts, strict=True)
    return {"": to_group(result)} | {row.name: to_group(contact) for row, contact in contacts}


ITEM = Item(
    name="locking",
    title="Section 6.3: locking",
    compute=compute,
    statements=statements,
    datasets=datasets,
    figures=(plot,),
    text="Two 4 × 1 blocks with meshes that share no node but at the ends. Springs at two points of a slave segment or "
    "more are more conditions than the gap between the meshes can satisfy. So the gap, and with it the interface, "
    "becomes straight. In real contact, points open until the rest carries the load.",
)
