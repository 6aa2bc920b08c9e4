"""The sweep that makes residual and tangent of VTS-PPT: against the readable residual, wide couplings, threads."""

from typing import Any

import numpy as np
import pytest
from every_formulation import draw_multipliers, load
from surfaces import complex_step, make_bent

from contactverif import Interface
from contactverif.geometry import threads

NAMES = ("vts-ppt", "vts-ppt:n=3", "vts-ppt-balanced", "vts-ppt-lm")


def make_one_over_many(n_master: int) -> tuple[Interface, Any]:
    """Return two slave segments over many master segments, pressed into them, with an overhang."""
    along = np.linspace(1, 0, n_master + 1)
    master = np.column_stack([along, 0.01 * np.cos(9 * along)])
    interface = Interface.from_chains([[-0.1, -0.02], [0.5, -0.03], [1, -0.02]], master)
    return interface, interface.nodes.ravel()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("n_master", [5, 11, 22, 40])
def test_a_slave_segment_over_many_has_the_tangent_of_the_complex_step(name: str, n_master: int) -> None:
    formulation, (interface, x) = load(name), make_one_over_many(n_master)
    z = np.append(x, draw_multipliers(formulation, interface, 1, -0.5, 2))
    pairing = formulation.pair(interface, z)
    assert pairing["active"].any()
    residual, tangent = formulation.residual_and_tangent(interface, pairing, z)
    moved = complex_step(formulation, interface, pairing, z)
    assert np.abs(moved - tangent.toarray()).max() <= 1e-13 * np.abs(tangent).max()
    expected = formulation.residual(interface, pairing, z)
    assert np.abs(residual - expected).max() <= 1e-14 * np.abs(expected).max()


def test_the_tangent_grows_with_the_number_of_master_segments_and_not_with_its_square() -> None:
    formulation, entries = load("vts-ppt"), []
    for n_master in (100, 200):
        interface, z = make_one_over_many(n_master)
        entries.append(formulation.tangent(interface, formulation.pair(interface, z), z).nnz)
    assert entries[1] <= 2.1 * entries[0]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(3))
def test_threads_change_no_bit(name: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "LEAST_PART", 1)
    interface, x = make_bent(seed) if seed else make_one_over_many(40)
    answers = []
    for count in (1, 2, 3):
        formulation = load(f"{name}{',' if ':' in name else ':'}threads={count}")
        z = np.append(x, draw_multipliers(formulation, interface, 1, -0.5, 2))
        pairing = formulation.pair(interface, z)
        residual, tangent = formulation.residual_and_tangent(interface, pairing, z)
        arrays = [*pairing.values(), residual, tangent.indptr, tangent.indices, tangent.data]
        answers.append([array.tobytes() for array in arrays])
    assert answers[0] == answers[1] == answers[2]
