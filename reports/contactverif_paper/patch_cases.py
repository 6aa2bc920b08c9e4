"""The items of the paper's patch tests, and what its text says of them over the penalty, which it does not print.

Source: Zavarise & De Lorenzis (2009), Sections 4.3 to 5.2.3 and 7.1, Figs. 8-12, 16-18, 20-22 and 31-36.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from contactverif.contract.arrays import IntArray
from contactverif.mechanics import newton
from contactverif.mechanics.newton import End
from contactverif.problems import catalogue
from contactverif.problems.uniform_stress import condition_tolerance
from contactverif_paper import paper_formulations as paper
from contactverif_paper.force_transmission import PrintedForces
from contactverif_paper.paper_formulations import PaperFormulation, name_columns, subject_of
from contactverif_paper.paper_item import WORDS, Agreement, Column, Item, Statement
from contactverif_paper.patch_tests import (
    FIVE,
    FOUR,
    TWO,
    YOUNG,
    PatchSetup,
    PatchTests,
    Study,
    moderate_error,
    patch_item,
    patch_solution,
    stiffness_limit,
)
from contactverif_reports.html.pages import number

# Case A1, Section 4.3: NTS fails, NTS-AR passes.
_PATCH_A1 = PatchSetup("a1", "Case A1", "10", "9", (-2.0, 2.0), (0.9, 1.1), 1.0, TWO, origin=2.0)

CASE_A1 = patch_item(
    "case_a1",
    "Case A1: two slave segments over one master segment",
    _PATCH_A1,
    captions={
        9: "Case A1: magnified penetrations. Hatched is what penetrates. Solid and filled: slave; dashed and open: "
        "master.",
        10: "Case A1: contact pressure over the exact one.",
    },
    printed=PrintedForces("Fig. 8", "the right forces on the master are 2p, 2p", "2 2", {}),
    choices={
        "Patch tests": "E = 10⁴ and ν = 0.3 in both bodies, heights 4, two layers of cells, rollers at all sides",
        "Penalty of the figures": "one for each panel, so that its curves use the pressure axis that the paper prints",
        "Pressure of NTS and of two passes": "the nodal force over the node's share of the interface, Eq. 3",
    },
)


# Case A2, Section 4.4: the paper prints no lengths. Its axis runs from −5 to 5, so the block is 10 wide.
_X_AXIS, _AXIS = (-5.0, 5.0), (0.8, 1.8)

CASE_A2 = patch_item(
    "case_a2",
    "Case A2: a block on a rigid foundation",
    PatchSetup("a2-uniform", "Case A2, uniform mesh", "12(a)", "11(a, b)", _X_AXIS, _AXIS, 0.06, TWO),
    PatchSetup("a2-graded", "Case A2, graded mesh", "12(b)", "11(c, d)", _X_AXIS, _AXIS, 0.3, TWO),
    captions={
        11: "Case A2: magnified penetrations; (a, b) uniform mesh, (c, d) graded mesh.",
        12: "Case A2: contact pressure over the exact one; (a) uniform mesh, (b) graded mesh.",
    },
    choices={"Case A2": "the lengths of the segments: 2 2 2 2 2 in the uniform mesh, 1 2 3 4 in the graded one"},
)


# Case B, Section 5.1.3: each area of competence lies over one master segment. NTS-AR fails, VTS-ME passes.
_PATCH_B = PatchSetup("b", "Case B", "18", "17", (0.0, 12.0), (0.8, 1.6), 0.06, FOUR)
_EXACT_B = "3/2 3 7/2 3 1"

CASE_B = patch_item(
    "case_b",
    "Case B: non-matching meshes that VTS-ME can handle",
    _PATCH_B,
    captions={17: "Case B: magnified penetrations.", 18: "Case B: contact pressure over the exact one."},
    printed=PrintedForces(
        "Fig. 16",
        "NTS hands wrong forces to the master although those on the slave are right; VTS-ME hands over the right ones",
        _EXACT_B,
        {paper.NTS_AR: "5/3 10/3 3 2 2", paper.VTS_ME: _EXACT_B},
    ),
    text="In Fig. 16 the paper’s “NTS” starts from the right slave forces: that is NTS-AR.",
)


@dataclass(frozen=True, slots=True)
class _TwoPasses:
    """Errors of one and of two passes on case B."""

    departure: Annotated[tuple[float, float], Column("passes", "1", "largest |p/p_exact − 1|, Fig. 18")]
    stress_error: Annotated[tuple[float, float], Column("passes", "1", "stress error at 10 E/h")]
    limit: Annotated[float, Column("", "m-1", "penalty over E up to which two passes are no better")]


def _compute_passes() -> _TwoPasses:
    departures = patch_solution(_PATCH_B).departures
    return _TwoPasses(
        (departures[paper.NTS_AR], departures[paper.TWO_PASS]),
        (moderate_error(paper.NTS_AR, "b"), moderate_error(paper.TWO_PASS, "b")),
        stiffness_limit(_PATCH_B, lambda departure: departure[paper.TWO_PASS] >= departure[paper.NTS_AR]),
    )


def _pass_statements(errors: _TwoPasses) -> Iterator[Statement]:
    (single, double), (moderate_one, moderate_two) = errors.departure, errors.stress_error
    yield Statement(
        "Section 5.1.3",
        "case B: two passes with a penalty do not come nearer than one",
        f"at the soft penalty of Fig. 18 pressures depart by up to {double:.2f} from the exact one with "
        f"two passes and by {single:.2f} with one. At ε̂ = 10 E/h the error of the stress is "
        f"{moderate_one / moderate_two:.0f} times smaller with two, which lock",
        Agreement.decide(double >= single, always=moderate_two >= moderate_one),
        "fig18",
        f"ε̂ ≤ {errors.limit:.2f} E per unit of length",
    )


SECTION_5_1_3 = Item(
    name="section_5_1_3", title="Section 5.1.3: one pass and two", compute=_compute_passes, statements=_pass_statements
)


# Case C, Section 5.2.3: the virtual slave node at x = 9 lies exactly on a master node. There VTS-ME is pushed by one
# master segment or by the other, and Newton's method may take turns between the two states.
PATCH_C = PatchSetup("c", "Case C", "22", "21", (0.0, 12.0), (0.7, 1.7), 0.06, FIVE)
SCENES = ("c", "c-prime")  # The virtual slave nodes of C′ lie beside master nodes.
STIFFNESS = (0.01, 0.03, 0.06, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_EXACT_C = "3/2 3 3 3 3/2"
_ENDS = {end.label.replace(" ", "_"): int(end) for end in End}


@dataclass(frozen=True, slots=True, eq=False)
class _Ends:
    """The end of Newton's method with VTS-ME, over the penalty."""

    end: Annotated[IntArray, Column("scene penalty", "1", "how Newton's method ended with VTS-ME", meanings=_ENDS)]
    scene: Annotated[tuple[str, ...], Column("scene", WORDS, "scene, as on the command line")] = SCENES
    stiffness: Annotated[tuple[float, ...], Column("penalty", "m-1", "penalty over E")] = STIFFNESS


