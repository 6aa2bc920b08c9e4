"""The patch tests of the paper: solved at a soft penalty, drawn, and compared with printed axes and forces.

The paper prints no penalty. Each figure here has one of ours (ε̂ = E in case A1, softer ones in the others, per unit of
length); the table of who passes has the moderate penalty 10 E/h. How large an error is, and which of two wrong methods
is the better one, depends on the penalty; who passes does not. Each solution is computed once in a process.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5 and 7.1, Figs. 8-12, 16-18, 20-22 and 31-36.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Annotated, Any, Self

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.schema import Group
from contactverif.mechanics import newton
from contactverif.mechanics.newton import End
from contactverif.problems import catalogue
from contactverif.problems.uniform_stress import condition_tolerance, stress_error
from contactverif.studies import solved_scenes
from contactverif_paper import figure_style
from contactverif_paper import paper_formulations as paper
from contactverif_paper.force_transmission import ForceTable, PrintedForces
from contactverif_paper.paper_formulations import PaperFormulation, name_columns, subject_of
from contactverif_paper.paper_item import (
    WORDS,
    Agreement,
    Column,
    Item,
    PaperFigure,
    Statement,
    sparse_column,
    variables_of,
)
from contactverif_reports.html.pages import number
from contactverif_reports.plot.scene_figures import colour_scale, magnifications, plot_bodies
from contactverif_reports.plot.solved_scene import Solution, SolvedScene

YOUNG = 1e4  # The modulus of the catalogue's scenes.
STRESS_ERROR = "largest error of a stress at a Gauss point over the pressure"
_TALLEST = 2.6  # Inches: the height of a panel with a deformed mesh.
_SHORT_AXIS = 4.0  # An x axis of this length has a tick at each unit.
_BAR = 10  # The length of a colour bar beside a row of panels over its width.
_ARROW = 0.12  # Length of an arrow of pressure over the height of a body.
_STIFFNESS_RANGE = 1e-2, 1e2  # ε̂ over E, per unit of length: where `stiffness_limit` searches.

TWO = (paper.NTS, paper.NTS_AR)
FOUR = (*TWO, paper.TWO_PASS, paper.VTS_ME)
FIVE = (*FOUR, paper.VTS_PPT)

PASSES, FAILURE, SILENT = 1, 0, -1  # What the paper says of a patch test.
PRINTED_COLUMN = Column(
    "", "1", "what the paper says", "missing: nothing", SILENT, {"fails": FAILURE, "passes": PASSES}
)


@dataclass(frozen=True, slots=True)
class PatchSetup:
    """A patch test of the paper as its figures show it."""

    scene: Annotated[str, Column("", WORDS, "scene, as on the command line")]
    title: str  # What the paper calls it, at the beginning of a sentence.
    pressures: str  # Numbers of the paper's figures.
    meshes: str
    # Ends of the axes that the paper prints: the coordinate, and the pressure over the exact one.
    x_axis: tuple[float, float]
    axis: tuple[float, float]
    stiffness: Annotated[float, Column("", "m-1", "penalty over E")]  # It is our choice.
    formulations: tuple[PaperFormulation, ...]  # The formulations that the figures show.
    close_up: tuple[float, float] | None = None  # Ends of the pressure axis of the close-up; None where there is none.
    origin: float = 0.0  # The scene's coordinate of the origin of the paper's axis, a length.

    @property
    def figure(self) -> Annotated[str, Column("", WORDS, "meshes, pressures")]:
        """The numbers of the paper's figures."""
        return f"{self.meshes}, {self.pressures}"


@dataclass(frozen=True, slots=True, eq=False)
class _Curve:
    x: Annotated[FloatArray, sparse_column("point", schema.LENGTH, "reference coordinate on the paper's axis")]
    pressure: Annotated[FloatArray, sparse_column("point", "1", "contact pressure over the exact one")]
    # True at the formulation's own contact points; else nodal forces over the nodes' shares of the interface.
    at_points: Annotated[
        bool, Column("", "1", "where pressures are taken", "missing: not shown", -1, {"at_nodes": 0, "at_points": 1})
    ]
    solution: Solution

    @property
    def stress_error(self) -> Annotated[float, Column("", "1", STRESS_ERROR, fill=np.nan)]:
        return self.solution.stress_error

    @property
    def iterations(self) -> Annotated[float, Column("", "1", "linear systems solved", fill=np.nan)]:
        return float(len(self.solution.residuals) - 1)

    @property
    def end(self) -> Annotated[str, Column("", WORDS, "how Newton's method ended")]:
        return self.solution.end

    @property
    def remark(self) -> str:
        """The end of Newton's method, in brackets; empty for a solution."""
        return "" if self.solution.converged else f" ({self.end})"

    @property
    def displacement_x(self) -> Annotated[FloatArray, sparse_column("node", schema.LENGTH, "displacement along x")]:
        return np.vstack(self.solution.displacements)[:, 0]

    @property
    def displacement_y(self) -> Annotated[FloatArray, sparse_column("node", schema.LENGTH, "displacement along y")]:
        return np.vstack(self.solution.displacements)[:, 1]


