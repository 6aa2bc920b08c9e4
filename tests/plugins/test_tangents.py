"""Exact tangents, compiled and not, on random bent surfaces with every kind of free end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from surfaces import make_bent

import contactverif_nts
from contactverif.geometry import block_rows, chain_search, local_matrix, projection
from contactverif.geometry.compiled import python_function
from contactverif_nts import box3, box3_couplings, box3_gains, box3_tangent, eq6, eq6_tangent, turned_force, walk

METHODS = [
    ("nts", {}),
    ("nts_ar", {}),
    ("nts_ar", {"area": "reference"}),
    ("vts_g", {"n": 3}),
    ("vts_me", {"n": 2}),
    ("vts_me", {"n": 5, "area": "reference"}),
    ("vts_ppt", {}),
    ("vts_ppt", {"n": 1}),
    ("vts_ppt", {"n": 3, "free_end": "extend"}),
    ("vts_ppt", {"free_end": "cover"}),
    ("vts_ppt_balanced", {}),
    ("vts_ppt_balanced", {"n": 1}),
    ("vts_ppt_balanced", {"n": 3, "area": "reference"}),
    ("vts_ppt_balanced", {"free_end": "truncate"}),
]
IDS = [f"{name}{options or ''}" for name, options in METHODS]


@pytest.mark.parametrize(("name", "options"), METHODS, ids=IDS)
def test_the_tangent_is_the_complex_step(name: str, options: dict[str, Any]) -> None:
    formulation = getattr(contactverif_nts, name)(penalty=8.0, **options)
    in_contact = cuts = 0
    for seed in range(100):
        interface, z = make_bent(seed)
        pairing = formulation.pair(interface, z)
        tangent = formulation.tangent(interface, pairing, z).toarray()
        h = 2.0**-100
        moved = formulation.residual(interface, pairing, z + 1j * h * np.eye(z.size))
        assert np.abs(moved.imag.T / h - tangent).max() <= 1e-13 * np.abs(tangent).max()
        in_contact += bool(pairing["active"].any())
        cuts += "cut_p" in pairing and bool((pairing["frame"] >= 0).any())
    assert in_contact > 50
    if options.get("free_end", "cover" if name == "vts_ppt_balanced" else "") == "cover":
        assert cuts > 50


@pytest.mark.parametrize(("name", "options"), METHODS, ids=IDS)
def test_symmetric_and_conserving_as_declared(name: str, options: dict[str, Any]) -> None:
    formulation = getattr(contactverif_nts, name)(penalty=8.0, **options)
    worst = {"symmetric": 0.0, "force": 0.0, "moment": 0.0}
    for seed in range(50):
        interface, z = make_bent(seed)
        pairing = formulation.pair(interface, z)
        tangent = formulation.tangent(interface, pairing, z).toarray()
        forces = formulation.residual(interface, pairing, z).reshape(-1, 2)
        if not forces.any():
            continue
        x, size = z.reshape(-1, 2), np.abs(forces).sum()
        moment = (x[:, 0] * forces[:, 1] - x[:, 1] * forces[:, 0]).sum()
        worst["symmetric"] = max(worst["symmetric"], np.abs(tangent - tangent.T).max() / np.abs(tangent).max())
        worst["force"] = max(worst["force"], np.abs(forces.sum(axis=0)).max() / size)
        worst["moment"] = max(worst["moment"], abs(moment) / size)
    traits = formulation.traits
    assert bool(worst["symmetric"] < 1e-13) is traits.promises.symmetric
    if "free_end" not in options:  # the promises are those of the presets
        assert bool(worst["force"] < 1e-13) is traits.promises.conserves_force
        assert bool(worst["moment"] < 1e-12) is traits.promises.conserves_moment


@pytest.mark.parametrize(("name", "options"), METHODS, ids=IDS)
def test_uncompiled_kernels_agree(name: str, options: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    formulation = getattr(contactverif_nts, name)(penalty=8.0, **options)
    scenes = [make_bent(seed) for seed in range(4)]

    def answers() -> list[Any]:
        computed = []
        for interface, z in scenes:
            pairing = formulation.pair(interface, z)
            computed += [
                formulation.residual(interface, pairing, z),
                formulation.tangent(interface, pairing, z).toarray(),
            ]
        return computed

    compiled = answers()
    for module in (
        projection,
        chain_search,
        block_rows,
        local_matrix,
        eq6,
        walk,
        box3,
        turned_force,
        eq6_tangent,
        box3_couplings,
        box3_gains,
        box3_tangent,
    ):
        for attribute, value in list(vars(module).items()):
            if hasattr(value, "py_func"):
                monkeypatch.setattr(module, attribute, python_function(value))
    for first, other in zip(compiled, answers(), strict=True):
        assert first == pytest.approx(other, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("name", "options"), METHODS, ids=IDS)
def test_a_batch_is_a_loop_bitwise(name: str, options: dict[str, Any]) -> None:
    formulation = getattr(contactverif_nts, name)(penalty=8.0, **options)
    interface, z = make_bent(3)
    pairing = formulation.pair(interface, z)
    states = z + 1e-3 * np.random.default_rng(0).normal(size=(3, 2, z.size))
    batch = formulation.residual(interface, pairing, states)
    assert batch.shape == states.shape
    for i in range(3):
        for j in range(2):
            assert np.array_equal(batch[i, j], formulation.residual(interface, pairing, states[i, j]))


def test_basic_has_the_residual_of_the_printed_one_and_the_tangent_of_vts_me() -> None:
    differs = 0
    for seed in range(50):
        interface, z = make_bent(seed)
        printed, basic, me = (
            make(penalty=8.0)
            for make in (contactverif_nts.vts_ppt, contactverif_nts.vts_ppt_basic, contactverif_nts.vts_me)
        )
        pairing, pairing_me = printed.pair(interface, z), me.pair(interface, z)
        assert np.array_equal(printed.residual(interface, pairing, z), basic.residual(interface, pairing, z))
        tangent = basic.tangent(interface, pairing, z).toarray()
        if np.array_equal(pairing["active"], pairing_me["active"]):
            assert tangent == pytest.approx(me.tangent(interface, pairing_me, z).toarray(), abs=1e-12)
        differs += not np.allclose(tangent, printed.tangent(interface, pairing, z).toarray())
    assert differs > 10
