"""Fig. 30 and Sections 6.1 to 6.3: how Newton's method converges with both tangents of VTS-PPT, their terms and cost.

Of Fig. 30 the paper prints neither materials nor supports nor a stopping rule; of Example 2 it prints an energy norm of
1e−15. Here ε̂ = E, p = E/100, the sides of the blocks are free (else the consistent version is exact after one step),
and the slave begins where it touches. Iterations are counted by several stopping rules. The linear rate of the basic
version is known: it is the spectral radius of I − K_basic⁻¹ K_consistent at the solution.

Exactness and order are computed in the solution of Example 1bis with a foundation half as stiff as the punch and free
sides: nothing is exact after one step there, and no end of a segment lies on another, as in case C, where
segment-to-segment has a kink. A complex step tells whether K is the derivative; its error is roundoff alone.

The paper counts terms of a formula. Here the terms are counted in the tangent itself: it is a sum of dyads a ⊗ b of the
tangential and normal vectors (t ⊗ t, t ⊗ n, n ⊗ t, n ⊗ n) for each pair of nodes, and a term is a coefficient that does
not vanish. The states are one slave segment with one virtual slave node over one, two and three master segments, all of
them bent and tilted. Cost is counted as entries of the sparse tangent on a long interface, and measured in seconds.

Source: Zavarise & De Lorenzis (2009), Fig. 30, Sections 6.1 to 6.3.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullLocator

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray, IntArray, dense
from contactverif.contract.interface import Interface
from contactverif.contract.schema import Group
from contactverif.mechanics import newton
from contactverif.mechanics.newton import Trace
from contactverif.mechanics.system import System
from contactverif.problems import catalogue
from contactverif.studies.comparison import make_state, measure_costs
from contactverif_paper import paper_formulations as paper
from contactverif_paper.example_2 import steps_until_energy
from contactverif_paper.figure_style import REFERENCE_LINE, add_legend, line_style, new_panels, use_decades
from contactverif_paper.paper_formulations import Formulations, PaperFormulation, measure, subject_of
from contactverif_paper.paper_item import (
    WORDS,
    Agreement,
    Cell,
    Column,
    Item,
    PageTable,
    PaperFigure,
    Statement,
    sparse_column,
    variables_of,
)
from contactverif_reports.html.pages import number

# Fig. 30 and Section 6.1.
FORMULATIONS = (paper.VTS_ME, paper.BASIC, paper.VTS_PPT)
YOUNG, PRESSURE = 1e4, 100.0
RATIOS = (1.0, 0.5)  # E of the master over E of the slave.
MATERIALS = ("equal materials", "master half as stiff as the slave")
STIFFNESS = (0.1, 1.0, 10.0, 100.0, 1e4)  # ε̂ over E, per unit of length.
PRINTED_ITERATIONS = 16  # The paper's basic version, and the end of its axis.
AXIS = (1e-12, 1e6)  # The printed axis has 18 decades.
_LOWEST = 1e-14  # The axis here ends lower, since residuals at roundoff do.
_STEPS_BEYOND = 6  # Newton steps that are taken behind the solution, for the stopping rules that ask for more.


@dataclass(frozen=True, slots=True, eq=False)
class _History:
    formulation: PaperFormulation
    # The first two, (n_iterates,), go up to the solution.
    residuals: Annotated[
        FloatArray, sparse_column("residuals_step", schema.FORCE, "largest entry of the residual", "residual")
    ]
    energies: Annotated[
        FloatArray, sparse_column("energies_step", "N m", "energy of a Newton step", "energy")
    ]  # |Δq · residual|
    # Only roundoff stops these steps.
    beyond: Annotated[
        FloatArray, sparse_column("beyond_step", schema.FORCE, "largest entry of the residual in further steps")
    ]
    floor: Annotated[float, Column("", schema.FORCE, "what roundoff alone makes of the residual")]
    end: Annotated[str, Column("", WORDS, "end of Newton")]

    @property
    def rate(self) -> Annotated[float, Column("", "1", "ratio of residuals, late", fill=np.nan)]:
        return _late_rate(self.residuals, self.floor)

    @property
    def all_residuals(self) -> FloatArray:
        """Those up to the solution, and those of further steps."""
        return np.concatenate([self.residuals, self.beyond])

    def steps_until_residual(self, bound: float) -> int:
        """Return the number of linear systems solved until the residual is within the bound; −1: never."""
        below = np.flatnonzero(self.all_residuals <= bound)
        return int(below[0]) if len(below) else -1


RULES: Mapping[str, Callable[[_History], int]] = {
    "residual at its own roundoff (ours)": lambda history: len(history.residuals) - 1,
    "residual below 1e−11: in the last decade of the printed axis": lambda h: h.steps_until_residual(1e-11),
    "residual below 1e−12: at the end of the printed axis": lambda h: h.steps_until_residual(1e-12),
    "energy of a step below 1e−15 of the first": lambda history: steps_until_energy(history.energies),
}


@dataclass(frozen=True, slots=True, eq=False)
class Convergence:
    """Residual histories, and the linear rate of the basic version over the penalty."""

    histories: tuple[tuple[_History, ...], ...]  # A row for each of `RATIOS`, a history for each of `FORMULATIONS`.
    radius: Annotated[FloatArray, Column("penalty", "1", "spectral radius of I − K_basic⁻¹ K_consistent")]
    # The ratio of successive residuals that Newton's method shows.
    rate: Annotated[FloatArray, Column("penalty", "1", "rate of the basic version", fill=np.nan, name="basic_rate")]
    formulations: Formulations = FORMULATIONS
    ratio: Annotated[tuple[float, ...], Column("ratio", "1", "E of the master over E of the slave")] = RATIOS
    rule: Annotated[tuple[str, ...], Column("rule", WORDS, "Newton's method stops when")] = tuple(RULES)
    stiffness: Annotated[tuple[float, ...], Column("penalty", "m-1", "penalty over E")] = STIFFNESS

    @property
    def iterations(
        self,
    ) -> Annotated[IntArray, Column("rule ratio formulation", "1", "linear systems solved; −1: never")]:
        """The numbers of linear systems by stopping rule."""
        return np.array([[[rule(each) for each in row] for row in self.histories] for rule in RULES.values()])

    def counts(self, formulation: PaperFormulation) -> IntArray:
        """Return the iterations (n_rules, n_ratios) of a formulation."""
        return self.iterations[..., FORMULATIONS.index(formulation)]


def _compute_convergence() -> Convergence:
    histories = tuple(tuple(_history(row, ratio) for row in FORMULATIONS) for ratio in RATIOS)
    rates = np.array([_rate(stiffness) for stiffness in STIFFNESS])
    return Convergence(histories, rates[:, 0], rates[:, 1])


def _solve(formulation: PaperFormulation, ratio: float, stiffness: float) -> Trace:
    """Solve case C with free sides, from the slave just touching, at ε̂ = stiffness × E."""
    scene = catalogue.make_scene(
        "c", young=YOUNG, ratio=ratio, pressure=PRESSURE, penalty=stiffness * YOUNG, lowered=0.0, sides="free"
    )
    return newton.solve(scene, subject_of(formulation).for_case(scene.case()), iterations=80)


def _late_rate(residuals: FloatArray, floor: float) -> float:
    """Return the mean ratio of the residuals in the last five steps well above roundoff; NaN if there are fewer."""
    above = residuals[residuals > 1e2 * floor]
    return float((above[-1] / above[-6]) ** (1 / 5)) if len(above) > 6 else np.nan


def _history(formulation: PaperFormulation, ratio: float) -> _History:
    trace = _solve(formulation, ratio, 1.0)
    system = System(trace.scene, subject_of(formulation).for_case(trace.scene.case()))
    q, beyond = trace.solution, []
    for _ in range(_STEPS_BEYOND):
        pairing = system.pair(q)
        matrix, floor = system.matrix(q, pairing)
        step = system.step(matrix, -system.residual(q, pairing), floor)
        assert step.change is not None, "the matrix has an inverse at the solution"
        q = q + step.change
        beyond.append(float(np.abs(system.residual(q, system.pair(q))).max()))
    energies = trace.energies[np.isfinite(trace.energies)]
    return _History(formulation, trace.residuals, energies, np.array(beyond), float(trace.floors[-1]), trace.end.label)


def _rate(stiffness: float) -> tuple[float, float]:
    """Return (spectral radius, observed rate) of the basic version."""
    trace = _solve(paper.BASIC, 1.0, stiffness)
    q, case = trace.solution, trace.scene.case()
    systems = [System(trace.scene, subject_of(row).for_case(case)) for row in (paper.BASIC, paper.VTS_PPT)]
    basic, consistent = (dense(system.matrix(q, system.pair(q))[0]) for system in systems)
    iteration = np.eye(len(q)) - np.linalg.solve(basic, consistent)
    radius = float(np.abs(np.linalg.eigvals(iteration)).max())
    return radius, _late_rate(trace.residuals, float(trace.floors[-1]))


def _convergence_statements(convergence: Convergence) -> Iterator[Statement]:
    counts, materials = convergence.counts(paper.BASIC), f"with {MATERIALS[0]} and with the {MATERIALS[1]}"
    by_rule = "; ".join(f"{rule}: {', '.join(map(str, row))}" for rule, row in zip(RULES, counts.tolist(), strict=True))
    # The bounds of the residual between which a stopping rule gives the printed number of iterations.
    residuals = [row[FORMULATIONS.index(paper.BASIC)].all_residuals for row in convergence.histories]
    bounds = [(float(each[PRINTED_ITERATIONS]), float(each[:PRINTED_ITERATIONS].min())) for each in residuals]
    possible = all(low < high for low, high in bounds)
    words_ = " or ".join(
        f"from {number(low, 2)} to {number(high, 2)} ({material})"
        for (low, high), material in zip(bounds, MATERIALS, strict=True)
    )
    yield Statement(
        "Fig. 30",
        f"case C: the axis runs from 10⁶ to 10⁻¹², 18 decades, and the basic version needs {PRINTED_ITERATIONS} "
        "iterations; no stopping rule is given for this figure (for Example 2 it is an energy norm of 1e−15)",
        f"iterations {materials}: {by_rule}",
        Agreement.CONDITIONAL if possible else Agreement.DIFFERS,
        "fig30",
        f"Newton’s method stops when the largest residual is below a bound {words_}" if possible else "",
    )
    quick = {row.legend: convergence.counts(row)[0].tolist() for row in (paper.VTS_ME, paper.VTS_PPT)}
    slow = counts[0]
    quick_words = "; ".join(f"{legend} {', '.join(map(str, row))}" for legend, row in quick.items())
    yield Statement(
        "Fig. 30",
        "case C: VTS-ME and the consistent version of VTS-PPT need a few iterations, far fewer than the basic version",
        f"to the residual's own roundoff, {materials}: {quick_words}; VTS-PPT "
        f"basic {', '.join(map(str, slow.tolist()))}",
        Agreement.decide(max(map(max, quick.values())) <= 5 < 2 * 5 < slow.min()),
        "fig30",
    )
    basic, radius = convergence.histories[0][FORMULATIONS.index(paper.BASIC)], convergence.radius
    apart = float(np.nanmax(np.abs(convergence.rate / radius - 1)))
    yield Statement(
        "Section 6.1",
        "with the tangent of VTS-ME convergence is no longer quadratic; no rate is given",
        f"it is linear: each step leaves {basic.rate:.3f} of the residual at ε̂ = E, and {radius.min():.2f} to "
        f"{radius.max():.2f} for ε̂/E from {min(STIFFNESS):g} to {max(STIFFNESS):g}. That is, within {apart:.0%}, the "
        "spectral radius of I − K_basic⁻¹ K_consistent",
        Agreement.SILENT,
        "fig30",
    )


def _convergence_tables(convergence: Convergence) -> Iterator[PageTable]:
    heads = [f"{row.legend}, {material}" for row in FORMULATIONS for material in MATERIALS]
    counts = convergence.iterations.swapaxes(1, 2).reshape(len(RULES), -1).tolist()
    yield PageTable.of_numbers(
        "Fig. 30: linear systems solved, by stopping rule",
        ("Newton’s method stops when", *heads),
        [
            (rule, *(str(count) if count >= 0 else "never" for count in row))
            for rule, row in zip(RULES, counts, strict=True)
        ],
    )


@PaperFigure.define(
    "fig30",
    "Case C: (a, b) residual against iterations on the paper’s axes, continued below 10⁻¹², where they end. Newton’s "
    "method stops here in the grey band, which is the residual’s own roundoff. (c) ours: the linear rate of the basic "
    "version over the penalty, and the spectral radius of I − K_basic⁻¹ K_consistent.",
)
def _plot_convergence(convergence: Convergence) -> Figure:
    figure, panels = new_panels(4.0, 3)
    for axes, histories, material in zip(panels, convergence.histories, ("equal E", "master E/2"), strict=False):
        for history in histories:
            style = line_style(history.formulation, 1)
            axes.plot(np.arange(len(history.residuals)), history.residuals, **style)
        use_decades(axes, 8)
        axes.set_ylim(_LOWEST, AXIS[1])
        axes.axhspan(_LOWEST, histories[0].floor, color="0.92", zorder=0, linewidth=0)
        axes.axhline(AXIS[0], color="0.35", linewidth=0.8, linestyle=":", zorder=1)
        for height, words_ in ((2e-11, "roundoff"), (1e-13, "printed axis ends")):
            axes.text(5.0, height, words_, va="center", color="0.35", fontsize=9)
        axes.set_xlim(0, PRINTED_ITERATIONS)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
        axes.set(xlabel="iteration", title=material)
    panels[0].set_ylabel("largest residual (force)")
    rates = panels[2]
    rates.plot(STIFFNESS, convergence.radius, **REFERENCE_LINE)
    rates.plot(STIFFNESS, convergence.rate, **line_style(paper.BASIC, 1) | {"linestyle": "none"})
    rates.set_xscale("log")
    rates.xaxis.set_minor_locator(NullLocator())
    rates.set_ylim(0, None)
    rates.set(xlabel="ε̂ / E (1 / length)", ylabel="rate, basic version (–)")
    add_legend(figure, FORMULATIONS, reference="spectral radius", columns=4)
    return figure


def _convergence_datasets(convergence: Convergence) -> dict[str, Group]:
    variables = variables_of(convergence) | variables_of(convergence.histories, "ratio formulation")
    return {"": Group(variables, {"figure": "Fig. 30", "scene": "c"})}


FIG_30 = Item(
    name="fig30_convergence",
    title="Fig. 30: Newton’s method with both tangents",
    compute=_compute_convergence,
    statements=_convergence_statements,
    datasets=_convergence_datasets,
    figures=(_plot_convergence,),
    tables=_convergence_tables,
    choices={
        "Fig. 30": "ε̂ = E, p = E/100, free sides, the slave begins where it touches; both blocks alike, or the master "
        "half as stiff",
        "Convergence": "the largest entry of the residual falls to its own roundoff; the paper names an energy norm of "
        "1e−15 in Example 2 and no rule for Fig. 30",
    },
)


# Section 6.2.
TANGENT_FORMULATIONS = (paper.VTS_ME, paper.BASIC, paper.VTS_PPT, paper.STS)
SCENE = "example-1bis"
OPTIONS = {"ratio": 0.5, "pressure": 100.0, "penalty": 1e4, "lowered": 0.0, "sides": "free"}  # Here ε̂ = E.
DIRECTIONS = 8
ROUNDOFF = 1e-12  # The error of a complex step: a few hundred roundoffs of sums of a few dozen terms.
_TINY = 2.0**-100  # The length of a complex step; lengths are about 1, so it rounds nothing away.


@dataclass(frozen=True, slots=True, eq=False)
class _Tangents:
    # The largest difference over the largest entry of K d, over random d.
    error: Annotated[FloatArray, Column("formulation", "1", "difference of K d from a complex step, over K d")]
    asymmetry: Annotated[FloatArray, Column("formulation", "1", "largest entry of K − Kᵀ over that of K")]
    # Towards the solution; infinite if the step is exact.
    order: Annotated[FloatArray, Column("formulation", "1", "order of one Newton step", "NaN: not decided", np.nan)]
    # From the slave just touching to roundoff.
    iterations: Annotated[IntArray, Column("formulation", "1", "linear systems solved")]
    formulations: Formulations = TANGENT_FORMULATIONS


@cache
def _tangents() -> _Tangents:
    rows = np.array([_tangent_row(formulation) for formulation in TANGENT_FORMULATIONS])
    return _Tangents(rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3].astype(np.int64))


def _tangent_row(formulation: PaperFormulation) -> tuple[float, float, float, int]:
    scene = catalogue.make_scene(SCENE, **OPTIONS)
    case = scene.case()
    plugin = subject_of(formulation).for_case(case)
    trace = newton.solve(scene, plugin)
    z = trace.z
    pairing = plugin.pair(scene.interface, z)
    matrix = dense(plugin.tangent(scene.interface, pairing, z))
    directions = np.random.default_rng(0).uniform(-1.0, 1.0, (DIRECTIONS, z.size))
    exact = plugin.residual(scene.interface, pairing, z + 1j * _TINY * directions).imag / _TINY
    products = directions @ matrix.T
    error = float((np.abs(products - exact).max(axis=1) / np.abs(exact).max(axis=1)).max())
    asymmetry = float(np.abs(matrix - matrix.T).max() / np.abs(matrix).max())
    measurement, order = measure("newton.order", case, formulation), np.nan
    if measurement is not None and not measurement.undecided:
        order = measurement.values.get("order of one Newton step", np.inf)
    return error, asymmetry, order, trace.n_iterations


def _tangent_statements(result: _Tangents) -> Iterator[Statement]:
    me, basic, ppt = (TANGENT_FORMULATIONS.index(row) for row in (paper.VTS_ME, paper.BASIC, paper.VTS_PPT))
    yield Statement(
        "Section 6.2",
        "with the consistent tangent VTS-PPT converges quadratically",
        f"one Newton step is of order {result.order[ppt]:.2f}, with the basic tangent of order "
        f"{result.order[basic]:.2f}; the tangent differs from a complex step by {number(result.error[ppt], 2)}",
        Agreement.decide(result.order[ppt] >= 1.9 and result.error[ppt] <= ROUNDOFF),
        "fig30",
    )
    yield Statement(
        "Section 6.2",
        "the consistent tangent is unsymmetric",
        f"largest entry of K − Kᵀ over that of K: {number(result.asymmetry[ppt], 2)}; that of VTS-ME is "
        f"unsymmetric too, by {number(result.asymmetry[me], 2)}, since areas are measured in the current "
        "configuration",
        Agreement.decide(result.asymmetry[ppt] > ROUNDOFF),
    )


SECTION_6_2 = Item(
    name="section_6_2",
    title="Section 6.2: the consistent tangent",
    compute=_tangents,
    statements=_tangent_statements,
    attributes={"scene": SCENE, "comment": "in the solution, free sides, a master half as stiff as the slave"},
)


# Section 6.3.
TERM_FORMULATIONS = (
    PaperFormulation("VTS-ME", "vts-me:n=1"),
    PaperFormulation("VTS-PPT basic", "vts-ppt-basic:n=1"),
    PaperFormulation("VTS-PPT", "vts-ppt:n=1"),
    PaperFormulation("segment-to-segment", "sts"),
)
TIMED = (paper.VTS_ME, paper.VTS_PPT, paper.STS)
PRINTED_TERMS = 392  # The paper's count for the exact tangent of segment-to-segment.
MASTERS: Mapping[str, tuple[tuple[float, float], ...]] = {  # {head of a column: nodes of the master}
    "1 segment": ((2.3, 0.02), (-0.4, -0.03)),
    "2 segments": ((2.3, 0.02), (0.9, 0.03), (-0.4, -0.03)),
    "3 segments": ((2.3, 0.02), (1.3, 0.03), (0.6, 0.01), (-0.4, -0.03)),
}
SLAVE = ((0.0, -0.11), (1.9, -0.17))
MESH_RATIOS: Mapping[str, float] = {"coarser": 0.5, "as fine": 1.0, "finer": 2.0}  # Master segments a slave segment.
PENALTY = 16.0
_N_SEGMENTS = 64  # Slave segments of the interface on which cost is counted.
_VANISHES = 1e-12  # A coefficient below this share of the largest one is zero.


@dataclass(frozen=True, slots=True, eq=False)
class _Terms:
    terms: Annotated[
        IntArray,
        Column(
            "formulation master", "1", "coefficients of dyads in the tangent of one slave segment, over 1, 2 and 3 "
            "master segments",
        ),
    ]  # fmt: skip
    formulations: Formulations = TERM_FORMULATIONS


@dataclass(frozen=True, slots=True, eq=False)
class _Cost:
    """The cost of each formulation, and measured times, on which no two runs agree."""

    entries: Annotated[FloatArray, Column("formulation ratio", "1", "entries of the tangent a slave segment")]
    residual: Annotated[FloatArray, Column("formulation ratio", "s", "time a slave segment")]
    tangent: Annotated[FloatArray, Column("formulation ratio", "s", "time a slave segment")]
    formulations: Formulations = TIMED
    ratio: Annotated[tuple[float, ...], Column("ratio", "1", "master segments for each slave segment")] = tuple(
        MESH_RATIOS.values()
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Section63:
    terms: _Terms
    cost: _Cost
    tangents: _Tangents


def _compute_cost() -> _Section63:
    terms = [[count_terms(formulation, master) for master in MASTERS.values()] for formulation in TERM_FORMULATIONS]
    cases = [make_state(_N_SEGMENTS, ratio, 0.4) for ratio in MESH_RATIOS.values()]
    entries = [
        [_nonzeros(_tangent(row, case.interface, case.z, case.penalty)) / _N_SEGMENTS for case in cases]
        for row in TIMED
    ]
    costs = measure_costs([subject_of(formulation) for formulation in TIMED], cases)  # One case after the other.
    residual, tangent = (
        np.reshape([row.seconds[part] for row in costs], (len(cases), len(TIMED))).T / _N_SEGMENTS
        for part in ("residual", "tangent")
    )
    return _Section63(_Terms(np.array(terms)), _Cost(np.array(entries), residual, tangent), _tangents())


def count_terms(formulation: PaperFormulation, master: tuple[tuple[float, float], ...]) -> int:
    """Return the number of coefficients of dyads that do not vanish, in the frame of the middle master segment.

    Segment-to-segment works in the frame of the slave segment.
    """
    x, first = np.vstack([SLAVE, master]), 0
    if formulation.name != "sts":
        middle = x[:2].mean(axis=0)
        first = next(i for i in range(2, len(x) - 1) if x[i + 1, 0] <= middle[0] <= x[i, 0])
    chord = x[first + 1] - x[first]
    t = chord / np.hypot(*chord)
    frame = np.array([t, [t[1], -t[0]]])
    interface = Interface.from_chains(x[:2] * [1.0, 0.0], x[2:] * [1.0, 0.0])
    tangent = _tangent(formulation, interface, x.reshape(-1), PENALTY).reshape(len(x), 2, len(x), 2)
    return _nonzeros(np.einsum("ai,minj,bj->manb", frame, tangent, frame))


def _tangent(formulation: PaperFormulation, interface: Interface, z: FloatArray, penalty: float) -> FloatArray:
    plugin = subject_of(formulation).with_penalty(penalty)
    return dense(plugin.tangent(interface, plugin.pair(interface, z), z))


def _nonzeros(coefficients: FloatArray) -> int:
    return int((np.abs(coefficients) > _VANISHES * np.abs(coefficients).max()).sum())


def _cost_statements(section: _Section63) -> Iterator[Statement]:
    terms, cost, result = section.terms.terms, section.cost, section.tangents
    row = TANGENT_FORMULATIONS.index(paper.STS)
    yield Statement(
        "Section 6.3",
        f"an exact tangent of a segment-to-segment formulation is practically unfeasible, with up to {PRINTED_TERMS} "
        "vector product terms",
        f"the plugin sts has one, of at most {terms[-1].max()} terms for a slave segment when equal dyads are "
        f"collected: it differs from a complex step by {number(result.error[row], 2)}, a step of Newton’s method is of "
        f"order {result.order[row]:.2f}, and {result.iterations[row]} iterations solve Example 1bis. Each number of a "
        "point carries its derivatives along, so that no term is written by hand",
        Agreement.decide(not result.error[row] <= ROUNDOFF),
    )
    standard, _, consistent, _ = terms
    holds = consistent == standard
    heads = [head for head, same in zip(MASTERS, holds, strict=True) if same]
    counts = "; ".join(f"{head}: {b} (standard: {a})" for head, a, b in zip(MASTERS, standard, consistent, strict=True))
    yield Statement(
        "Section 6.3",
        "the consistent tangent of VTS-PPT needs as many terms as the standard formulation",
        f"terms for a virtual slave node whose area lies over {counts}",
        Agreement.decide(bool(holds.any()), always=bool(holds.all())),
        condition=f"the area of competence lies over {', '.join(heads)}",
    )
    ratios = cost.entries[TIMED.index(paper.VTS_PPT)] / cost.entries[TIMED.index(paper.VTS_ME)]
    ratio_words = ", ".join(f"{ratio:.2f} ({head})" for head, ratio in zip(MESH_RATIOS, ratios, strict=True))
    yield Statement(
        "Section 6.3",
        "the cost stays reasonable, above all where the master is as fine as the slave or coarser",
        f"entries of the tangent of VTS-PPT over those of VTS-ME, by how fine the master is: {ratio_words}; the page "
        "has measured times",
        Agreement.decide(bool(ratios[0] <= ratios[1] <= ratios[2] and ratios[1] <= 2)),
    )


def _cost_tables(section: _Section63) -> Iterator[PageTable]:
    cost = section.cost
    yield PageTable.of_numbers(
        "Terms of the tangent: coefficients of dyads of t and n for one slave segment with one virtual slave node "
        "(segment-to-segment: all of it), by master segments under it",
        ("Formulation", *MASTERS),
        [(row.legend, *map(str, n)) for row, n in zip(TERM_FORMULATIONS, section.terms.terms.tolist(), strict=True)],
    )
    cells = [
        Cell((f"{entries:.1f}",), (f"{1e6 * residual:.2f} µs, {1e6 * tangent:.2f} µs",), "n")
        for entries, residual, tangent in zip(cost.entries.flat, cost.residual.flat, cost.tangent.flat, strict=True)
    ]
    width = len(MESH_RATIOS)
    yield PageTable.of_cells(
        f"Cost for each of {_N_SEGMENTS} slave segments: entries of the tangent; below, measured times of a "
        "residual and of a tangent on this machine",
        ("Formulation", *(f"master {head}" for head in MESH_RATIOS)),
        [(row.legend, cells[width * number_ :][:width]) for number_, row in enumerate(TIMED)],
    )


def _cost_datasets(section: _Section63) -> dict[str, Group]:
    cost = variables_of(section.cost)
    return {
        "terms": Group(variables_of(section.terms)),
        "cost": Group({name: cost[name] for name in cost if name not in ("residual", "tangent")}),
        "timing": Group({name: cost[name] for name in cost if name != "entries"}),
    }


SECTION_6_3 = Item(
    name="section_6_3",
    title="Section 6.3: terms and cost",
    compute=_compute_cost,
    statements=_cost_statements,
    datasets=_cost_datasets,
    tables=_cost_tables,
)
