"""Three defects of VTS-PPT as it is published, computed: no balance under tilt, a jump, and free ends.

- A virtual slave node whose area of competence lies over several master segments gives each its projected length
  (Box 3), but keeps its own force on the whole length: where the slave is tilted by θ against the master, 1 − cos θ of
  the force is lost.
- Where the area lies over one segment Eq. 6 holds, and nothing is lost. So the forces jump when the end of an area
  passes a master node, by up to 1 − cos θ of the force of that virtual slave node. Here two areas meet over the node,
  and their jumps partly cancel.
- Where the area overhangs the free end of the master, the slave is pushed by more than the master.

No case of the paper shows them: its slave and master are parallel and end together, or the master goes on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface
from contactverif.mechanics import newton
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.simple_bodies import Rectangle, block
from contactverif.scenes.uniform_stress import stress_error
from contactverif_paper import cast
from contactverif_paper.paper_data import Defects, Member, Said, Series, Statement
from contactverif_reports.html.pages import number

TILTS = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4])
SLIDING_TILT = 0.3
_DEPTH = 1.0 / 8  # penetration of the slave's first node, over its length
_PENALTY = 8.0
_MASTER = (-1.0, 0.25, 0.75, 2.0)  # the area of competence of each quarter point crosses a node, to θ = 0.5
_NEAR = 2.0**-40  # of the slave's length: on either side of a jump
_OVERHANGS = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9])  # of a slave segment


def defects(told: Callable[[str], None]) -> Defects:
    """All three."""
    told("balance under tilt")
    balanced = cast.BALANCE
    both = np.array([[_imbalance(member, theta) for theta in TILTS] for member in balanced])
    told("jump between Eq. 6 and Box 3")
    printed = (cast.VTS_PPT, cast.BALANCED, cast.STS)
    shift = np.linspace(-0.06, 0.06, 121) + 2.0**-12
    sliding = np.array([[_transmitted(member, SLIDING_TILT, s) for s in shift] for member in printed])
    jumps = np.array([[_jump(member, theta) for theta in TILTS] for member in printed])
    told("free ends")
    ends = cast.FREE_ENDS
    errors = np.array([[_overhanging(member, part) for part in _OVERHANGS] for member in ends])
    return Defects(
        force=Series(balanced, TILTS, both[..., 0]),
        moment=Series(balanced, TILTS, both[..., 1]),
        sliding_tilt=SLIDING_TILT,
        sliding=Series(printed, shift, sliding),
        jump=Series(printed, TILTS, jumps),
        jump_known=np.array([_known_jump(theta) for theta in TILTS]),
        free_end=Series(ends, _OVERHANGS, errors),
    )


def statements(found: Defects) -> tuple[Statement, ...]:
    """What the paper says, beside it."""

    def at(series: Series, formulation: str, place: float) -> float:
        row = next(i for i, member in enumerate(series.members) if member.formulation == formulation)
        return float(series.values[row, np.argmin(np.abs(series.at - place))])

    lost = [at(found.force, "vts-ppt", theta) for theta in (0.1, 0.3)]
    jumps = [at(found.jump, "vts-ppt", theta) for theta in (0.1, 0.3)]
    ends = found.free_end.values[[member.formulation for member in found.free_end.members].index("vts-ppt")]
    return (
        Statement(
            "Section 5.1.1, Boxes 1–3",
            "that slave and master share a normal is assumed for simplicity, and said not to matter",
            "action is not reaction where areas lie over several segments: the master gets 1 − cos θ less than the "
            f"slave, {number(lost[0])} of the force at θ = 0.1 and {number(lost[1])} at 0.3, and a moment is lost "
            "with it",
            Said.DEFECT,
            "defect-tilt",
        ),
        Statement(
            "Eq. 6 and Box 3",
            "one segment under the area: Eq. 6; several: Box 3; nothing is said of the change from one to the other",
            f"nodal forces jump: in the case drawn by {number(jumps[0], 2)} of the slave’s force at θ = 0.1 and by "
            f"{number(jumps[1], 2)} at 0.3; in others by up to 1 − cos θ of a virtual slave node’s own force, "
            f"{1 - np.cos(0.1):.2g} and {1 - np.cos(0.3):.2g}",
            Said.DEFECT,
            "defect-jump",
        ),
        Statement(
            "Boxes 2, 3",
            "nothing is said of an area of competence that overhangs the end of the master",
            f"cut on the master’s side only (our reading), the patch test fails, with errors of the stress up to "
            f"{np.nanmax(ends):.2g} of the pressure",
            Said.DEFECT,
            "defect-ends",
        ),
    )


def _tilted(theta: float, master: Sequence[float]) -> tuple[Interface, FloatArray]:
    """A slave segment of unit length from x = 0, tilted into a flat master; positions (n_nodes, 2)."""
    chain = np.column_stack([master[::-1], np.zeros(len(master))])
    reference = np.array([[0.0, 0.0], [1.0, 0.0]])
    interface = Interface.from_chains(reference, chain)
    state = np.array([[0.0, -_DEPTH], [np.cos(theta), -_DEPTH - np.sin(theta)]])
    return interface, np.vstack([state, chain])


def _pushed(member: Member, theta: float, master: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Positions and forces (n_nodes, 2), slave nodes first."""
    interface, x = _tilted(theta, master)
    formulation = cast.subject(member).with_penalty(_PENALTY)
    z = x.reshape(-1)
    return x, -formulation.residual(interface, formulation.pair(interface, z), z).reshape(-1, 2)


