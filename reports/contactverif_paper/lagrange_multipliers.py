"""Lagrange multipliers on the paper's patch tests: stress, range of the multipliers, and how many are not unique.

The paper uses penalties throughout and states what multipliers do: one-pass NTS fails the patch test, two-pass NTS
passes it, and VTS-PPT passes it.

Source: Zavarise & De Lorenzis (2009), Sections 2, 5.1.3, 6, 6.3 and 7.1.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from contactverif.contract.columns import Group
from contactverif.mechanics import newton
from contactverif.mechanics.bodies import Rectangle
from contactverif.mechanics.scene import Scene
from contactverif.oracle import uniform_pressure_weights
from contactverif.problems import catalogue
from contactverif.problems.blocks import two_blocks
from contactverif.problems.uniform_stress import condition_tolerance, stress_error
from contactverif_paper.inf_sup_condition import DUAL, MORTAR, NTS, TWO_PASS, VTS_PPT
from contactverif_paper.paper_columns import WORDS, Column, variables_of
from contactverif_paper.paper_formulations import PaperFormulation, subject_of
from contactverif_paper.paper_item import Agreement, Cell, Item, PageTable, Progress, Statement
from contactverif_paper.patch_solutions import PRINTED_COLUMN
from contactverif_reports.html.pages import number

VTS_ME = PaperFormulation("VTS-ME", "vts-me-lm")
FORMULATIONS = (NTS, TWO_PASS, VTS_ME, VTS_PPT, MORTAR, DUAL)

EIGHT_ON_TWO, REFINED = "eight on two", "C with halved cells"
SCENES: Mapping[str, str] = {  # {scene: what the paper calls it, within a sentence}
    "a1": "case A1",
    "b": "case B",
    "example-1": "Example 1",
    "c": "case C",
    "c-prime": "case C′",
    "example-1bis": "Example 1bis",
    REFINED: REFINED,
    EIGHT_ON_TWO: EIGHT_ON_TWO,
}
PRINTED: Mapping[PaperFormulation, Mapping[str, int]] = {  # 1: the paper says that it passes; 0: that it fails.
    NTS: {"example-1": 0},
    TWO_PASS: {"b": 1, "example-1": 1},
    VTS_PPT: dict.fromkeys(("c", "example-1bis"), 1),
}


@dataclass(frozen=True, slots=True, eq=False)
class MultiplierTest:
    """A patch test with Lagrange multipliers."""

    formulation: Annotated[PaperFormulation, Column("", WORDS, "formulation, as on the command line", part="name")]
    scene: Annotated[str, Column("", WORDS, "scene")]  # One of `SCENES`.
    end: Annotated[str, Column("", WORDS, "how Newton's method ended")]
    error: Annotated[float, Column("", "1", "largest error of a stress over p", fill=np.nan, name="stress_error")]
    tolerance: Annotated[float, Column("", "1", "what roundoff explains")]
    # A multiplier is a pressure; that of a nodal method is divided by the length that the node stands for.
    low: Annotated[float, Column("", "1", "smallest multiplier, as a pressure over p")]
    high: Annotated[float, Column("", "1", "largest multiplier, as a pressure over p")]
    deficiency: Annotated[int, Column("", "1", "multipliers that are not unique")]  # Vanishing singular values.
    printed: Annotated[int, PRINTED_COLUMN] = -1

    @property
    def passes(self) -> bool:
        """True if the stress is exact."""
        return self.error <= self.tolerance

    @property
    def uniform(self) -> bool:
        """True if the multipliers are."""
        return max(abs(self.low - 1), abs(self.high - 1)) <= self.tolerance

    @property
    def title(self) -> str:
        """The test in words, within a sentence."""
        return f"{self.formulation.legend} on {SCENES[self.scene]}"


def compute(report_progress: Progress) -> tuple[MultiplierTest, ...]:
    """Solve each scene with each formulation."""
    tests = []
    for formulation in FORMULATIONS:
        report_progress(f"patch tests of {formulation.name}")
        tests += [_test(formulation, name, scene_of(name)) for name in SCENES]
    return tuple(tests)


def scene_of(name: str) -> Scene:
    """Return a scene of this item: a scene of the catalogue, case C on a finer mesh, or eight segments on two."""
    if name == EIGHT_ON_TWO:
        return eight_on_two()
    return catalogue.make_scene("c", refine=2) if name == REFINED else catalogue.make_scene(name)


def eight_on_two() -> Scene:
    """Return eight slave segments on two master segments: VTS-PPT's constraints depend on one another there."""
    layers = np.linspace(0.0, 4.0, 3)
    return two_blocks(
        Rectangle(np.linspace(0.0, 8.0, 9), layers, young=1e4, poisson=0.3),
        Rectangle(np.linspace(0.0, 8.0, 3), layers - 4.0, young=1e4, poisson=0.3),
        penalty=1e5,
        pressure=100.0,
    )


def statements(tests: Sequence[MultiplierTest]) -> Iterator[Statement]:
    """Compare who passes, which multipliers are uniform, and which are unique."""
    yield _pass_statement(tests)
    yield _range_statement(tests)
    yield _two_pass_statement(tests)
    yield _stability_statement(tests)


