"""The patch tests of the paper: pressures, deformed meshes, and who passes.

The paper prints no penalty. Each figure has the one with which the curves fill the pressure axis that it prints (ε̂ = E
in case A1, softer ones in the others; per unit of length); the pass/fail table has the moderate penalty 10 E/h. How
large an error is, and which of two wrong methods is the better one, depends on the penalty; who passes does not.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5 and 7.1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from contactverif.mechanics import newton
from contactverif.scenes import catalogue
from contactverif.scenes.uniform_stress import condition_tolerance, stress_error
from contactverif.studies import solved_scenes as pictures
from contactverif_paper import cast
from contactverif_paper.paper_data import Curve, Member, PassTable, Patch, Said, Statement
from contactverif_reports.draw.solved_scene import Solution, SolvedScene
from contactverif_reports.html.pages import number

YOUNG = 1e4  # the catalogue's
UNEQUAL = 10.0  # times as stiff as the punch is another foundation
FAILS = 1e-2  # of the pressure: a stress error above it is a failure


@dataclass(frozen=True, slots=True)
class Shown:
    """A scene and the paper's figures of it; `printed` and `close_up` are the ends of its pressure axes.

    `stiffness` is ε̂ over E, per unit of length: ours, so that the curves fill the axis.
    """

    title: str
    pressures: str
    meshes: str
    printed: tuple[float, float]
    stiffness: float
    members: tuple[Member, ...]
    origin: float = 0.0
    close_up: tuple[float, float] | None = None


_TWO = (cast.NTS, cast.NTS_AR)
_FOUR = (cast.NTS, cast.NTS_AR, cast.TWO_PASS, cast.VTS_ME)
_FIVE = (*_FOUR, cast.VTS_PPT)
SHOWN: Mapping[str, Shown] = {
    "a1": Shown("Case A1", "10", "9", (0.9, 1.1), 1.0, _TWO, 2.0),
    "a2-uniform": Shown("Case A2, uniform mesh", "12(a)", "11(a, b)", (0.8, 1.8), 0.35, _TWO, 4.0),
    "a2-graded": Shown("Case A2, graded mesh", "12(b)", "11(c, d)", (0.8, 1.8), 0.35, _TWO, 4.0),
    "b": Shown("Case B", "18", "17", (0.8, 1.6), 0.06, _FOUR),
    "c": Shown("Case C", "22", "21", (0.7, 1.7), 0.06, _FIVE),
    "example-1": Shown("Example 1", "33", "32", (0.6, 2.2), 0.06, _FOUR, close_up=(0.8, 1.2)),
    "example-1bis": Shown("Example 1bis", "36", "35", (0.6, 1.4), 0.06, _FIVE, close_up=(0.8, 1.2)),
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
    "vts-ppt-basic": {"c": _PASSES},
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
    members = cast.PASSES
    errors = np.full((len(members), len(SCENES)), np.nan)
    for row, member in enumerate(members):
        told(f"patch tests of {member.formulation}")
        for column, name in enumerate(SCENES):
            scene = catalogue.make_scene(name)
            trace = newton.solve(scene, cast.subject(member).for_case(scene.case()))
            if trace.converged:
                errors[row, column] = stress_error(scene, scene.stresses(trace.solution))
    said = [[SAID.get(member.formulation, {}).get(name, _SILENT) for name in SCENES] for member in members]
    return PassTable(
        members=members,
        scenes=SCENES,
        errors=errors,
        tolerances=np.array([condition_tolerance(scene, scene.penalty) for scene in map(catalogue.make_scene, SCENES)]),
        fails=FAILS,
        said=np.array(said),
        unequal=_unequal(),
    )


def statements(patches: Sequence[Patch], table: PassTable) -> tuple[Statement, ...]:
    """What the paper says of all this, beside it."""
    by_scene = {patch.scene: {curve.member: curve.departure for curve in patch.curves} for patch in patches}
    return (
        *map(_of_range, patches),
        _of_passes(table),
        _of_two_passes(by_scene["b"], table),
        _of_areas(by_scene, table),
        Statement(
            "Section 7.1",
            "punch and foundation of different materials would have a constant pressure too",
            f"VTS-PPT finds it on Example 1bis, the foundation {UNEQUAL:g} times as stiff: error of the stress "
            f"{number(table.unequal[0], 2)}",
            Said.of(table.unequal[0] <= table.unequal[1]),
        ),
        Statement(
            "Sections 4, 5, 7.1",
            "no numbers are given for errors, materials, supports, heights or penalties of the patch tests",
            _between(table),
            Said.SILENT,
        ),
    )


def _of_range(patch: Patch) -> Statement:
    low, high = patch.printed
    ours = [float(value) for curve in patch.curves if curve.solution.converged for value in curve.pressure]
    inside = low <= min(ours) and max(ours) <= high
    says = f"{patch.title}: the axis runs from {low:.2f} to {high:.2f} of the exact pressure; no penalty is printed"
    found = f"curves from {min(ours):.3f} to {max(ours):.3f} at ε̂ = {patch.stiffness:g} × E, chosen to fill that axis"
    found += "" if inside else ", and not inside it"
    for curve in patch.curves:
        if not curve.solution.converged:
            found += f"; {curve.member.legend} ends in a {curve.solution.end} (states take turns), and one is drawn"
    drawing = f"fig{patch.pressures.partition('(')[0].zfill(2)}"
    return Statement(f"Fig. {patch.pressures}", says, found, Said.SILENT if inside else Said.DIFFERS, drawing)


def _of_passes(table: PassTable) -> Statement:
    spoken = table.said >= 0
    words = np.array([[table.word(row, column) for column in range(len(table.scenes))] for row in range(len(spoken))])
    right = np.where(table.said == 1, words == "pass", words == "fail") & spoken
    wrong = [
        f"{table.members[row].legend} on {table.scenes[column]}"
        for row, column in np.argwhere(spoken & ~right).tolist()
    ]
    found = f"{int(right.sum())} of {int(spoken.sum())} verdicts are the same"
    found += f"; others: {', '.join(wrong)}" if wrong else ""
    return Statement(
        "Figs. 9–12, 17, 18, 21, 22, 32, 33, 35, 36",
        "NTS fails everywhere; NTS-AR passes where each slave segment faces one master segment; VTS-ME passes where "
        "each area of competence does; VTS-PPT passes C and Example 1bis; two-pass NTS-AR fails",
        found,
        Said.of(not wrong),
    )


def _between(table: PassTable) -> str:
    words = [table.word(row, column) for row in range(len(table.members)) for column in range(len(table.scenes))]
    between = words.count("between")
    if between:
        return f"{between} of {len(words)} errors of the stress lie between roundoff and {table.fails:g} at ε̂ = 10 E/h"
    return f"errors of the stress are at roundoff or above {table.fails:g} at ε̂ = 10 E/h; nothing lies between"


def _of_two_passes(departures: Mapping[Member, float], table: PassTable) -> Statement:
    one, two = departures[cast.NTS_AR], departures[cast.TWO_PASS]
    stiff = table.of(cast.NTS_AR, "b") / table.of(cast.TWO_PASS, "b")
    return Statement(
        "Section 5.1.3",
        "case B: two passes with a penalty do not come nearer than one",
        f"pressures depart by up to {two:.2f} from the exact one, those of one pass by {one:.2f}, at the soft penalty "
        f"of Fig. 18; at ε̂ = 10 E/h the error of the stress is {stiff:.0f} times smaller with two, which lock",
        Said.of(two >= one),
        "fig18",
    )


def _of_areas(by_scene: Mapping[str, Mapping[Member, float]], table: PassTable) -> Statement:
    rows = {name: by_scene[name] for name in ("example-1", "example-1bis")}
    best = all(row[cast.NTS_AR] <= min(row[cast.NTS], row[cast.TWO_PASS]) for row in rows.values())
    numbers = " and ".join(
        f"{row[cast.NTS_AR]:.2f} (NTS {row[cast.NTS]:.2f}, two-pass {row[cast.TWO_PASS]:.2f})" for row in rows.values()
    )
    return Statement(
        "Section 7.1",
        "Examples 1 and 1bis: NTS-AR fails, but does well beside NTS and two-pass NTS-AR",
        f"pressures depart by up to {numbers} at the soft penalty of the figures; at ε̂ = 10 E/h two passes have the "
        f"smaller error of the stress, {number(table.of(cast.TWO_PASS, 'example-1'), 2)} to "
        f"{number(table.of(cast.NTS_AR, 'example-1'), 2)} in Example 1",
        Said.of(best),
        "fig33",
    )


def _unequal() -> tuple[float, float]:
    scene = catalogue.make_scene("example-1bis", ratio=UNEQUAL)
    trace = newton.solve(scene, cast.subject(cast.VTS_PPT).for_case(scene.case()))
    error = stress_error(scene, scene.stresses(trace.solution)) if trace.converged else np.nan
    return error, condition_tolerance(scene, scene.penalty)


def _patch(name: str, shown: Shown) -> Patch:
    scene = catalogue.make_scene(name, penalty=shown.stiffness * YOUNG)
    case = scene.case()
    members = shown.members
    solved = pictures.solve_scene(case, [cast.subject(member) for member in members])
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
        shown.stiffness,
        solved.solutions[0].pressure,
        solved,
        curves,
    )


def _curve(member: Member, solved: SolvedScene, solution: Solution, origin: float) -> Curve:
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
    return Curve(member, x[order] - origin, pressure[order] / solution.pressure, at_points, solution)
