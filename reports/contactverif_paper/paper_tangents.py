"""What the paper says of tangents: which is consistent, that it is unsymmetric, and which cannot be had.

All is asked in the solution of Example 1bis with a foundation half as stiff as the punch and free sides: nothing is
exact after one step there, and no end of a segment lies on another, as in case C, where segment-to-segment has a kink.
That K is the derivative is asked by a complex step, whose error is roundoff alone.

Source: Zavarise & De Lorenzis (2009), Sections 6.2 and 6.3.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import dense
from contactverif.contract.result import NotLoaded
from contactverif.mechanics import newton
from contactverif.run.registry import load_properties
from contactverif.run.runner import judge_case
from contactverif.scenes import catalogue
from contactverif_paper import cast
from contactverif_paper.paper_data import Member, Said, Statement, Tangents
from contactverif_reports.html.pages import number

SCENE = "example-1bis"
OPTIONS = {"ratio": 0.5, "pressure": 100.0, "penalty": 1e4, "lowered": 0.0, "sides": "free"}  # ε̂ = E
DIRECTIONS = 8
_TINY = 2.0**-100  # of a length of 1: the complex step rounds nothing away
_EXACT = 1e-12  # of a complex step: a few hundred roundoffs of sums of a few dozen terms


def tangents() -> Tangents:
    """Of VTS-ME, both versions of VTS-PPT, and segment-to-segment."""
    rows = np.array([_row(member) for member in cast.TANGENTS])
    return Tangents(SCENE, cast.TANGENTS, rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3].astype(np.int64))


def _row(member: Member) -> tuple[float, float, float, int]:
    scene = catalogue.make_scene(SCENE, **OPTIONS)
    formulation = cast.subject(member).for_case(scene.case())
    trace = newton.solve(scene, formulation)
    z = trace.z
    pairing = formulation.pair(scene.interface, z)
    matrix = dense(formulation.tangent(scene.interface, pairing, z))
    directions = np.random.default_rng(0).uniform(-1.0, 1.0, (DIRECTIONS, z.size))
    true = formulation.residual(scene.interface, pairing, z + 1j * _TINY * directions).imag / _TINY
    ours = directions @ matrix.T
    error = float((np.abs(ours - true).max(axis=1) / np.abs(true).max(axis=1)).max())
    asymmetry = float(np.abs(matrix - matrix.T).max() / np.abs(matrix).max())
    return error, asymmetry, _order(member, trace), trace.n_iterations


def _order(member: Member, trace: newton.Trace) -> float:
    """What the property `newton.order` finds on this scene; NaN where it decides nothing."""
    (question,) = load_properties(["newton.order"])
    assert not isinstance(question, NotLoaded)
    found = judge_case(question, trace.scene.case(), cast.subject(member)).measurement
    return np.nan if found is None or found.undecided else found.values.get("order of one Newton step", np.inf)


def statements(found: Tangents) -> tuple[Statement, ...]:
    """What the paper says, beside it."""
    me, basic, ppt, sts = (found.row(one.formulation) for one in (cast.VTS_ME, cast.BASIC, cast.VTS_PPT, cast.STS))
    return (
        Statement(
            "Section 6.2",
            "with the consistent tangent VTS-PPT converges quadratically",
            f"one Newton step is of order {found.order[ppt]:.2f}, with the basic tangent of order "
            f"{found.order[basic]:.2f}; the tangent differs from a complex step by {number(found.error[ppt], 2)}",
            Said.of(found.order[ppt] >= 1.9 and found.error[ppt] <= _EXACT),
            "fig30",
        ),
        Statement(
            "Section 6.2",
            "the consistent tangent is unsymmetric",
            f"largest entry of K − Kᵀ over that of K: {number(found.asymmetry[ppt], 2)}; that of VTS-ME is unsymmetric "
            f"too, by {number(found.asymmetry[me], 2)}, since areas are measured in the current configuration",
            Said.of(found.asymmetry[ppt] > _EXACT),
        ),
        Statement(
            "Section 6.3",
            "an exact tangent of a segment-to-segment formulation is practically unfeasible, with up to 392 terms",
            f"the plugin sts has one: it differs from a complex step by {number(found.error[sts], 2)}, a step of "
            f"Newton’s method is of order {found.order[sts]:.2f}, and {found.iterations[sts]} iterations solve Example "
            "1bis. Each number of a point carries its derivatives along, so that no term is written by hand",
            Said.of(not found.error[sts] <= _EXACT),
        ),
    )
