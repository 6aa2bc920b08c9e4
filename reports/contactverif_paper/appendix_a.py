"""Appendix A: the formulas A1–A28 of the consistent tangent, one line each, each checked.

One slave segment lies over three master segments of a bent chain. Its virtual slave node V at c = −1/2 penetrates.
Its area of competence AM covers parts of the first and of the last segment and all of the one between. The other
virtual slave node is open. Each formula is written below as the paper prints it, and compared with

- the integral of the shape functions, for a force (Gauss' rule with two points is exact);
- a complex step of the number that it linearizes, for a linearization;
- δxᵀ R or δxᵀ K Δx of the plugin `vts-ppt`, for a part of the virtual work: the four parts together.

Source: Zavarise & De Lorenzis (2009), Appendix A, Figs. 27–29, Box 3.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from contactverif.contract.arrays import FloatArray, dense
from contactverif.contract.interface import Interface
from contactverif_paper.paper_formulations import VTS_PPT, subject_of
from contactverif_paper.paper_item import WORDS, Agreement, Cell, Column, Item, PageTable, Statement
from contactverif_reports.html.pages import number

PENALTY = 16.0
C = -0.5  # The coordinate of V on the slave segment.
SLAVE = np.array([[0.0, -0.10], [2.0, 0.10]])  # Nodes A and B.
MASTER = np.array([[2.5, -0.02], [0.8, 0.01], [0.4, -0.005], [-0.5, 0.03]])  # V faces the segment 0.8 to 0.4.
DIRECTIONS = 8
TOLERANCE = 1e-13  # A few hundred roundoffs: sums of a few dozen terms.
_TINY = 2.0**-100  # The length of a complex step.
_GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
A, B, NODE_F, NODE_1, NODE_2, NODE_L = range(6)  # Nodes: the slave's, then the master's in their order.

Vector = Any  # An array (2,), real or complex.


class Geometry:
    """All numbers of the appendix at positions x (6, 2), real or complex, under the paper's names."""

    def __init__(self, x: np.ndarray) -> None:
        self.x = x
        self.x_m = (x[A] + x[B]) / 2
        self.l_12 = np.sqrt((x[NODE_2] - x[NODE_1]) @ (x[NODE_2] - x[NODE_1]))
        self.t = (x[NODE_2] - x[NODE_1]) / self.l_12
        self.n = np.array([self.t[1], -self.t[0]])
        x_v = (1 - C) / 2 * x[A] + (1 + C) / 2 * x[B]
        self.g = (x_v - x[NODE_1]) @ self.n
        self.xi = (x_v - x[NODE_1]) @ self.t / self.l_12
        self.l_ab = np.sqrt((x[B] - x[A]) @ (x[B] - x[A]))
        self.l_first = (x[NODE_1] - x[NODE_F]) @ self.t
        self.l_between = (x[NODE_2] - x[NODE_1]) @ self.t
        self.l_last = (x[NODE_L] - x[NODE_2]) @ self.t
        self.xi_m = (self.x_m - x[NODE_F]) @ self.t / self.l_first
        self.xi_a = (x[A] - x[NODE_2]) @ self.t / self.l_last
        self.v_m = ((1 - self.xi_m) * x[NODE_F] + self.xi_m * x[NODE_1] - self.x_m) @ self.n / self.l_12
        self.v_a = ((1 - self.xi_a) * x[NODE_2] + self.xi_a * x[NODE_L] - x[A]) @ self.n / self.l_12
        self.v_first = -(x[NODE_1] - x[NODE_F]) @ self.n / self.l_12
        self.v_last = -(x[NODE_L] - x[NODE_2]) @ self.n / self.l_12
        self.first_f = (1 - self.xi_m) ** 2 / 2 * self.unit(self.l_first)  # A3
        self.first_n = (1 - self.xi_m**2) / 2 * self.unit(self.l_first)  # A4
        self.between = self.unit(self.l_between) / 2  # A14
        self.last_f = self.xi_a * (1 - self.xi_a / 2) * self.unit(self.l_last)  # A18
        self.last_n = self.xi_a**2 / 2 * self.unit(self.l_last)  # A19
        self.f_v = -self.unit(self.l_ab) / 2  # A26

    def unit(self, length: Any) -> Vector:
        """Return ε̂ g times a length, along the normal."""
        return PENALTY * self.g * length * self.n