@dataclass(frozen=True, slots=True, eq=False)
class _PatchSolution:
    """A patch test, solved by the formulations of its figures."""

    setup: PatchSetup
    exact_pressure: Annotated[float, Column("", schema.STRESS, "exact contact pressure")]
    solved: SolvedScene  # The scene with all solutions, ready to be drawn.
    curves: Mapping[PaperFormulation, _Curve]

    @property
    def departures(self) -> dict[PaperFormulation, float]:
        """The largest |p/p_exact − 1| of each formulation."""
        return {row: float(abs(curve.pressure - 1).max()) for row, curve in self.curves.items()}

    @property
    def nodes(self) -> FloatArray:
        """The reference positions (n_nodes, 2) of the nodes of both bodies."""
        return np.vstack([body.nodes for body in self.solved.bodies])

    @property
    def penalty(self) -> Annotated[float, Column("", schema.PENALTY, "penalty")]:
        return self.solved.case.penalty

    @property
    def body(self) -> Annotated[FloatArray, Column("node", "1", "body of the node; 0 is the slave", fill=np.nan)]:
        return np.repeat(np.arange(2.0), [len(body.nodes) for body in self.solved.bodies])

    @property
    def node_x(self) -> Annotated[FloatArray, Column("node", schema.LENGTH, "reference x", fill=np.nan)]:
        return self.nodes[:, 0]

    @property
    def node_y(self) -> Annotated[FloatArray, Column("node", schema.LENGTH, "reference y", fill=np.nan)]:
        return self.nodes[:, 1]


@cache
def patch_solution(setup: PatchSetup, stiffness: float | None = None) -> _PatchSolution:
    """Solve a patch test, at the penalty of its figures by default."""
    penalty = (setup.stiffness if stiffness is None else stiffness) * YOUNG
    case = catalogue.make_scene(setup.scene, penalty=penalty).case()
    solved = solved_scenes.solve_scene(case, [subject_of(formulation) for formulation in setup.formulations])
    pairs = zip(setup.formulations, solved.solutions, strict=True)
    curves = {formulation: _curve(formulation, solved, solution, setup.origin) for formulation, solution in pairs}
    return _PatchSolution(setup, solved.solutions[0].pressure, solved, curves)


def stiffness_limit(setup: PatchSetup, holds: Callable[[dict[PaperFormulation, float]], bool]) -> float:
    """Return the ε̂/E below which a relation between departures holds, by bisection to 1 %; NaN if there is none."""

    def holds_at(stiffness: float) -> bool:
        return holds(patch_solution(setup, stiffness).departures)

    low, high = _STIFFNESS_RANGE
    if not holds_at(low) or holds_at(high):
        return np.nan
    while high / low > 1.01:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if holds_at(middle) else (low, middle)
    return low


@cache
def moderate_error(formulation: PaperFormulation, scene_name: str, ratio: float = 1.0) -> float:
    """Return the largest error of a stress over the pressure at ε̂ = 10 E/h; NaN without a solution."""
    scene = catalogue.make_scene(scene_name, ratio=ratio)
    trace = newton.solve(scene, subject_of(formulation).for_case(scene.case()))
    return stress_error(scene, scene.stresses(trace.solution)) if trace.converged else np.nan


def _curve(formulation: PaperFormulation, solved: SolvedScene, solution: Solution, origin: float) -> _Curve:
    """Take pressures at the virtual slave nodes if there are any, else nodal forces over the nodes' shares (Eq. 3)."""
    at_points = solution.points is not None and formulation in paper.VIRTUAL
    if solution.points is not None and at_points:
        x, _ = solved.points_along(solution.points)
        pressure = solution.points.pressure
    else:
        n_nodes = solved.case.interface.n_slave_nodes
        x, pressure = solved.along[:n_nodes], solved.node_pressures(solution)[:n_nodes]
        covered = np.isfinite(pressure)
        x, pressure = x[covered], pressure[covered]
    order = np.argsort(x, kind="stable")
    return _Curve(x[order] - origin, pressure[order] / solution.pressure, at_points, solution)


