"""Surfaces for the tests of formulations: bent and pressed into each other, flat and pressed evenly, on a grid."""

from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import numpy as np

from contactverif import Interface, Surface

DEPTH = 1 / 8


def make_bent(seed: int) -> tuple[Interface, Any]:
    """Return a bent, tilted slave pressed into a bent master, with overhang on either side: the interface and z."""
    random = np.random.default_rng(seed)
    chains = []
    for _ in range(2):
        along = np.cumsum(random.uniform(0.2, 2, random.integers(2, 7)))
        chains.append(np.column_stack([along, np.zeros_like(along)]))
    slave, master = chains[0], chains[1][::-1] + [random.uniform(-1, 1), 0]
    interface = Interface.from_chains(slave, master)
    x = interface.nodes + random.normal(scale=0.08, size=interface.nodes.shape)
    x[: len(slave)] = turn(x[: len(slave)], random.uniform(-0.4, 0.4)) - [0, 0.3]
    return interface, x.ravel()


def make_flat(slave: Sequence[float], master: Sequence[float], shift: float = 0.0) -> tuple[Interface, Any]:
    """Segments of these lengths, from left to right; the slave is DEPTH below the master, which begins at `shift`."""
    upper = np.array([0.0, *accumulate(slave)])
    lower = np.array([0.0, *accumulate(master)])[::-1] + shift
    interface = Interface.from_chains(
        np.column_stack([upper, np.zeros_like(upper)]), np.column_stack([lower, np.zeros_like(lower)])
    )
    x = interface.nodes.copy()
    x[: len(upper), 1] -= DEPTH
    return interface, x.ravel()


def make_on_grid(kind: str, seed: int, depth: float) -> tuple[Interface, Any]:
    """Return facing surfaces with coordinates on 2⁻³², penetrating by about `depth`: the interface and positions.

    Points inside their segments need more bits than nodes, so a translation by 2²⁰ rounds them and leaves nodes exact.
    The kinds are "flat", "turned", "tilted" (the slave alone is turned, by .05 to .4), "kinked" and "overhanging".
    """
    random = np.random.default_rng(seed)
    slave, master = (np.cumsum(random.uniform(0.2, 2, random.integers(3, 9))) for _ in range(2))
    slave += random.uniform(-0.5, 0.5)
    along = np.append(slave - slave.mean(), master[::-1] - master.mean())
    x = np.column_stack([along, np.zeros_like(along)])
    if kind == "overhanging":
        x[: len(slave), 0] += 1.5
    if kind == "kinked":
        x[:, 1] = random.normal(scale=0.1, size=len(x))
    reference, on_slave = x, slice(0, len(slave))
    x = reference - [0, depth] * (np.arange(len(x)) < len(slave))[:, None]
    if kind == "tilted":
        x[on_slave] = turn(x[on_slave] - x[on_slave].mean(axis=0), random.uniform(0.05, 0.4)) + x[on_slave].mean(axis=0)
    angle = 0.0 if kind == "flat" else random.uniform(0, 2 * np.pi)
    reference, x = (np.round(turn(each, angle) * 2.0**32) / 2.0**32 for each in (reference, x))
    return Interface.from_chains(reference[on_slave], reference[len(slave) :]), x


def make_far(seed: int, ratio: float) -> tuple[Interface, Any]:
    """Return flat surfaces near 1e6, with full mantissas and a penetration of 1e-6: the interface and positions.

    They are turned by any angle. Lengths of segments are between 1/√ratio and √ratio.
    """
    random = np.random.default_rng(seed)
    n_slave, n_master = random.integers(2, 8, 2)
    chains = [np.cumsum(np.append(0, ratio ** random.uniform(-0.5, 0.5, n))) for n in (n_slave, n_master)]
    along = np.concatenate([chain - chain.mean() for chain in (chains[0], chains[1][::-1])])
    reference = np.column_stack([along, np.zeros_like(along)])
    x = reference.copy()
    x[: n_slave + 1, 1] -= 1e-6
    angle, offset = random.uniform(0, 2 * np.pi), random.uniform(0.5, 1.5, 2) * 1e6
    reference, x = (turn(each, angle) + offset for each in (reference, x))
    return Interface.from_chains(reference[: n_slave + 1], reference[n_slave + 1 :]), x


def make_closed(slave: Any, master: Any) -> Interface:
    """Return an interface of two closed chains."""
    rings = (np.column_stack([places := np.arange(len(chain)), np.roll(places, -1)]) for chain in (slave, master))
    slave_ring, master_ring = rings
    return Interface(np.vstack([slave, master]), Surface(slave_ring), Surface(master_ring + len(slave)))


def turn(x: Any, angle: float) -> Any:
    """Turn positions (n_nodes, 2) about the origin."""
    return x @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def complex_step(formulation: Any, interface: Interface, pairing: Any, z: Any) -> Any:
    """Return the derivative of the residual on a frozen pairing (n_unknowns, n_unknowns)."""
    h = 2.0**-100
    return formulation.residual(interface, pairing, z + 1j * h * np.eye(z.size)).imag.T / h


def contact_forces(formulation: Any, interface: Interface, z: Any) -> Any:
    """Return the forces (n_nodes, 2) by which contact pushes the nodes."""
    residual = formulation.residual(interface, formulation.pair(interface, z), z)
    return -residual[: interface.n_unknowns].reshape(-1, 2)