class Increment:
    """The linearizations of the appendix at x along d (6, 2), as the paper prints them."""

    def __init__(self, geometry: Geometry, d: np.ndarray) -> None:
        at, self.geometry = geometry, geometry
        rotation = at.n @ (d[NODE_1] - d[NODE_2])
        self.xi_m = at.t @ (d[A] + d[B]) / 2 + at.v_m * rotation
        self.xi_m = (self.xi_m - (1 - at.xi_m) * at.t @ d[NODE_F] - at.xi_m * at.t @ d[NODE_1]) / at.l_first  # A7a, A7b
        x_v = (1 - C) / 2 * d[A] + (1 + C) / 2 * d[B]
        self.g = at.n @ (x_v - (1 - at.xi) * d[NODE_1] - at.xi * d[NODE_2])  # A8
        self.l_first = at.v_first * rotation - at.t @ (d[NODE_F] - d[NODE_1])  # A9 with A11
        self.l_between = -at.t @ (d[NODE_1] - d[NODE_2])
        self.l_last = at.v_last * rotation - at.t @ (d[NODE_2] - d[NODE_L])
        self.n = at.t * rotation / at.l_12  # A10
        self.xi_a = at.t @ d[A] + at.v_a * rotation
        self.xi_a = (self.xi_a - (1 - at.xi_a) * at.t @ d[NODE_2] - at.xi_a * at.t @ d[NODE_L]) / at.l_last  # A22, A23
        self.l_ab = 4 / at.l_ab * (at.x_m - at.x[A]) @ (d[B] - d[A]) / 2  # A28
        self.first_f = -(1 - at.xi_m) * self.xi_m * at.unit(at.l_first)  # A5
        self.first_f = self.first_f + (1 - at.xi_m) ** 2 / 2 * self.unit(at.l_first, self.l_first)
        self.first_n = -at.xi_m * self.xi_m * at.unit(at.l_first)  # A6
        self.first_n = self.first_n + (1 - at.xi_m**2) / 2 * self.unit(at.l_first, self.l_first)
        self.between = self.unit(at.l_between, self.l_between) / 2  # A15
        self.last_f = (1 - at.xi_a) * self.xi_a * at.unit(at.l_last)  # A20
        self.last_f = self.last_f + at.xi_a * (1 - at.xi_a / 2) * self.unit(at.l_last, self.l_last)
        self.last_n = at.xi_a * self.xi_a * at.unit(at.l_last)  # A21
        self.last_n = self.last_n + at.xi_a**2 / 2 * self.unit(at.l_last, self.l_last)
        self.f_v = -self.unit(at.l_ab, self.l_ab) / 2  # A27

    def unit(self, length: Any, increment: Any) -> Vector:
        """Return Δ(ε̂ g l n) = ε̂ (Δg l n + g Δl n + g l Δn)."""
        at = self.geometry
        return PENALTY * (self.g * length * at.n + at.g * increment * at.n + at.g * length * self.n)


def virtual_work(at: Geometry | Increment, d: np.ndarray) -> Any:
    """Return the virtual work of a variation d (6, 2), A1 + A12 + A16 + A24, or its increment, A2 + A13 + A17 + A25."""
    first = -d[NODE_F] @ at.first_f - d[NODE_1] @ at.first_n
    between = -(d[NODE_1] + d[NODE_2]) @ at.between
    last = -d[NODE_2] @ at.last_f - d[NODE_L] @ at.last_n
    return first + between + last - ((1 - C) / 2 * d[A] + (1 + C) / 2 * d[B]) @ at.f_v