def _compute_ends() -> _Ends:
    ends = np.zeros((len(SCENES), len(STIFFNESS)), dtype=np.int64)
    for row, column in np.ndindex(ends.shape):
        scene = catalogue.make_scene(SCENES[row], penalty=STIFFNESS[column] * YOUNG)
        ends[row, column] = newton.solve(scene, subject_of(paper.VTS_ME).for_case(scene.case())).end
    return _Ends(ends)


def _convergence_statement(tests: PatchTests) -> Statement:
    curve = tests.patches[0].curves[paper.VTS_ME]
    printed, beside = tests.numbers.end == End.CONVERGED
    result = f"at ε̂ = {PATCH_C.stiffness:g} × E Newton’s method ends: {curve.end}"
    if not printed.all():
        share = "at all" if beside.all() else f"at {int(beside.sum())} of"
        missed = np.array(STIFFNESS)[~printed]
        result += (
            f". It does not converge for ε̂/E from {missed.min():g} to {missed.max():g}: a virtual slave node lies "
            f"exactly on the master node x = 9, and its two segments take turns. On C′, where it lies beside the "
            f"node, VTS-ME converges {share} {len(STIFFNESS)} penalties"
        )
    return Statement(
        "Figs. 21, 22",
        "case C: VTS-ME has a solution, of which the mesh and the pressure are shown",
        result,
        Agreement.decide(curve.solution.converged),
        "fig22",
    )


CASE_C = patch_item(
    "case_c",
    "Case C: an area of competence over two master segments",
    PATCH_C,
    captions={
        21: "Case C: magnified penetrations.",
        22: "Case C: contact pressure over the exact one. VTS-ME is in a 2-cycle, of which one state is drawn.",
    },
    printed=PrintedForces(
        "Fig. 20",
        "NTS and VTS-ME hand wrong forces to the master; VTS-PPT hands over the right ones",
        _EXACT_C,
        {paper.NTS_AR: "5/3 10/3 7/3 8/3 2", paper.VTS_ME: "3/2 3 17/6 10/3 4/3", paper.VTS_PPT: _EXACT_C},
    ),
    study=Study("vts_me", _compute_ends, _convergence_statement, {"figure": "Figs. 21, 22"}),
)


# Section 7.1: the punch of Taylor and Papadopoulos. Areas of competence cross master nodes in Example 1bis only.
_PATCH_1 = PatchSetup("example-1", "Example 1", "33", "32", (-3.0, 3.0), (0.6, 2.2), 0.06, FOUR, close_up=(0.8, 1.2))

