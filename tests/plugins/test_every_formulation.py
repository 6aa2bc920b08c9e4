"""All formulations answer alike on random bent surfaces: exact tangents, declared balance, batches, plain kernels."""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from every_formulation import FORMULATIONS, bent_state, load
from surfaces import complex_step

import contactverif_mortar
import contactverif_nts
from contactverif import Interface, MisuseError

NAMES = (
    *FORMULATIONS,
    *("vts-me:n=5,area=reference", "vts-ppt:n=1", "vts-ppt:n=3,free_end=extend", "vts-ppt-balanced:n=1"),
    *("vts-ppt-balanced:n=1,free_end=truncate", "vts-ppt-balanced:n=3,free_end=extend"),
    "vts-ppt-lm:transmission=balanced,n=3,free_end=truncate",
    *("vts-me-lm:n=1", "vts-me-lm:n=3,area=reference", "vts-ppt-lm:n=1", "vts-ppt-lm:n=3,free_end=extend"),
    *("vts-ppt-lm:free_end=cover", "vts-ppt-lm:transmission=balanced,n=1,free_end=cover"),
    *("mortar-lm:normals=averaged,area=reference", "mortar-dual:area=reference", "mortar-dual-lm"),
    *(f"two-pass/{name}" for name in ("vts-g", "vts-me", "vts-ppt", "vts-ppt-balanced", "vts-me-lm", "vts-ppt-lm")),
)
EACH = pytest.mark.parametrize("name", NAMES)
POINTS_WITH_MULTIPLIERS = ("nts-lm", "vts-me-lm", "vts-ppt-lm")
OF_CELLS = ("sts", "chen-hisada", "mortar")  # Their sums round less.
# `test_long_double.py` compares all others, where a long double is longer than a double.
UNCOMPILED = NAMES[len(FORMULATIONS) * (np.finfo(np.longdouble).nmant > np.finfo(np.float64).nmant) :]
KERNELS = ("contactverif.geometry.", "contactverif_nts.", "contactverif_mortar.")


def states(formulation: Any, count: int) -> list[tuple[Interface, Any]]:
    """Return bent scenes; half of the multipliers are negative, so that some points let go."""
    return [bent_state(formulation, seed) for seed in range(count)]


@EACH
def test_the_tangent_is_the_complex_step(name: str) -> None:
    formulation = load(name)
    n_active = n_idle = n_cut = n_multipliers = 0
    for interface, z in states(formulation, 70):
        pairing = formulation.pair(interface, z)
        tangent = formulation.tangent(interface, pairing, z).toarray()
        if formulation.traits.promises.tangent == "exact":
            error = np.abs(complex_step(formulation, interface, pairing, z) - tangent).max()
            assert error <= (1e-14 if name.startswith(POINTS_WITH_MULTIPLIERS) else 1e-13) * np.abs(tangent).max()
        active = pairing["active" if "active" in pairing else "pass_1.active"]
        n_active, n_idle = n_active + int(active.sum()), n_idle + int((~active).sum())
        n_cut += "cut_p" in pairing and bool((pairing["frame"] >= 0).any())
        n_multipliers += z.size - interface.n_unknowns
    assert n_active > 70
    assert n_idle > 70 or not n_multipliers
    assert n_cut > 35 or not ("free_end=cover" in name or name == "vts-ppt-balanced")


@EACH
def test_symmetric_and_conserving_as_declared(name: str) -> None:
    formulation = load(name)
    asymmetry = force = moment = 0.0
    for interface, z in states(formulation, 35):
        pairing = formulation.pair(interface, z)
        tangent = formulation.tangent(interface, pairing, z).toarray()
        forces, x = (
            array[: interface.n_unknowns].reshape(-1, 2) for array in (formulation.residual(interface, pairing, z), z)
        )
        if not forces.any():
            continue
        size = np.abs(forces).sum()
        asymmetry = max(asymmetry, np.abs(tangent - tangent.T).max() / np.abs(tangent).max())
        force = max(force, np.abs(forces.sum(axis=0)).max() / size)
        moment = max(moment, abs((x[:, 0] * forces[:, 1] - x[:, 1] * forces[:, 0]).sum()) / size)
    promises, few = formulation.traits.promises, 0.1 if name.startswith(OF_CELLS) else 1.0
    assert bool(asymmetry < 1e-13) is promises.symmetric
    if promises.conserves_force is not None:
        assert bool(force < 1e-13 * few) is promises.conserves_force
    if promises.conserves_moment is not None:
        assert bool(moment < 1e-12 * few) is promises.conserves_moment


