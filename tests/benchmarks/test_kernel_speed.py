"""The kernels of each built-in formulation: the search beside a sort, forces and tangent beside a copy.

Copying as many bytes as the tangent has is the least that any kernel could do.
"""

from typing import Any

import numpy as np
import pytest
from racing import Race
from scipy import sparse
from subjects import load_subject, plane_names

from contactverif import Interface, evaluate_both

NAMES = (*plane_names(), "two-pass/nts-ar")
N_SLAVE = 300


def pressed_waves(n_slave: int = N_SLAVE) -> Interface:
    """Return a wavy slave pressed into a wavy master of 1.3 times as many segments, all in contact."""
    upper, lower = np.linspace(0, n_slave, n_slave + 1), np.linspace(-0.3, n_slave + 0.4, int(1.3 * n_slave) + 1)
    slave = np.column_stack([upper, -0.2 - 0.05 * np.cos(upper) ** 2])
    return Interface.from_chains(slave, np.column_stack([lower, 0.05 * np.sin(lower)])[::-1])


def state_of(name: str) -> tuple[Any, Interface, Any]:
    """Return the plugin, as it answers without the checks of the harness, its interface and z with multipliers."""
    interface = pressed_waves()
    formulation = load_subject(name).with_penalty(10.0)
    multipliers = np.ones(formulation.n_multipliers(interface))
    return formulation.plugin, interface, np.concatenate([interface.nodes.ravel(), multipliers])


@pytest.mark.parametrize("name", NAMES)
def test_search(race: Race, benchmark: Any, name: str) -> None:
    benchmark.group = f"search, {N_SLAVE} slave segments"
    plugin, interface, z = state_of(name)
    numbers = np.random.default_rng(1).permutation(interface.nodes.ravel())
    race(lambda: plugin.pair(interface, z), lambda: np.sort(numbers), "numpy sorts all coordinates")


@pytest.mark.parametrize("name", NAMES)
def test_forces_and_tangent(race: Race, benchmark: Any, name: str) -> None:
    benchmark.group = f"forces and tangent, {N_SLAVE} slave segments"
    plugin, interface, z = state_of(name)
    pairing = plugin.pair(interface, z)
    matrix = sparse.csr_array(evaluate_both(plugin, interface, pairing, z)[1])
    parts = (matrix.data, matrix.indices, matrix.indptr)
    assert matrix.nnz
    race(
        lambda: evaluate_both(plugin, interface, pairing, z),
        lambda: [part.copy() for part in parts],
        "numpy copies the tangent",
    )