EXAMPLE_1 = patch_item(
    "example_1",
    "Example 1: the punch of Taylor and Papadopoulos",
    _PATCH_1,
    captions={
        31: "Example 1: the meshes. Slave lengths 2 2 2 over master lengths 3 1 4 1 3; the paper draws them and prints "
        "no lengths.",
        32: "Example 1: magnified penetrations.",
        33: "Example 1: contact pressure over the exact one; (b) is a close-up.",
    },
    choices={
        "Example 1": "master lengths 3 1 4 1 3. With six equal ones each slave node faces the middle of one, and "
        "two-pass NTS-AR passes by symmetry"
    },
)


_PATCH_1BIS = PatchSetup(
    "example-1bis", "Example 1bis", "36", "35", (-3.0, 3.0), (0.6, 1.4), 0.06, FIVE, close_up=(0.8, 1.2)
)

EXAMPLE_1BIS = patch_item(
    "example_1bis",
    "Example 1bis: the same punch on another mesh",
    _PATCH_1BIS,
    captions={
        34: "Example 1bis: the meshes. Slave lengths 2 2 2 over master lengths 1.625, five of 1.75, 1.625; the paper "
        "draws them and prints no lengths.",
        35: "Example 1bis: magnified penetrations.",
        36: "Example 1bis: contact pressure over the exact one; (b) is a close-up.",
    },
    choices={"Example 1bis": "the lengths of the segments: 1.625 1.75 1.75 1.75 1.75 1.75 1.625 in the master"},
)


UNEQUAL = 10.0  # The stiffness of the other foundation over that of the punch.
_SETUPS = (_PATCH_1, _PATCH_1BIS)
_COMPARED = (paper.NTS_AR, paper.NTS, paper.TWO_PASS)
_UNEQUAL = "VTS-PPT on Example 1bis, the foundation ten times as stiff: error of the stress, and tolerance"


@dataclass(frozen=True, slots=True)
class _Section71:
    """Errors on Examples 1 and 1bis."""

    departure: Annotated[
        tuple[tuple[float, ...], ...], Column("scene formulation", "1", "largest |p/p_exact − 1| of the figures")
    ]
    limit: Annotated[tuple[float, ...], Column("scene", "m-1", "penalty over E up to which NTS-AR departs least")]
    # Of NTS-AR and of two passes.
    stress_error: Annotated[tuple[float, float], Column("passes", "1", "Example 1: stress error at 10 E/h")]
    unequal: Annotated[tuple[float, float], Column("bound", "1", _UNEQUAL)]
    setups: Annotated[
        tuple[PatchSetup, ...], Column("scene", WORDS, "scene, as on the command line", part="scene", name="scene")
    ] = _SETUPS
    formulations: Annotated[tuple[PaperFormulation, ...], name_columns("formulation")[0]] = _COMPARED


def _compute_examples() -> _Section71:
    departures = [patch_solution(setup).departures for setup in _SETUPS]
    scene = catalogue.make_scene("example-1bis", ratio=UNEQUAL)
    return _Section71(
        tuple(tuple(row[formulation] for formulation in _COMPARED) for row in departures),
        tuple(
            stiffness_limit(setup, lambda row: row[paper.NTS_AR] <= min(row[paper.NTS], row[paper.TWO_PASS]))
            for setup in _SETUPS
        ),
        (moderate_error(paper.NTS_AR, "example-1"), moderate_error(paper.TWO_PASS, "example-1")),
        (moderate_error(paper.VTS_PPT, "example-1bis", UNEQUAL), condition_tolerance(scene, scene.penalty)),
    )


def _example_statements(section: _Section71) -> Iterator[Statement]:
    holds = all(row[0] <= min(row[1:]) for row in section.departure)
    single, double = section.stress_error
    rows = " and ".join(f"{ar:.2f} (NTS {nts:.2f}, two-pass {passes:.2f})" for ar, nts, passes in section.departure)
    limits = ", ".join(
        f"ε̂ ≤ {limit:.2f} E per unit of length in {setup.title}"
        for limit, setup in zip(section.limit, _SETUPS, strict=True)
    )
    yield Statement(
        "Section 7.1",
        "Examples 1 and 1bis: NTS-AR fails, but does well beside NTS and two-pass NTS-AR",
        f"at the soft penalty of the figures pressures of NTS-AR depart by up to {rows}. At ε̂ = 10 E/h two passes have "
        f"the smaller error of the stress, {number(double, 2)} to {number(single, 2)} in "
        "Example 1",
        Agreement.decide(holds, always=single <= double),
        "fig33",
        limits,
    )
    error, tolerance = section.unequal
    yield Statement(
        "Section 7.1",
        "punch and foundation of different materials would have a constant pressure too",
        f"VTS-PPT finds it on Example 1bis with a foundation {UNEQUAL:g} times as stiff: error of the stress "
        f"{number(error, 2)}",
        Agreement.decide(error <= tolerance),
    )


SECTION_7_1 = Item(
    name="section_7_1",
    title="Section 7.1: what is said of both examples",
    compute=_compute_examples,
    statements=_example_statements,
)