def _imbalance(member: Member, theta: float) -> tuple[float, float]:
    """|ΣR| over the slave's force, |Σ x×R| about the slave's middle over that force times its length."""
    x, forces = _pushed(member, theta, _MASTER)
    size = float(np.linalg.norm(forces[:2].sum(axis=0)))
    arms = x - x[:2].mean(axis=0)
    moment = float((arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum())
    return float(np.linalg.norm(forces.sum(axis=0))) / size, abs(moment) / size


def _slid(theta: float, shift: float) -> Sequence[float]:
    """A master with one node, `shift` behind the beginning of the area of competence of the second quarter point."""
    return (-1.0, np.cos(theta) / 2 + shift, 2.0)


def _transmitted(member: Member, theta: float, shift: float) -> float:
    """The size of the force on the master over that on the slave."""
    _, forces = _pushed(member, theta, _slid(theta, shift))
    slave, master = (np.linalg.norm(forces[side].sum(axis=0)) for side in (slice(0, 2), slice(2, None)))
    return float(master / slave)


def _jump(member: Member, theta: float) -> float:
    """Largest jump of a nodal force where the two areas meet over a master node, over the slave's force."""
    sides = [_pushed(member, theta, _slid(theta, sign * _NEAR))[1] for sign in (-1, 1)]
    return float(np.linalg.norm(sides[1] - sides[0], axis=1).max() / np.linalg.norm(sides[0][:2].sum(axis=0)))


def _known_jump(theta: float) -> float:
    """Eq. 6 gives (1 − ξ) F and ξ F, Box 3 cos θ of them. Left of the node the first area lies over one segment and
    the second over two, right of it the other way round; both forces share the node in the middle.
    """
    depth = _DEPTH + np.array([0.25, 0.75]) * np.sin(theta)
    node = np.cos(theta) / 2
    lengths = np.array([node + 1.0, 2.0 - node])
    away = np.cos(theta) / 4 / lengths  # share of each force that the far node of its segment takes
    force = depth / depth.sum()
    lost = 1 - np.cos(theta)
    shared = force[1] * (1 - away[1]) - force[0] * (1 - away[0])
    return float(lost * max(force[0] * away[0], force[1] * away[1], abs(shared)))


def overhanging(part: float) -> Scene:
    """A slave block that overhangs a narrower master at both ends, by that part of a slave segment; all is uniform.

    The pressure acts on what overhangs of the slave too, so that the exact solution is a uniform stress.
    """
    slave_x, layers = np.linspace(-6.0, 6.0, 7), np.linspace(0.0, 4.0, 3)
    edge = 4.0 - 2.0 * part  # inside the slave segment from 2 to 4
    master_x = np.linspace(-edge, edge, 6)
    young, poisson, pressure = 1e4, 0.3, 100.0
    penalty = 10 * young / 2.0
    upper = block(
        Rectangle(slave_x, layers, young=young, poisson=poisson),
        contact="bottom",
        pressure=pressure,
        lowered=pressure / penalty,
        name="slave",
        contact_range=(-edge, edge),
    )
    lower = block(
        Rectangle(master_x, layers - 4.0, young=young, poisson=poisson), contact="top", approach=0.0, name="master"
    )
    facts = {
        "along": np.concatenate([slave_x, master_x]),
        "direction": np.array([1.0, 0.0]),
        "compliance": np.array([4.0, 4.0]) / upper.oedometric_modulus,
        "pressure": np.array(pressure),
    }
    return Scene((upper, lower), penalty=penalty, facts=facts)


def _overhanging(member: Member, part: float) -> float:
    """Largest error of a stress over the pressure; NaN where Newton ends nowhere."""
    scene = overhanging(part)
    trace = newton.solve(scene, cast.subject(member).for_case(scene.case()))
    return stress_error(scene, scene.stresses(trace.solution)) if trace.converged else np.nan