INTEGRAL, STEP, RESIDUAL, TANGENT = (
    "integral of the shape function",
    "complex step",
    "δxᵀ R of vts-ppt, with the other parts",
    "δxᵀ K Δx of vts-ppt, with the other parts",
)
FORMULAS: tuple[tuple[str, str, str, str], ...] = (  # number, formula, check, attribute that it computes
    ("A1", "δΠ = −δx_f·F_f − δx_n·F_n on the first segment", RESIDUAL, ""),
    ("A2", "ΔδΠ = −δx_f·ΔF_f − δx_n·ΔF_n on the first segment", TANGENT, ""),
    ("A3", "F_f = (1 − ξ_M)²/2 · ε̂ g l_fn n", INTEGRAL, "first_f"),
    ("A4", "F_n = (1 − ξ_M²)/2 · ε̂ g l_fn n", INTEGRAL, "first_n"),
    ("A5", "ΔF_f = −(1 − ξ_M) Δξ_M ε̂ g l_fn n + (1 − ξ_M)²/2 · Δ(ε̂ g l_fn n)", STEP, "first_f"),
    ("A6", "ΔF_n = −ξ_M Δξ_M ε̂ g l_fn n + (1 − ξ_M²)/2 · Δ(ε̂ g l_fn n)", STEP, "first_n"),
    (
        "A7a, A7b",
        "l_fn Δξ_M = ½ t·(Δx_A + Δx_B) + V_M n·(Δx_1 − Δx_2) − (1 − ξ_M) t·Δx_f − ξ_M t·Δx_n, "
        "V_M = [(1 − ξ_M) x_f + ξ_M x_n − x_M]·n / l_12",
        STEP,
        "xi_m",
    ),
    ("A8", "Δg = n·[(1 − c)/2 Δx_A + (1 + c)/2 Δx_B − (1 − ξ) Δx_1 − ξ Δx_2]", STEP, "g"),
    ("A9", "Δl_fn = V_fn n·(Δx_1 − Δx_2) − t·(Δx_f − Δx_n)", STEP, "l_first"),
    ("A10", "Δn = t n·(Δx_1 − Δx_2) / l_12", STEP, "n"),
    ("A11", "V_fn = −(x_n − x_f)·n / l_12", STEP, "l_last"),
    ("A12", "δΠ = −δx_f·F_f − δx_n·F_n on a segment between", RESIDUAL, ""),
    ("A13", "ΔδΠ = −δx_f·ΔF_f − δx_n·ΔF_n on a segment between", TANGENT, ""),
    ("A14", "F_f = F_n = ½ ε̂ g l_fn n", INTEGRAL, "between"),
    ("A15", "ΔF_f = ΔF_n = ½ Δ(ε̂ g l_fn n)", STEP, "between"),
    ("A16", "δΠ = −δx_f·F_f − δx_n·F_n on the last segment", RESIDUAL, ""),
    ("A17", "ΔδΠ = −δx_f·ΔF_f − δx_n·ΔF_n on the last segment", TANGENT, ""),
    ("A18", "F_f = ξ_A (1 − ξ_A/2) ε̂ g l_fn n", INTEGRAL, "last_f"),
    ("A19", "F_n = ξ_A²/2 · ε̂ g l_fn n", INTEGRAL, "last_n"),
    ("A20", "ΔF_f = (1 − ξ_A) Δξ_A ε̂ g l_fn n + ξ_A (1 − ξ_A/2) Δ(ε̂ g l_fn n)", STEP, "last_f"),
    ("A21", "ΔF_n = ξ_A Δξ_A ε̂ g l_fn n + ξ_A²/2 · Δ(ε̂ g l_fn n)", STEP, "last_n"),
    ("A22", "l_fn Δξ_A = t·Δx_A + V_A n·(Δx_1 − Δx_2) − (1 − ξ_A) t·Δx_f − ξ_A t·Δx_n", STEP, "xi_a"),
    ("A23", "V_A = [(1 − ξ_A) x_f + ξ_A x_n − x_A]·n / l_12", STEP, "xi_a"),
    ("A24", "δΠ = −(1 − c)/2 δx_A·F_V − (1 + c)/2 δx_B·F_V", RESIDUAL, ""),
    ("A25", "ΔδΠ = −(1 − c)/2 δx_A·ΔF_V − (1 + c)/2 δx_B·ΔF_V", TANGENT, ""),
    ("A26", "F_V = −½ ε̂ g l_AB n", INTEGRAL, "f_v"),
    ("A27", "ΔF_V = −½ Δ(ε̂ g l_AB n)", STEP, "f_v"),
    ("A28", "Δl_AB = 4/l_AB · (x_M − x_A)·(−½ Δx_A + ½ Δx_B)", STEP, "l_ab"),
)


_NUMBERS, _TEXTS, _CHECKS, _ = zip(*FORMULAS, strict=True)


@dataclass(frozen=True, slots=True, eq=False)
class _Checks:
    """The largest relative difference of each formula from its check."""

    difference: Annotated[FloatArray, Column("formula", "1", "largest relative difference")]
    formula: Annotated[tuple[str, ...], Column("formula", WORDS, "number in the appendix")] = _NUMBERS
    text: Annotated[tuple[str, ...], Column("formula", WORDS, "the formula")] = _TEXTS
    check: Annotated[tuple[str, ...], Column("formula", WORDS, "what it is compared with")] = _CHECKS


def _compute() -> _Checks:
    return _Checks(errors(Increment))