def _pass_statement(tests: Sequence[MultiplierTest]) -> Statement:
    spoken = [test for test in tests if test.printed >= 0]
    wrong = [test.title for test in spoken if test.passes != (test.printed == 1)]
    result = f"{len(spoken) - len(wrong)} of {len(spoken)} verdicts on the stress are the same"
    result += f"; others: {', '.join(wrong)}" if wrong else ""
    return Statement(
        "Sections 2, 5.1.3, 6, 7.1",
        "with Lagrange multipliers one-pass NTS fails the patch test, two-pass NTS passes it, and VTS-PPT does",
        result,
        Agreement.decide(not wrong),
    )


def _range_statement(tests: Sequence[MultiplierTest]) -> Statement:
    uneven = [test for test in tests if test.passes and not test.uniform and test.formulation != TWO_PASS]
    ranges = "; ".join(f"{test.title}: {number(test.low)} to {number(test.high)}" for test in uneven)
    return Statement(
        "Section 6",
        "it is not said whether multipliers are uniform where the stress is",
        f"some are not, over the exact pressure: {ranges}" if uneven else "all are",
        Agreement.SILENT,
    )


def _two_pass_statement(tests: Sequence[MultiplierTest]) -> Statement:
    one_pass, two_passes = (_largest_deficiency(tests, formulation) for formulation in (NTS, TWO_PASS))
    return Statement(
        "Section 2",
        "of NTS with multipliers one pass is stable and two passes are not (after El-Abbasi and Bathe)",
        f"multipliers that are not unique: {one_pass} with one pass, up to {two_passes} with two",
        Agreement.decide(one_pass == 0 < two_passes),
    )


def _stability_statement(tests: Sequence[MultiplierTest]) -> Statement:
    deficient = [test for test in tests if test.deficiency and test.formulation == VTS_PPT]
    counts = ", ".join(f"{test.deficiency} on {SCENES[test.scene]}" for test in deficient)
    refined = next(test.end for test in tests if test.formulation == VTS_PPT and test.scene == REFINED)
    mortar = _largest_deficiency(tests, MORTAR)
    return Statement(
        "Section 6.3",
        "there is no proof of the inf-sup condition, but VTS-PPT might behave as the mortar method does",
        f"with multipliers it does not: of VTS-PPT's {counts} are not unique, of the mortar method's "
        f"{mortar or 'none'}. On C with halved cells Newton's method ends: {refined}",
        Agreement.decide(not _largest_deficiency(tests, VTS_PPT) > mortar),
    )


def _largest_deficiency(tests: Sequence[MultiplierTest], formulation: PaperFormulation) -> int:
    return max(test.deficiency for test in tests if test.formulation == formulation)


def tables(tests: Sequence[MultiplierTest]) -> Iterator[PageTable]:
    """Yield the table of the page."""
    rows = {formulation: [test for test in tests if test.formulation == formulation] for formulation in FORMULATIONS}
    yield PageTable(
        "Patch tests with multipliers instead of a penalty: the stress, and the range of the multipliers",
        ("Formulation", *(title.removeprefix("case ") for title in SCENES.values())),
        tuple((Cell((formulation.legend,)), *(_cell(test) for test in row)) for formulation, row in rows.items()),
    )


def _cell(test: MultiplierTest) -> Cell:
    text = "✓ pass" if test.passes else "✗ fail" if np.isfinite(test.error) else test.end
    if test.printed >= 0:
        text += " =" if (test.printed == 1) == test.passes else " ≠"
    details = ["uniform" if test.uniform else f"{number(test.low)} … {number(test.high)}"]
    details += [f"{test.deficiency} not unique"] if test.deficiency else []
    return Cell((text,), tuple(details), f"row {'good' if test.passes else 'bad'}")


def datasets(tests: Sequence[MultiplierTest]) -> dict[str, Group]:
    """Return a row for each test."""
    return {"": Group(variables_of(tests, "row"), {"comment": "patch tests with Lagrange multipliers"})}


def _test(formulation: PaperFormulation, name: str, scene: Scene) -> MultiplierTest:
    subject, tolerance = subject_of(formulation), condition_tolerance(scene, scene.penalty)
    trace = newton.solve(scene, subject.for_case(scene.case()))
    pressures = trace.multipliers / float(scene.facts["pressure"])
    if subject.traits.rules.penalty == "nodal":  # The slave's nodes, in a second pass the master's too.
        lengths = uniform_pressure_weights(scene.interface, scene.facts["along"])[: len(pressures)]
        pressures = pressures[lengths > 0] / lengths[lengths > 0]
    return MultiplierTest(
        formulation=formulation,
        scene=name,
        end=trace.end.label,
        error=stress_error(scene, scene.stresses(trace.solution)) if trace.converged else np.nan,
        tolerance=tolerance,
        low=_without_roundoff(pressures.min(initial=np.inf), tolerance),
        high=_without_roundoff(pressures.max(initial=-np.inf), tolerance),
        deficiency=trace.deficiency,
        printed=PRINTED.get(formulation, {}).get(name, -1),
    )


def _without_roundoff(value: float, tolerance: float) -> float:
    """Return 0 for a number that is 0 up to roundoff."""
    return 0.0 if abs(value) <= tolerance else float(value)


ITEM = Item(
    name="lagrange_multipliers",
    title="Lagrange multipliers",
    compute=compute,
    statements=statements,
    datasets=datasets,
    tables=tables,
    text="Multipliers are pressures over the exact one (a nodal method: over the length that the node stands for). Two "
    "passes share the pressure between them, so theirs need not be 1. Not unique: so many constraints depend on "
    "others. “Eight on two” is a flat interface of eight slave segments on two master segments.",
    n_steps=len(FORMULATIONS),
)
