"""The patch tests of the paper: pressures, deformed meshes, and who passes.

The figures are drawn at ε̂ = E (per unit of length), the pass/fail table at the moderate penalty 10 E/h. The paper
prints neither; ε̂ = E puts the pressures of case A1 on the axis that it prints (0.90 to 1.10), and Fig. 30 on its
number of iterations.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5 and 7.1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from contactverif import catalogue, newton, pictures
from contactverif.blocks import pressure_of
from contactverif.scene import Scene
from contactverif.studies.paper import cast
from contactverif_reports.paper_data import Curve, Member, PassTable, Patch
from contactverif_reports.solved import Solution, Solved

STIFFNESS = 1.0  # ε̂ over E, per unit of length, of the figures
YOUNG = 1e4  # the catalogue's
FAILS = 1e-2  # of the pressure: a stress error above it is a failure


@dataclass(frozen=True, slots=True)
class Shown:
    """A scene and the paper's figures of it; `printed` and `close_up` are the ends of its pressure axes."""

    title: str
    pressures: str
    meshes: str
    printed: tuple[float, float]
    members: tuple[Member, ...]
    origin: float = 0.0
    close_up: tuple[float, float] | None = None


_FOUR = (cast.NTS, cast.NTS_AR, cast.TWO_PASS, cast.VTS_ME)
_FIVE = (*_FOUR, cast.VTS_PPT)
SHOWN: Mapping[str, Shown] = {
    "a1": Shown("Case A1", "10", "9", (0.9, 1.1), (cast.NTS, cast.NTS_AR), 2.0),
    "a2-uniform": Shown("Case A2, uniform mesh", "12(a)", "11(a, b)", (0.8, 1.8), (cast.NTS, cast.NTS_AR), 4.0),
    "a2-graded": Shown("Case A2, graded mesh", "12(b)", "11(c, d)", (0.8, 1.8), (cast.NTS, cast.NTS_AR), 4.0),
    "b": Shown("Case B", "18", "17", (0.8, 1.6), _FOUR),
    "c": Shown("Case C", "22", "21", (0.7, 1.7), _FIVE),
    "example-1": Shown("Example 1", "33", "32", (0.6, 2.2), _FOUR, close_up=(0.8, 1.2)),
    "example-1bis": Shown("Example 1bis", "36", "35", (0.6, 1.4), _FIVE, close_up=(0.8, 1.2)),
}
SCENES = ("a1", "a2-uniform", "a2-graded", "b", "example-1", "c", "c-prime", "example-1bis")
_PASSES, _FAILS, _SILENT = 1, 0, -1
SAID: Mapping[str, Mapping[str, int]] = {  # what the paper says, by scene; what is not here it does not say
    "nts": dict.fromkeys(SHOWN, _FAILS),
    "nts-ar": dict.fromkeys(("a1", "a2-uniform", "a2-graded"), _PASSES)
    | dict.fromkeys(("b", "c", "example-1", "example-1bis"), _FAILS),
    "two-pass/nts-ar": dict.fromkeys(("b", "c", "example-1", "example-1bis"), _FAILS),
    "vts-me": dict.fromkeys(("b", "example-1"), _PASSES) | dict.fromkeys(("c", "example-1bis"), _FAILS),
    "vts-ppt": dict.fromkeys(("c", "example-1bis"), _PASSES),
}


def patches(told: Callable[[str], None]) -> tuple[Patch, ...]:
    """Every scene of the figures, solved."""
    found = []
    for name, shown in SHOWN.items():
        told(shown.title)
        found.append(_patch(name, shown))
    return tuple(found)


def passes(told: Callable[[str], None]) -> PassTable:
    """Every formulation on every scene, at the moderate penalty."""
    members = cast.installed(cast.PASSES)
    errors = np.full((len(members), len(SCENES)), np.nan)
    for row, member in enumerate(members):
        told(f"patch tests of {member.formulation}")
        for column, name in enumerate(SCENES):
            scene = catalogue.made(name)
            trace = newton.solve(scene, cast.subject(member).on(scene.case()))
            if trace.converged:
                errors[row, column] = stress_error(scene, trace.solution)
    said = [[SAID.get(member.formulation, {}).get(name, _SILENT) for name in SCENES] for member in members]
    return PassTable(
        members, SCENES, errors, np.array([roundoff(catalogue.made(name)) for name in SCENES]), FAILS, np.array(said)
    )


def roundoff(scene: Scene) -> float:
    """Of a stress over the pressure: 1e-11 + 1e-13 ε̂h/E + 5e-15 over the smallest ratio of segments."""
    interface = scene.interface
    lengths = np.concatenate([side.lengths(interface.nodes) for side in (interface.slave, interface.master)])
    return 1e-11 + 1e-13 * catalogue.MODERATE + 5e-15 * float(lengths.max() / lengths.min())


def stress_error(scene: Scene, q: np.ndarray) -> float:
    """Largest error of a stress at a Gauss point of a uniform scene without lateral strain, over the pressure."""
    p, worst = pressure_of(scene.case(), scene.penalty), 0.0
    for body, stresses in zip(scene.bodies, scene.stresses(q), strict=True):
        if not body.rigid:
            exact = [-p * body.poisson / (1 - body.poisson), -p, 0.0]
            worst = max(worst, float(np.abs(stresses - exact).max()) / p)
    return worst


def _patch(name: str, shown: Shown) -> Patch:
    scene = catalogue.made(name, penalty=STIFFNESS * YOUNG)
    case = scene.case()
    members = cast.installed(shown.members)
    solved = pictures.solved(case, [cast.subject(member) for member in members])
    curves = tuple(
        _curve(member, solved, solution, shown.origin)
        for member, solution in zip(members, solved.solutions, strict=True)
    )
    return Patch(
        name,
        shown.title,
        shown.pressures,
        shown.meshes,
        shown.printed,
        shown.close_up,
        solved.pressure,
        solved,
        curves,
    )


def _curve(member: Member, solved: Solved, solution: Solution, origin: float) -> Curve:
    """At the virtual slave nodes where there are any, else nodal forces over the nodes' shares (Eq. 3)."""
    at_points = solution.points is not None and member in cast.VIRTUAL
    if solution.points is not None and at_points:
        x, _ = solved.points_along(solution.points)
        pressure = solution.points.pressure
    else:
        nodes = solved.case.interface.n_slave_nodes
        x, pressure = solved.along[:nodes], solved.node_pressures(solution)[:nodes]
        at = np.isfinite(pressure)
        x, pressure = x[at], pressure[at]
    order = np.argsort(x, kind="stable")
    return Curve(
        member, x[order] - origin, pressure[order] / solved.pressure, at_points, solution, solution.stress_error
    )
