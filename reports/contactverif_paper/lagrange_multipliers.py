"""Lagrange multipliers: whether VTS-PPT satisfies the inf-sup condition, and the paper's patch tests with multipliers.

The constant β of five meshes is that of the property `stability.inf-sup`. Its three families of meshes have a slave
that is coarser than the master, a finer one, and nodes on nodes. The paper uses penalties throughout and states what
multipliers do: one-pass NTS fails the patch test, two-pass NTS passes it, and VTS-PPT passes it.

Source: Zavarise & De Lorenzis (2009), Sections 2, 5.1.3, 6, 6.3 and 7.1.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.mechanics import newton
from contactverif.mechanics.bodies import Rectangle
from contactverif.oracle.flat_answers import uniform_pressure_weights
from contactverif.problems import catalogue
from contactverif.problems.blocks import two_blocks
from contactverif.problems.refined_blocks import FAMILIES, N_MESHES, refinement_cases
from contactverif.problems.uniform_stress import condition_tolerance, stress_error
from contactverif_paper.figure_style import add_legend, line_style, new_panels, use_decades
from contactverif_paper.paper_formulations import Formulations, PaperFormulation, measure, subject_of
from contactverif_paper.paper_item import WORDS, Agreement, Cell, Column, Item, PageTable, PaperFigure, Statement
from contactverif_paper.patch_tests import PRINTED_COLUMN
from contactverif_reports.html.pages import number

VTS_PPT = PaperFormulation("VTS-PPT", "vts-ppt-lm", 0)
ONE_POINT = PaperFormulation("VTS-PPT, n = 1", "vts-ppt-lm:n=1", 4)
TWO_PASS = PaperFormulation("two-pass NTS", "two-pass/nts-lm", 2)
NTS = PaperFormulation("NTS", "nts-lm", 3)
MORTAR = PaperFormulation("mortar", "mortar-lm", 5)
DUAL = PaperFormulation("dual mortar", "mortar-dual-lm", 1)
INF_SUP_FORMULATIONS = (VTS_PPT, ONE_POINT, TWO_PASS, NTS, MORTAR, DUAL)
STABLE_SLOPE = 0.1  # The tolerance of the property.
_SERIES = ("inf-sup constant", "slave segment", "zero eigenvalues", "multipliers")


@dataclass(frozen=True, slots=True, eq=False)
class Constants:
    """The inf-sup constants."""

    beta: Annotated[
        FloatArray, Column("formulation family mesh", "1", "smallest inf-sup constant that is not 0", name="constant")
    ]
    segments: Annotated[FloatArray, Column("family mesh", "length", "slave segment h", name="segment")]
    zeros: Annotated[FloatArray, Column("formulation family", "1", "share of pressures that move nothing, finest mesh")]
    slope: Annotated[FloatArray, Column("formulation family", "1", "slope of log β against log h, two finest meshes")]
    formulations: Formulations = INF_SUP_FORMULATIONS
    family: Annotated[tuple[str, ...], Column("family", WORDS, "slave against master")] = tuple(FAMILIES)

    def stable(self, formulation: PaperFormulation) -> bool:
        """Return whether β does not fall, and every pressure moves something, on all families."""
        row = INF_SUP_FORMULATIONS.index(formulation)
        return bool((self.zeros[row] == 0).all() and (self.slope[row] <= STABLE_SLOPE).all())


def _compute_constants() -> Constants:
    table = np.array(
        [[_series(case, formulation) for case in refinement_cases()] for formulation in INF_SUP_FORMULATIONS]
    )  # (n_formulations, n_families, 4, n_meshes)
    beta, segments = table[:, :, 0], table[0, :, 1]
    slopes = np.diff(np.log(beta[..., -2:]))[..., 0] / np.diff(np.log(segments[:, -2:]))[:, 0]
    return Constants(beta, segments, table[:, :, 2, -1] / table[:, :, 3, -1], slopes)


def _series(case: Case, formulation: PaperFormulation) -> list[FloatArray]:
    measurement = measure("stability.inf-sup", case, formulation)
    assert measurement is not None
    return [measurement.series[name] for name in _SERIES]


def _inf_sup_statements(constants: Constants) -> Iterator[Statement]:
    coarser, finer, matching = range(len(FAMILIES))
    pair, single, passes = (INF_SUP_FORMULATIONS.index(row) for row in (VTS_PPT, ONE_POINT, TWO_PASS))
    stable = [row.legend for row in INF_SUP_FORMULATIONS if constants.stable(row)]
    yield Statement(
        "Section 6.3",
        "it is not proved that VTS-PPT satisfies the inf-sup condition, and it is possible that it shares what the "
        "mortar method has",
        "it does not: with two virtual slave nodes a segment, β falls like h to the power "
        f"{constants.slope[pair, coarser]:.2f} on a slave that is coarser than the master (2:3), if pressures are "
        "measured by √h times their L2 norm, and "
        f"{constants.zeros[pair, finer]:.0%} of all pressures move nothing on a finer one (3:2). With one virtual "
        f"slave node, β falls like h to the power {constants.slope[single, matching]:.2f} on matching meshes. "
        f"β is constant on all meshes for: {', '.join(stable)}. In two passes, "
        f"{constants.zeros[passes, coarser]:.0%} (2:3) to {constants.zeros[passes, matching]:.0%} (matching) of "
        "all pressures move nothing: one for each pair of nodes in one place",
        Agreement.decide(constants.stable(VTS_PPT) is constants.stable(MORTAR)),
        "inf-sup",
    )


@PaperFigure.define(
    "inf-sup",
    "The inf-sup constant on five meshes, (a) with a slave that is coarser than the master, (b) with a finer "
    "one, and (c) with nodes on nodes; pressures are measured by √(h/E) times their L2 norm. Where some pressures move "
    "nothing, their constant is 0, and the pale curve is that of the others. NTS (large) and dual mortar coincide.",
)
def _plot_constants(constants: Constants) -> Figure:
    figure, panels = new_panels(3.6, len(FAMILIES), sharey=True)
    for column, (axes, name) in enumerate(zip(panels, FAMILIES, strict=True)):
        for row, formulation in enumerate(INF_SUP_FORMULATIONS):
            more: dict[str, Any] = {} if constants.zeros[row, column] == 0 else {"alpha": 0.35}
            if formulation is NTS:  # Dual mortar has the same curve.
                more |= {"markersize": 8.0, "zorder": 2}
            axes.plot(constants.segments[column], constants.beta[row, column], **line_style(formulation, 1, **more))
        axes.set_xscale("log", base=2)
        axes.set(xlabel="h (length)", title=name)
        use_decades(axes)
        lines = [
            f"{zeros:.0%} of {row.legend}"
            for row, zeros in zip(INF_SUP_FORMULATIONS, constants.zeros[:, column], strict=True)
            if zeros
        ]
        top = 0.36 if constants.zeros[INF_SUP_FORMULATIONS.index(VTS_PPT), column] else 0.52  # Above its low curve.
        text = "\n".join(["move nothing:", *lines])
        axes.text(0.04, top, text, transform=axes.transAxes, va="top", color="0.25", fontsize=9, linespacing=1.4)
    panels[0].set_ylabel("inf-sup constant β (–)")
    add_legend(figure, INF_SUP_FORMULATIONS, columns=3)
    return figure


def _inf_sup_tables(constants: Constants) -> Iterator[PageTable]:
    rows = []
    for row, formulation in enumerate(INF_SUP_FORMULATIONS):
        cells = []
        for column in range(len(FAMILIES)):
            zeros, slope = constants.zeros[row, column], constants.slope[row, column]
            tone = "n good" if zeros == 0 and slope <= STABLE_SLOPE else "n bad"
            slope = 0.0 if abs(slope) < 0.005 else slope  # No −0.00.
            details = (f"slope {slope:.2f}", f"{zeros:.0%} move nothing")
            cells.append(Cell((number(constants.beta[row, column, -1], 2),), details, tone))
        rows.append((formulation.legend, cells))
    caption = "Inf-sup constant β on the finest of five meshes; below, its slope against h, and how many pressures move"
    yield PageTable.of_cells(f"{caption} nothing", ("Formulation", *FAMILIES), rows)


INF_SUP = Item(
    name="inf_sup_condition",
    title="Section 6.3: the inf-sup condition",
    compute=_compute_constants,
    statements=_inf_sup_statements,
    attributes={"n_meshes": N_MESHES},
    figures=(_plot_constants,),
    tables=_inf_sup_tables,
    text="The paper has no proof that VTS-PPT satisfies the inf-sup condition, and supposes that it does what the "
    "mortar method does. With multipliers it does not. B S⁻¹ Bᵀ λ = β² h A λ / E has an eigenvalue for "
    "each multiplier: B are the rows of "
    "forces or of gaps where two blocks touch (the smaller β counts), S is the condensed stiffness of both blocks, A "
    "holds the areas, and h is the slave segment. A pressure at two points of each segment can vary in more ways than "
    "the gap between two meshes. Some of those ways are held by next to nothing, or by nothing at all. The patch test "
    "does not see them, since a uniform pressure is none of them. As a penalty in place of the multipliers rises, "
    "the same points lock.",
)


VTS_ME = PaperFormulation("VTS-ME", "vts-me-lm")
TEST_FORMULATIONS = (NTS, TWO_PASS, VTS_ME, VTS_PPT, MORTAR, DUAL)

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
class _MultiplierTest:
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
        return self.error <= self.tolerance

    @property
    def uniform(self) -> bool:
        return max(abs(self.low - 1), abs(self.high - 1)) <= self.tolerance

    @property
    def title(self) -> str:
        return f"{self.formulation.legend} on {SCENES[self.scene]}"


def _compute_tests() -> tuple[_MultiplierTest, ...]:
    return tuple(_test(formulation, name) for formulation in TEST_FORMULATIONS for name in SCENES)


def _test(formulation: PaperFormulation, name: str) -> _MultiplierTest:
    if name == EIGHT_ON_TWO:  # VTS-PPT's constraints depend on one another there.
        layers = np.linspace(0.0, 4.0, 3)
        scene = two_blocks(
            Rectangle(np.linspace(0.0, 8.0, 9), layers, young=1e4, poisson=0.3),
            Rectangle(np.linspace(0.0, 8.0, 3), layers - 4.0, young=1e4, poisson=0.3),
            penalty=1e5,
            pressure=100.0,
        )
    else:
        scene = catalogue.make_scene("c", refine=2) if name == REFINED else catalogue.make_scene(name)
    subject, tolerance = subject_of(formulation), condition_tolerance(scene, scene.penalty)
    trace = newton.solve(scene, subject.for_case(scene.case()))
    pressures = trace.multipliers / float(scene.facts["pressure"])
    if subject.traits.rules.penalty == "nodal":  # The slave's nodes, in a second pass the master's too.
        lengths = uniform_pressure_weights(scene.interface, scene.facts["along"])[: len(pressures)]
        pressures = pressures[lengths > 0] / lengths[lengths > 0]
    ends = pressures.min(initial=np.inf), pressures.max(initial=-np.inf)
    low, high = (0.0 if abs(value) <= tolerance else float(value) for value in ends)  # Without roundoff of 0.
    return _MultiplierTest(
        formulation=formulation,
        scene=name,
        end=trace.end.label,
        error=stress_error(scene, scene.stresses(trace.solution)) if trace.converged else np.nan,
        tolerance=tolerance,
        low=low,
        high=high,
        deficiency=trace.deficiency,
        printed=PRINTED.get(formulation, {}).get(name, -1),
    )


def _test_statements(tests: tuple[_MultiplierTest, ...]) -> Iterator[Statement]:
    spoken = [test for test in tests if test.printed >= 0]
    wrong = [test.title for test in spoken if test.passes != (test.printed == 1)]
    result = f"{len(spoken) - len(wrong)} of {len(spoken)} verdicts on the stress are the same"
    result += f"; others: {', '.join(wrong)}" if wrong else ""
    yield Statement(
        "Sections 2, 5.1.3, 6, 7.1",
        "with Lagrange multipliers one-pass NTS fails the patch test, two-pass NTS passes it, and VTS-PPT does",
        result,
        Agreement.decide(not wrong),
    )
    uneven = [test for test in tests if test.passes and not test.uniform and test.formulation != TWO_PASS]
    ranges = "; ".join(f"{test.title}: {number(test.low)} to {number(test.high)}" for test in uneven)
    yield Statement(
        "Section 6",
        "it is not said whether multipliers are uniform where the stress is",
        f"some are not, over the exact pressure: {ranges}" if uneven else "all are",
        Agreement.SILENT,
    )
    deficiency = {row: max(test.deficiency for test in tests if test.formulation == row) for row in TEST_FORMULATIONS}
    one_pass, two_passes, mortar = deficiency[NTS], deficiency[TWO_PASS], deficiency[MORTAR]
    yield Statement(
        "Section 2",
        "of NTS with multipliers one pass is stable and two passes are not (after El-Abbasi and Bathe)",
        f"multipliers that are not unique: {one_pass} with one pass, up to {two_passes} with two",
        Agreement.decide(one_pass == 0 < two_passes),
    )
    deficient = [test for test in tests if test.deficiency and test.formulation == VTS_PPT]
    counts = ", ".join(f"{test.deficiency} on {SCENES[test.scene]}" for test in deficient)
    refined = next(test.end for test in tests if test.formulation == VTS_PPT and test.scene == REFINED)
    yield Statement(
        "Section 6.3",
        "there is no proof of the inf-sup condition, but VTS-PPT might behave as the mortar method does",
        f"with multipliers it does not: of VTS-PPT's {counts} are not unique, of the mortar method's "
        f"{mortar or 'none'}. On C with halved cells Newton's method ends: {refined}",
        Agreement.decide(deficiency[VTS_PPT] <= mortar),
    )


def _test_tables(tests: tuple[_MultiplierTest, ...]) -> Iterator[PageTable]:
    yield PageTable.of_cells(
        "Patch tests with multipliers instead of a penalty: the stress, and the range of the multipliers",
        ("Formulation", *(title.removeprefix("case ") for title in SCENES.values())),
        [(row.legend, [_test_cell(test) for test in tests if test.formulation == row]) for row in TEST_FORMULATIONS],
    )


def _test_cell(test: _MultiplierTest) -> Cell:
    text = "✓ pass" if test.passes else "✗ fail" if np.isfinite(test.error) else test.end
    if test.printed >= 0:
        text += " =" if (test.printed == 1) == test.passes else " ≠"
    details = ["uniform" if test.uniform else f"{number(test.low)} … {number(test.high)}"]
    details += [f"{test.deficiency} not unique"] if test.deficiency else []
    return Cell((text,), tuple(details), f"row {'good' if test.passes else 'bad'}")


LAGRANGE_MULTIPLIERS = Item(
    name="lagrange_multipliers",
    title="Lagrange multipliers",
    compute=_compute_tests,
    statements=_test_statements,
    dims="row",
    attributes={"comment": "patch tests with Lagrange multipliers"},
    tables=_test_tables,
    text="Multipliers are pressures over the exact one (a nodal method: over the length that the node stands for). Two "
    "passes share the pressure between them, so theirs need not be 1. Not unique: so many constraints depend on "
    "others. “Eight on two” is a flat interface of eight slave segments on two master segments.",
)
