"""The sweep that makes residual and tangent of VTS-PPT: against the readable residual, wide couplings, threads."""

from typing import Any

import numpy as np
import pytest
from surfaces import make_bent

import contactverif_nts
from contactverif import Interface, MisuseError
from contactverif.geometry import threads
from contactverif_nts.patch_test_passing import PatchTestPassing
from contactverif_nts.vts_ppt_tangent import WHOLE, list_couplings

METHODS = [("vts_ppt", {}), ("vts_ppt", {"n": 3}), ("vts_ppt_balanced", {}), ("vts_ppt_lm", {})]
IDS = [f"{name}{options or ''}" for name, options in METHODS]
H = 2.0**-100  # The length of a complex step.


def with_multipliers(formulation: PatchTestPassing, interface: Interface, x: Any) -> Any:
    n = formulation.n_multipliers(interface)
    return np.append(x, np.random.default_rng(n).uniform(-0.5, 2, n))


def make_one_over_many(n_master: int) -> tuple[Interface, Any]:
    """Return two slave segments over many master segments, pressed into them, with an overhang."""
    along = np.linspace(1, 0, n_master + 1)
    master = np.column_stack([along, 0.01 * np.cos(9 * along)])
    interface = Interface.from_chains([[-0.1, -0.02], [0.5, -0.03], [1, -0.02]], master)
    return interface, interface.nodes.ravel()


@pytest.mark.parametrize(("name", "options"), METHODS, ids=IDS)
@pytest.mark.parametrize("n_master", [5, 11, 22, 40])
def test_a_slave_segment_over_many_has_the_tangent_of_the_complex_step(
    name: str, options: dict[str, Any], n_master: int
) -> None:
    formulation = getattr(contactverif_nts, name)(penalty=8.0, **options)
    interface, x = make_one_over_many(n_master)
    z = with_multipliers(formulation, interface, x)
    pairing = formulation.pair(interface, z)
    assert pairing["active"].any()
    residual, tangent = formulation.residual_and_tangent(interface, pairing, z)
    moved = formulation.residual(interface, pairing, z + 1j * H * np.eye(z.size))
    assert np.abs(moved.imag.T / H - tangent.toarray()).max() <= 1e-13 * np.abs(tangent).max()
    expected = formulation.residual(interface, pairing, z)
    assert np.abs(residual - expected).max() <= 1e-14 * np.abs(expected).max()


def test_the_tangent_grows_with_the_number_of_master_segments_and_not_with_its_square() -> None:
    formulation, entries = contactverif_nts.vts_ppt(penalty=8.0), []
    for n_master in (100, 200):
        interface, z = make_one_over_many(n_master)
        entries.append(formulation.tangent(interface, formulation.pair(interface, z), z).nnz)
    assert entries[1] <= 2.1 * entries[0]


@pytest.mark.parametrize(("n_master", "kinds"), [(5, "whole segments"), (22, "points"), (40, "single segments")])
def test_couplings_become_smaller_where_they_have_too_many_nodes(n_master: int, kinds: str) -> None:
    formulation = contactverif_nts.vts_ppt(penalty=8.0)
    interface, z = make_one_over_many(n_master)
    surfaces, areas, _ = formulation._arguments(interface, formulation.pair(interface, z), z)
    _, _, first, end, segment = list_couplings(surfaces, areas, 2, 2, -1)
    expected = {"whole segments": (2, True), "points": (1, True), "single segments": (1, False)}[kinds]
    assert ((end - first).max(), bool((segment == WHOLE).all())) == expected


@pytest.mark.parametrize(("name", "options"), METHODS, ids=IDS)
@pytest.mark.parametrize("seed", range(3))
def test_threads_change_no_bit(name: str, options: dict[str, Any], seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "LEAST_PART", 1)
    interface, x = make_bent(seed) if seed else make_one_over_many(40)
    answers = []
    for count in (1, 2, 3):
        formulation = getattr(contactverif_nts, name)(penalty=8.0, **options, threads=count)
        z = with_multipliers(formulation, interface, x)
        pairing = formulation.pair(interface, z)
        residual, tangent = formulation.residual_and_tangent(interface, pairing, z)
        arrays = [*pairing.values(), residual, tangent.indptr, tangent.indices, tangent.data]
        answers.append([array.tobytes() for array in arrays])
    assert answers[0] == answers[1] == answers[2]


def test_the_number_of_threads_is_checked() -> None:
    with pytest.raises(MisuseError, match=r"threads: found 0; needed a whole number from 1 to 1000"):
        contactverif_nts.vts_ppt(penalty=8.0, threads=0)