@dataclass(frozen=True, slots=True)
class Study:
    """The numbers that an item computes beside its patch tests."""

    name: str  # Its group.
    compute: Callable[[], Any]
    statement: Callable[["PatchTests"], Statement]
    attributes: Mapping[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class PatchTests:
    """The solved patch tests of an item, the forces of a uniform pressure, and the numbers of a study."""

    patches: tuple[_PatchSolution, ...]
    forces: ForceTable | None
    study: Study | None
    numbers: Any

    @classmethod
    def compute(cls, setups: tuple[PatchSetup, ...], printed: PrintedForces | None, study: Study | None) -> Self:
        """Solve the patch tests, and compute forces and numbers beside them."""
        forces = ForceTable.compute(setups[0].scene, setups[0].title, printed) if printed else None
        return cls(tuple(map(patch_solution, setups)), forces, study, study.compute() if study else None)

    @property
    def formulations(self) -> list[PaperFormulation]:
        """The formulations that the figures show, each once."""
        return list(dict.fromkeys(formulation for patch in self.patches for formulation in patch.curves))

    def statements(self) -> Iterator[Statement]:
        """Compare the printed forces and axes, and what the study finds."""
        if self.forces:
            yield self.forces.statement()
        yield from map(_range_statement, self.patches)
        if self.study:
            yield self.study.statement(self)

    def groups(self) -> dict[str, Group]:
        """Return patch tests, forces and numbers beside them, a group each; nothing where a figure shows none."""
        patches, rows = self.patches, tuple(self.formulations)
        cells = [[patch.curves.get(row) for row in rows] for patch in patches]
        comment = "pressures at virtual slave nodes where at_points, else nodal forces over the nodes' shares"
        variables = {column.name: column.variable([rows]) for column in name_columns("formulation")}
        variables |= variables_of([patch.setup for patch in patches], "scene")
        variables |= variables_of(patches, "scene") | variables_of(cells, "scene formulation")
        groups = {"patch": Group(variables, {"comment": comment})}
        if self.forces:
            groups["forces"] = self.forces.group()
        if self.study:
            groups[self.study.name] = Group(variables_of(self.numbers), self.study.attributes)
        return groups


def patch_item(
    name: str,
    title: str,
    *setups: PatchSetup,
    captions: Mapping[int, str],
    printed: PrintedForces | None = None,
    study: Study | None = None,
    text: str = "",
    choices: Mapping[str, str] | None = None,
) -> Item:
    """Return the item of some patch tests; the last two figures show penetrations and pressures, one before meshes."""
    plots = (_plot_meshes, _plot_penetrations, _plot_pressures)[-len(captions) :]
    return Item(
        name=name,
        title=title,
        compute=partial(PatchTests.compute, setups, printed, study),
        statements=PatchTests.statements,
        datasets=PatchTests.groups,
        figures=tuple(
            PaperFigure(f"fig{number:02}", caption, plot)
            for (number, caption), plot in zip(captions.items(), plots, strict=True)
        ),
        tables=lambda tests: [tests.forces.page_table()] if tests.forces else [],
        text=text,
        choices=choices or {},
    )


def _range_statement(patch: _PatchSolution) -> Statement:
    """Say what the printed pressure axis and our curves have in common; the paper prints no penalty."""
    setup = patch.setup
    low, high = setup.axis
    values = np.concatenate([curve.pressure for curve in patch.curves.values() if curve.solution.converged])
    least, largest = float(values.min()), float(values.max())
    inside = low <= least and largest <= high
    share = (largest - least) / (high - low)
    result = f"at ε̂ = {setup.stiffness:g} × E, which we chose, curves run from {least:.3f} to {largest:.3f}: "
    result += f"{share:.0%} of that axis" if inside else "they leave that axis"
    return Statement(
        f"Fig. {setup.pressures}",
        f"{setup.title}: the axis runs from {low:.2f} to {high:.2f} of the exact pressure; no penalty is printed",
        result,
        Agreement.SILENT if inside else Agreement.DIFFERS,
        f"fig{setup.pressures.partition('(')[0].zfill(2)}",
    )


def _plot_pressures(tests: PatchTests) -> Figure:
    views = [(patch, patch.setup.axis) for patch in tests.patches]
    views += [(patch, patch.setup.close_up) for patch in tests.patches if patch.setup.close_up]
    figure, panels = figure_style.new_panels(3.6 if len(views) > 1 else 3.4, len(views))
    for axes, (patch, limits) in zip(panels, views, strict=True):
        low, high = limits
        axes.axhline(1.0, **figure_style.REFERENCE_LINE)
        for formulation, curve in patch.curves.items():
            inside = low <= curve.pressure.min() and curve.pressure.max() <= high
            axes.plot(curve.x, curve.pressure, clip_on=not inside, **figure_style.line_style(formulation, len(curve.x)))
        axes.set(xlabel="x coordinate (length)", ylabel="contact pressure / p (–)")
        figure_style.use_round_ticks(axes, 6)
        left, right = patch.setup.x_axis
        step = 1.0 if right - left <= _SHORT_AXIS else 2.0  # The paper's axes have a tick at every second unit.
        axes.set_xticks(np.arange(left, right + 0.5, step))
        axes.set_xlim(left, right)
        axes.set_ylim(low, high)
    remarks = {row: curve.remark for patch in tests.patches for row, curve in patch.curves.items()}
    figure_style.add_legend(figure, tests.formulations, reference="exact", remarks=remarks)
    return figure


def _plot_penetrations(tests: PatchTests) -> Figure:
    """Draw one panel for each formulation and scene, the penetration magnified alike in all of a scene."""
    patches, across = tests.patches, 2
    down = -(-sum(len(patch.curves) for patch in patches) // across)
    wide, high = np.ptp(patches[0].nodes, axis=0)
    panel = min((figure_style.WIDTH - 1.6) / across, _TALLEST * wide / high)
    figure = figure_style.new_figure(down * (panel * high / wide + 0.35) + 0.7)
    grid = figure.subplots(down, across, squeeze=False)
    for axes in grid.ravel():
        axes.set_axis_off()
    letters, remaining = iter("abcdefghij"), iter(grid.ravel())
    remarks: dict[str, None] = {}
    for patch in patches:
        scale, magnified = colour_scale(patch.solved), magnifications(patch.solved)
        remarks |= dict.fromkeys(magnification.words for magnification in magnified.values())
        panels_of_scene = [next(remaining) for _ in patch.curves]
        for axes, (formulation, curve) in zip(panels_of_scene, patch.curves.items(), strict=True):
            plot_bodies(axes, patch.solved, curve.solution, magnified[curve.solution.formulation], scale)
            axes.set_title(f"({next(letters)}) {formulation.legend}{curve.remark}", loc="left")
        rows = -(-len(panels_of_scene) // across)
        bar = figure.colorbar(scale, ax=panels_of_scene, shrink=0.8, aspect=_BAR * rows, pad=0.01)
        bar.locator = MaxNLocator(5, steps=[1, 2, 5, 10])
        bar.outline.set_linewidth(0.5)
    lines = list(remarks)
    if len(lines) == 2:
        lines = [f"above: {lines[0]}", f"below: {lines[1]}"]
    # Both surfaces and the penetration, as `plot_bodies` draws them.
    pen: dict[str, Any] = {"color": "black", "linewidth": 1.3, "markersize": 3.6, "markeredgecolor": "black"}
    handles = [
        Line2D([], [], label="slave", marker="o", **pen),
        Line2D([], [], label="master", marker="s", linestyle=(0, (4, 1.5)), markerfacecolor="white", **pen),
        Patch(facecolor="white", edgecolor="0.35", linewidth=0, hatch="xxxxxx", label="penetration"),
    ]
    title = "\n".join(["colour: −σₙ (force / length)", *lines])
    figure.legend(
        handles=handles, loc="outside lower center", ncols=3, title=title, title_fontsize=figure_style.LETTERS
    )
    return figure


def _plot_meshes(tests: PatchTests) -> Figure:
    figure = figure_style.new_figure(3.6)
    axes = figure.subplots()
    axes.set_axis_off()
    for body in tests.patches[0].solved.bodies:
        edges = list(body.nodes[edges_of(body.cells)])
        axes.add_collection(LineCollection(edges, colors="0.35", linewidths=0.7, zorder=2))
        is_slave, nodes = body.name == "slave", body.nodes[body.contact_nodes]
        marker, face = ("o", "black") if is_slave else ("s", "white")
        axes.plot(*nodes.T, ls="none", marker=marker, ms=5, mfc=face, mec="black", zorder=6 - is_slave)
        height = float(np.ptp(body.nodes[:, 1])) * _ARROW
        for x, y in body.nodes[np.flatnonzero(body.load[:, 1] < 0)]:
            axes.annotate("", (x, y), (x, y + height), arrowprops={"arrowstyle": "-|>", "color": "black", "lw": 0.8})
            axes.plot(x, y + height, alpha=0.0)
    axes.set_aspect("equal")
    axes.margins(0.04)
    axes.autoscale_view()
    figure.supxlabel("filled: slave nodes; open: master nodes; arrows: p = 1", fontsize=figure_style.LETTERS)
    return figure


def edges_of(cells: IntArray) -> IntArray:
    """Return the nodes (n_edges, 2) of the edges of some cells, each edge once."""
    pairs = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    return np.unique(np.sort(pairs, axis=1), axis=0)


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
