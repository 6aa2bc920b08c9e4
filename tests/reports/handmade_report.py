"""Small runs made by hand, from the contracts alone."""

from dataclasses import replace

import numpy as np

from contactverif import Case, Interface, Measurement, Outcome, Property, Quantity, Surface, Verdict
from contactverif.contract.result import NotLoaded, Row, Run

ERROR = Quantity("force error", "u(8X/|g| + 4N)", "rounding of the gap, and of N sums")
SLOPE = Quantity("slope", "1.9", "a remainder of second order", sense="at least")


def question(id_: str = "patch.flat.transmission", family: str = "patch", *quantities: Quantity) -> Property:
    return Property(
        id=id_,
        family=family,
        summary="a uniform pressure is transmitted exactly",
        quantities=quantities,
        cases=lambda interface: None,
        measure=lambda case, subject: Measurement(),
        promise=lambda traits: None,
    )


def flat(
    slave: list[float], master: list[float], penetration: float = 0.125, scale: float = 1.0, angle: float = 0.0
) -> Case:
    """Return a flat interface with these lengths; the slave runs to the right above the master."""
    s, m = (np.concatenate([[0.0], np.cumsum(lengths)]) for lengths in (slave, master[::-1]))
    upper = np.column_stack([s, np.zeros_like(s)])
    lower = np.column_stack([m[::-1], np.zeros_like(m)])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    interface = Interface.from_chains(scale * upper @ turn.T, scale * lower @ turn.T)
    moved = interface.nodes.copy()
    moved[: len(s)] += scale * penetration * turn @ [0.0, -1.0]
    return Case(interface, moved.ravel(), 10.0, {"penetration": np.array(scale * penetration)}, seed=7)


def outcome(case: Case, value: float, verdict: Verdict | None = None, reason: str = "") -> Outcome:
    verdict = verdict or (Verdict.PASS if value <= 1e-12 else Verdict.FAIL)
    reason = reason or ("" if verdict is Verdict.PASS else f"force error {value:.3g}, at most 1e-12")
    measurement = Measurement([ERROR.check(value, 1e-12)], details={"Σ|R|": 2.5})
    return Outcome(case, verdict, reason, measurement, seconds=0.25)


def awkward() -> Case:
    """Everything that is hard to store: two chains, one closed; −0.0, the smallest number, parameters of all shapes."""
    slave = [[0.0, 0.0], [1.0, -0.0], [3.0, 0.1], [4.0, 1 / 3]]
    ring = [[0.0, -1.0], [1.0, -2.0], [-1.0, -3.0]]
    interface = Interface(
        np.array(slave + ring), Surface(np.array([[0, 1], [2, 3]])), Surface(np.array([[4, 5], [5, 6], [6, 4]]))
    )
    z = interface.nodes.ravel() + np.pi * 1e-17
    z[3] = -0.0
    z[0] = 5e-324
    parameters = {
        "penetration": np.array(0.1),
        "directions": np.arange(6.0).reshape(2, 3) / 7,
        "none": np.empty((0, 2)),
        "a/b ′": np.array([np.nan, -np.inf]),
    }
    return Case(interface, z, np.nextafter(1.0, 2.0), parameters, seed=2**63 - 5, name="C′ №1")


def run_with_kinds() -> Run:
    """Two formulations on cases of three kinds; one kind has no case, another is always idle, and one case has none."""
    info = question("projection.place", "projection", ERROR)
    info = replace(info, kinds=("inside a segment", "from behind", "second body behind"))
    plain, other = question("balance.force", "balance", ERROR), question("units", "invariants", ERROR)
    inside, behind = (replace(flat([1], [2]), kind=kind) for kind in info.kinds[:2])
    passed, idle = outcome(inside, 1e-15), outcome(behind, 0.0)
    assert idle.measurement is not None
    idle = replace(idle, measurement=replace(idle.measurement, idle=True))
    ties = [outcome(inside, 0.5, Verdict.UNDECIDED, f"a tie of {n} segments") for n in (2, 3)]
    strange, failed = outcome(replace(flat([1], [2]), kind="of another strategy"), 1e-15), outcome(inside, 0.5)
    outcomes = (passed, *ties, idle, idle, strange, outcome(flat([1], [2]), 1e-15))
    rows = [
        Row("mine", info, Verdict.PASS, True, planned=7, outcomes=outcomes, seconds=1.0),
        Row("mine", plain, Verdict.PASS, True, planned=2, outcomes=(passed, idle)),
        Row("mine", other, Verdict.PASS, True, planned=1, outcomes=(outcome(flat([1], [2]), 0.0),)),
        Row("yours", info, Verdict.FAIL, None, planned=1, outcomes=(failed,), shrunk=failed),
    ]
    parts = {"pair": True, "tangent": True, "contact_points": True}
    return Run(tuple(rows), (), {"mine": parts, "yours": parts}, {"seed": "1", "examples": "7"})


def small_run(*, passing: bool = False) -> Run:
    """Two formulations, three properties; a shrunk failure, a witness, undecided and crashed cases."""
    patch = question("patch.flat.transmission", "patch", ERROR)
    slopes = question("tangent.directional", "tangent", ERROR, SLOPE)
    nothing = question("objectivity", "invariants")
    good, bad = flat([2, 2], [4]), flat([2, 2, 4, 4], [3, 3, 3, 3])
    passed = tuple(outcome(good, 1e-15 * (n + 1)) for n in range(4))
    failed = (*passed[:2], outcome(bad, 0.25), outcome(bad, 3e-3, Verdict.UNDECIDED, "a node on a kink"))
    crashed = Outcome(good, Verdict.CRASHED, "ZeroDivisionError: at residual")
    rows = [Row("vts-ppt", patch, Verdict.PASS, True, planned=4, outcomes=passed, seconds=1.0)]
    rows += [Row("vts-ppt", slopes, Verdict.NOT_PROVIDED, None, reason="tangent: not provided")]
    rows += [Row("vts-ppt", nothing, Verdict.PASS, None, planned=1, outcomes=(Outcome(good, Verdict.PASS),))]
    if not passing:
        witness = outcome(awkward(), 0.1)
        rows += [
            Row("vts-me:n=4", patch, Verdict.FAIL, False, reason="force error 0.25, at most 1e-12", planned=4,
                outcomes=failed[:3], witness=witness, shrunk=outcome(bad, 0.25), seconds=2.0),
            Row("vts-me:n=4", slopes, Verdict.FAIL, False, planned=4, outcomes=passed, witness=witness),
            Row("vts-me:n=4", nothing, Verdict.CRASHED, None, planned=1, outcomes=(crashed,), shrunk=crashed),
        ]  # fmt: skip
    parts = {"pair": True, "tangent": False, "contact_points": True}
    return Run(
        tuple(rows),
        () if passing else (NotLoaded("mine", "ModuleNotFoundError: No module named 'mine'"),),
        {"vts-ppt": parts} if passing else {"vts-ppt": parts, "vts-me:n=4": parts | {"tangent": True}},
        {"created": "2025-01-01T00:00:00", "command": "verify", "platform": "Linux", "seed": "7", "examples": "4",
         "empty": ""},
    )  # fmt: skip
