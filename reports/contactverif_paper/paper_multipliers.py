"""Lagrange multipliers on the paper's patch tests: stress, range of the multipliers, and how many are not unique.

The paper uses penalties throughout and states what multipliers do: one-pass NTS fails the patch test, two-pass NTS
passes it, and VTS-PPT passes it.

Source: Zavarise & De Lorenzis (2009), Sections 2, 5.1.3, 6 and 7.1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from contactverif.mechanics import newton
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.simple_bodies import Rectangle
from contactverif.oracle import uniform_pressure_weights
from contactverif.scenes import catalogue
from contactverif.scenes.blocks import two_blocks
from contactverif.scenes.uniform_stress import condition_tolerance, stress_error
from contactverif_paper import cast
from contactverif_paper.paper_data import Member, MultiplierRow, Said, Statement
from contactverif_reports.html.pages import number

SCENES = ("a1", "b", "example-1", "c", "c-prime", "example-1bis")
PPT = next(member for member in cast.MULTIPLIERS if member.formulation == "vts-ppt-lm")
EIGHT_ON_TWO, REFINED = "eight on two", "C with halved cells"
SAID: Mapping[str, Mapping[str, int]] = {
    "nts-lm": {"example-1": 0},
    "two-pass/nts-lm": {"b": 1, "example-1": 1},
    "vts-ppt-lm": dict.fromkeys(("c", "example-1bis"), 1),
}


def multipliers(told: Callable[[str], None]) -> tuple[MultiplierRow, ...]:
    """A row for each formulation and scene; eight slave on two master segments, and case C finer, for the rank."""
    rows = []
    for member in cast.MULTIPLIERS:
        told(f"patch tests of {member.formulation}")
        rows += [_row(member, name, catalogue.make_scene(name)) for name in SCENES]
        rows.append(_row(member, REFINED, catalogue.make_scene("c", refine=2)))
        rows.append(_row(member, EIGHT_ON_TWO, eight_on_two()))
    return tuple(rows)


def statements(rows: Sequence[MultiplierRow], titles: Mapping[str, str]) -> tuple[Statement, ...]:
    """What the paper says, beside it; `titles` is {scene: what the paper calls it}."""

    def named(row: MultiplierRow) -> str:
        return f"{row.member.legend.removesuffix(', multipliers')} on {titles.get(row.scene, row.scene)}"

    def too_many(formulation: str) -> int:
        return max(row.deficiency for row in rows if row.member.formulation == formulation)

    spoken = [row for row in rows if row.said >= 0]
    wrong = [named(row) for row in spoken if row.stress != (row.said == 1)]
    found = f"{len(spoken) - len(wrong)} of {len(spoken)} verdicts on the stress are the same"
    found += f"; others: {', '.join(wrong)}" if wrong else ""
    hidden = [row for row in rows if row.stress and not row.uniform and "two-pass" not in row.member.formulation]
    ranges = "; ".join(f"{named(row)}: {number(row.low)} to {number(row.high)}" for row in hidden)
    short = [row for row in rows if row.deficiency and row.member.formulation == "vts-ppt-lm"]
    counts = ", ".join(f"{row.deficiency} on {titles.get(row.scene, row.scene)}" for row in short)
    return (
        Statement(
            "Sections 2, 5.1.3, 6, 7.1",
            "with Lagrange multipliers one-pass NTS fails the patch test, two-pass NTS passes it, and VTS-PPT does",
            found,
            Said.of(not wrong),
        ),
        Statement(
            "–",
            "it is not said whether multipliers are uniform where the stress is",
            f"some are not, over the exact pressure: {ranges}" if hidden else "all are",
            Said.SILENT,
        ),
        Statement(
            "Section 2",
            "of NTS with multipliers one pass is stable and two passes are not (after El-Abbasi and Bathe)",
            f"multipliers that are not unique: {too_many('nts-lm')} with one pass, up to {too_many('two-pass/nts-lm')} "
            "with two",
            Said.of(too_many("nts-lm") == 0 < too_many("two-pass/nts-lm")),
        ),
        Statement(
            "Section 6.3",
            "there is no proof of the inf-sup condition, but VTS-PPT might behave as the mortar method does",
            f"with multipliers it does not: of VTS-PPT's {counts} are not unique, of the mortar method's "
            f"{too_many('mortar-lm') or 'none'}. On C with halved cells positions are not unique either, and Newton's "
            f"method ends: {next(row.end for row in rows if row.member == PPT and row.scene == REFINED)}",
            Said.of(not too_many("vts-ppt-lm") > too_many("mortar-lm")),
        ),
    )


def eight_on_two() -> Scene:
    """Eight slave segments on two master segments: the rows of VTS-PPT's constraints depend on one another."""
    layers = np.linspace(0.0, 4.0, 3)
    return two_blocks(
        Rectangle(np.linspace(0.0, 8.0, 9), layers, young=1e4, poisson=0.3),
        Rectangle(np.linspace(0.0, 8.0, 3), layers - 4.0, young=1e4, poisson=0.3),
        penalty=1e5,
        pressure=100.0,
    )


def _row(member: Member, name: str, scene: Scene) -> MultiplierRow:
    subject, tolerance = cast.subject(member), condition_tolerance(scene, scene.penalty)
    trace = newton.solve(scene, subject.for_case(scene.case()))
    found = trace.multipliers / float(scene.facts["pressure"])
    if subject.traits.penalty == "nodal":
        lengths = uniform_pressure_weights(scene.interface, scene.facts["along"])[: len(found)]
        found = found[lengths > 0] / lengths[lengths > 0]  # the slave's nodes, in a second pass the master's too
    return MultiplierRow(
        member=member,
        scene=name,
        end=trace.end.label,
        error=stress_error(scene, scene.stresses(trace.solution)) if trace.converged else np.nan,
        tolerance=tolerance,
        low=_plain(found.min(initial=np.inf), tolerance),
        high=_plain(found.max(initial=-np.inf), tolerance),
        deficiency=trace.deficiency,
        said=SAID.get(member.formulation, {}).get(name, -1),
    )


def _plain(value: float, tolerance: float) -> float:
    """Without roundoff where it would stand for 0."""
    return 0.0 if abs(value) <= tolerance else float(value)
