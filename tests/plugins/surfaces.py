"""Surfaces for the tests of formulations: bent and pressed into each other, flat and pressed evenly."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import numpy as np

from contactverif import Interface

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
    angle = random.uniform(-0.4, 0.4)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x[: len(slave)] = x[: len(slave)] @ turn.T - [0, 0.3]
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


def contact_forces(formulation: Any, interface: Interface, z: Any) -> Any:
    """Return the forces (n_nodes, 2) by which contact pushes the nodes."""
    residual = formulation.residual(interface, formulation.pair(interface, z), z)
    return -residual[: interface.n_unknowns].reshape(-1, 2)