def errors(increment: Callable[[Geometry, np.ndarray], Increment]) -> FloatArray:
    """Return the largest relative difference (n_formulas,), with the linearizations of that class."""
    directions = np.random.default_rng(0).uniform(-1.0, 1.0, (DIRECTIONS, 6, 2))
    work_errors = _work_errors(directions, increment)
    geometry = Geometry(np.vstack([SLAVE, MASTER]))
    integrals = _integrals(geometry)
    rows = []
    for _, _, check, name in FORMULAS:
        if check in work_errors:
            rows.append(work_errors[check])
        elif check == INTEGRAL:
            rows.append(_relative(getattr(geometry, name), integrals[name]))
        else:
            exact = [np.imag(getattr(Geometry(geometry.x + 1j * _TINY * d), name)) / _TINY for d in directions]
            ours = [getattr(increment(geometry, d), name) for d in directions]
            rows.append(max(map(_relative, ours, exact)))
    return np.array(rows)


def _integrals(geometry: Geometry) -> dict[str, Vector]:
    """Return the nodal forces of the pressure ε̂ g on the covered parts, by Gauss' rule."""

    def both(start: float, stop: float, length: float) -> tuple[Vector, Vector]:
        places = (start + stop) / 2 + (stop - start) / 2 * _GAUSS
        pressure = geometry.unit(length) * (stop - start) / 2
        return pressure * float((1 - places).sum()), pressure * float(places.sum())

    first_f, first_n = both(geometry.xi_m, 1.0, geometry.l_first)
    last_f, last_n = both(0.0, geometry.xi_a, geometry.l_last)
    between, _ = both(0.0, 1.0, geometry.l_between)
    f_v = -geometry.unit(geometry.l_ab) * float(_GAUSS.size) / 4  # Half of the slave segment.
    forces = {"first_f": first_f, "first_n": first_n, "between": between, "last_f": last_f, "last_n": last_n}
    return forces | {"f_v": f_v}


def _work_errors(directions: FloatArray, increment: Callable[[Geometry, np.ndarray], Increment]) -> dict[str, float]:
    """Compare the four parts of the virtual work together with the plugin's residual and tangent."""
    x = np.vstack([SLAVE, MASTER])
    interface = Interface.from_chains(np.array([[0.0, 0.0], [2.0, 0.0]]), MASTER * [1.0, 0.0])
    plugin, z = subject_of(VTS_PPT).with_penalty(PENALTY), x.reshape(-1)
    pairing = plugin.pair(interface, z)
    residual = plugin.residual(interface, pairing, z)
    tangent = dense(plugin.tangent(interface, pairing, z))
    geometry, worst = Geometry(x), {RESIDUAL: 0.0, TANGENT: 0.0}
    for variation, d in zip(directions, np.roll(directions, 1, axis=0), strict=True):
        work, change = virtual_work(geometry, variation), virtual_work(increment(geometry, d), variation)
        forces, matrix = np.abs(residual).sum(), np.abs(tangent).sum()
        flat, flat_d = variation.reshape(-1), d.reshape(-1)
        worst[RESIDUAL] = max(worst[RESIDUAL], abs(float(work - flat @ residual)) / forces)
        worst[TANGENT] = max(worst[TANGENT], abs(float(change - flat @ tangent @ flat_d)) / matrix)
    return worst


def _relative(value: Any, exact: Any) -> float:
    return float(np.abs(value - exact).max() / np.abs(exact).max())


def _statements(checks: _Checks) -> Iterator[Statement]:
    wrong = [checks.formula[row] for row in np.flatnonzero(~(checks.difference <= TOLERANCE))]
    text = f"each agrees with its check, within {number(float(checks.difference.max()), 2)}"
    yield Statement(
        "Appendix A",
        "A1–A28 are the consistent linearization of the residual of Box 3",
        f"wrong: {', '.join(wrong)}" if wrong else text,
        Agreement.decide(not wrong),
    )


def _tables(checks: _Checks) -> Iterator[PageTable]:
    marks = [f"{'✓' if error <= TOLERANCE else '✗'} {number(error, 2)}" for error in checks.difference.tolist()]
    rows = zip(checks.formula, checks.text, checks.check, marks, strict=True)
    yield PageTable.of_cells(
        "Appendix A, formula by formula",
        ("No.", "Formula", "Compared with", "Difference"),
        [
            (name, (Cell((text,)), Cell((check,), tone="soft"), Cell((mark,), tone="n")))
            for name, text, check, mark in rows
        ],
    )


ITEM = Item(
    name="appendix_a",
    title="Appendix A: the formulas of the consistent tangent",
    compute=_compute,
    statements=_statements,
    attributes={"formulation": VTS_PPT.name},
    tables=_tables,
    text="f and n are the first and the second node of a segment, 1 and 2 those of V’s own one, M is the middle of the "
    "slave segment AB; Δ(ε̂ g l n) stands for ε̂ Δg l n + ε̂ g Δl n + ε̂ g l Δn. A11 is checked by Δl of the last segment.",
)