@pytest.mark.parametrize("name", UNCOMPILED)
def test_uncompiled_kernels_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    formulation = load(name)

    def answers() -> list[Any]:
        computed = []
        for interface, z in states(formulation, 4):
            pairing = formulation.pair(interface, z)
            computed.append(formulation.residual(interface, pairing, z))
            computed.append(formulation.tangent(interface, pairing, z).toarray())
        return computed

    compiled = answers()
    for module in [module for name, module in sys.modules.items() if name.startswith(KERNELS)]:
        for attribute, value in list(vars(module).items()):
            if hasattr(value, "py_func"):
                monkeypatch.setattr(module, attribute, value.py_func)
    for first, other in zip(compiled, answers(), strict=True):
        assert first == pytest.approx(other, rel=1e-12, abs=1e-12)


@EACH
def test_a_batch_is_a_loop_bitwise(name: str) -> None:
    formulation = load(name)
    interface, z = bent_state(formulation, 3)
    pairing = formulation.pair(interface, z)
    batch = z + 1e-3 * np.random.default_rng(0).normal(size=(3, 2, z.size))
    answers = formulation.residual(interface, pairing, batch)
    assert answers.shape == batch.shape
    for place in np.ndindex(3, 2):
        assert np.array_equal(answers[place], formulation.residual(interface, pairing, batch[place]))


@pytest.mark.parametrize(
    ("make", "options", "named"),
    [
        (contactverif_nts.vts_me, {"n": 0}, "n: found 0; needed a whole number from 1 to 1000"),
        (contactverif_nts.vts_me, {"n": 1.5}, "n: found 1.5"),
        (contactverif_nts.vts_me_lm, {"n": 0}, "n: found 0"),
        (contactverif_nts.nts_lm, {"penalty": 0}, "penalty: found 0"),
        (contactverif_nts.nts_ar, {"area": "old"}, "area: found 'old'"),
        (contactverif_nts.vts_ppt, {"free_end": "open"}, "free_end: found 'open'"),
        (contactverif_nts.nts, {"tau": -1}, "tau: found -1"),
        (contactverif_nts.vts_ppt, {"penalty": 0}, "penalty: found 0"),
        (contactverif_nts.vts_ppt, {"penalty": float("nan")}, "penalty: found nan"),
        (contactverif_nts.vts_ppt, {"threads": 0}, "threads: found 0; needed a whole number from 1 to 1000"),
        (contactverif_mortar.mortar_two_half_pass, {"n": 1}, "n: found 1; needed a whole number from 2 to 1000"),
        (contactverif_mortar.sts, {"penalty": 0.0}, "penalty: found 0.0"),
        (contactverif_mortar.sts, {"area": "slave"}, "area: found 'slave'"),
        (contactverif_mortar.mortar, {"penalty": float("nan")}, "penalty: found nan"),
        (contactverif_mortar.mortar_dual_lm, {"normals": 3}, "normals: found 3"),
        (contactverif_mortar.chen_hisada, {"tau": 1.0}, "tau: found 1.0"),
        (contactverif_mortar.chen_hisada, {"penalty": True}, "penalty: found True"),
    ],
)
def test_options_are_checked(make: Callable[..., Any], options: dict[str, Any], named: str) -> None:
    with pytest.raises(MisuseError, match=named):
        make(**{"penalty": 1.0, **options})
