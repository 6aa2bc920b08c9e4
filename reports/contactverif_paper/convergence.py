"""How Newton's method converges with VTS-ME and with both tangents of VTS-PPT, on case C.

The paper prints neither materials nor supports. Here ε̂ = E, p = E/100, the sides of the blocks are free (else the
consistent version is exact after one step), and the slave begins where it touches. The linear rate of the basic version
is known: the spectral radius of I − K_basic⁻¹ K_consistent at the solution.

Source: Zavarise & De Lorenzis (2009), Fig. 30, Sections 6.1 and 6.2.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import dense
from contactverif.mechanics import newton
from contactverif.scenes import catalogue
from contactverif_paper import cast
from contactverif_paper.paper_data import Convergence, History, Member, Said, Statement

YOUNG, PRESSURE = 1e4, 100.0
RATIOS = (1.0, 0.5)  # E of the master over E of the slave
STIFFNESS = (0.1, 1.0, 10.0, 100.0, 1e4)  # ε̂ over E, per unit of length


def convergence() -> Convergence:
    """Histories at ε̂ = E for equal and unequal materials, and rates over ε̂ / E for equal ones."""
    histories = tuple(tuple(_history(member, ratio) for member in cast.CONVERGENCE) for ratio in RATIOS)
    found = np.array([_rate(stiffness) for stiffness in STIFFNESS])
    return Convergence("c", np.array(RATIOS), histories, np.array(STIFFNESS), found[:, 0], found[:, 1])


def statements(found: Convergence) -> tuple[Statement, ...]:
    """What the paper says, beside it."""
    equal, unequal = ({one.member.formulation: one for one in row} for row in found.histories)
    counts, others = (
        ", ".join(f"{one.member.legend} {one.n_iterations}" for one in row.values()) for row in (unequal, equal)
    )
    basic = equal["vts-ppt-basic"]
    quick = max(row[name].n_iterations for row in (equal, unequal) for name in ("vts-me", "vts-ppt"))
    slow = [row["vts-ppt-basic"].n_iterations for row in (equal, unequal)]
    apart = float(np.nanmax(np.abs(found.rate / found.radius - 1)))
    return (
        Statement(
            "Fig. 30",
            "Case C: the axis has room for 16 iterations and 14 decades; the basic version needs it, the consistent "
            "one and VTS-ME a few iterations",
            f"to roundoff: {counts} (master half as stiff as the slave); {others} (equal materials)",
            Said.of(quick <= 5 and 13 <= min(slow) <= max(slow) <= 16),
            "fig30",
        ),
        Statement(
            "Section 6.1",
            "with the tangent of VTS-ME convergence is no longer quadratic; no rate is given",
            f"it is linear: each step leaves {basic.rate:.3f} of the residual at ε̂ = E, and {found.radius.min():.2f} "
            f"to {found.radius.max():.2f} for ε̂/E from {found.stiffness.min():g} to {found.stiffness.max():g}. That "
            f"is, within {apart:.0%}, the spectral radius of I − K_basic⁻¹ K_consistent",
            Said.SILENT,
            "fig30",
        ),
    )


def solved(member: Member, ratio: float, stiffness: float) -> newton.Trace:
    """Case C with free sides, from the slave just touching; ε̂ = stiffness × E."""
    scene = catalogue.make_scene(
        "c", young=YOUNG, ratio=ratio, pressure=PRESSURE, penalty=stiffness * YOUNG, lowered=0.0, sides="free"
    )
    return newton.solve(scene, cast.subject(member).for_case(scene.case()), iterations=80)


def _history(member: Member, ratio: float) -> History:
    trace = solved(member, ratio, 1.0)
    floor = float(trace.floors[-1])
    return History(member, trace.residuals, floor, trace.end.label, _last_rate(trace.residuals, floor))


def _last_rate(residuals: np.ndarray, floor: float) -> float:
    """Mean ratio of the residuals in the last five steps that end well above roundoff; NaN where there are no six."""
    above = residuals[residuals > 1e2 * floor]
    return float((above[-1] / above[-6]) ** (1 / 5)) if len(above) > 6 else np.nan


def _rate(stiffness: float) -> tuple[float, float]:
    """(spectral radius, observed rate) of the basic version."""
    trace = solved(cast.BASIC, 1.0, stiffness)
    q, case = trace.solution, trace.scene.case()
    matrices = []
    for member in (cast.BASIC, cast.VTS_PPT):
        system = newton.System(trace.scene, cast.subject(member).for_case(case))
        matrices.append(dense(system.matrix(q, system.pair(q))[0]))
    basic, consistent = matrices
    iteration = np.eye(len(q)) - np.linalg.solve(basic, consistent)
    radius = float(np.abs(np.linalg.eigvals(iteration)).max())
    return radius, _last_rate(trace.residuals, float(trace.floors[-1]))
