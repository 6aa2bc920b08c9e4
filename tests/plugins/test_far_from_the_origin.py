"""An exact translation changes no bit of a force, a tangent, a decision or a contact point."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from surfaces import make_on_grid

from contactverif import Interface
from contactverif.contract.arrays import dense
from contactverif.contract.formulation import ContactPoints
from contactverif.run.registry import load_formulation

FORMULATIONS = (
    "nts",
    "nts-ar",
    "nts-ar:area=reference",
    "vts-g:n=3",
    "vts-g:area=reference",
    "vts-me",
    "vts-me:n=3,area=reference",
    "vts-ppt",
    "vts-ppt:n=3",
    "vts-ppt:free_end=cover",
    "vts-ppt:free_end=extend",
    "vts-ppt-basic",
    "vts-ppt-balanced",
    "vts-ppt-balanced:n=3,area=reference",
    "vts-ppt-balanced:free_end=truncate",
    "nts-lm",
    "vts-me-lm",
    "vts-ppt-lm",
    "vts-ppt-lm:transmission=balanced",
    "two-pass/nts",
    "two-pass/nts-ar:area=reference",
    "two-pass/nts-lm",
    "two-pass/mortar",
    "sts",
    "sts:area=reference",
    "chen-hisada",
    "chen-hisada:area=reference",
    "mortar",
    "mortar:area=reference",
    "mortar:normals=averaged",
    "mortar-dual",
    "mortar-dual:normals=averaged,area=reference",
    "mortar-lm",
    "mortar-dual-lm:normals=averaged",
)
KINDS = ("flat", "turned", "tilted", "kinked", "overhanging")
OFFSETS = ((2.0**20, 0.0), (-(2.0**20), 2.0**20), (2.0**10, -(2.0**17)))


def multipliers_of(formulation: Any, interface: Interface, seed: int) -> Any:
    """Return random multipliers, most of which press."""
    n_multipliers = formulation.n_multipliers(interface)
    return np.random.default_rng(seed).uniform(-0.1, 1, n_multipliers)


def answers(formulation: Any, interface: Interface, z: Any) -> tuple[dict[str, Any], bool]:
    """Return all that a formulation says about a state, but for positions, and whether anything is in contact."""
    pairing = formulation.pair(interface, z)
    tangent, points = (
        formulation.tangent(interface, pairing, z).tocoo(),
        formulation.contact_points(interface, pairing, z),
    )
    all_arrays = {f"pairing {name}": array for name, array in pairing.items()}
    all_arrays |= {"residual": formulation.residual(interface, pairing, z)}
    all_arrays |= {"tangent": dense(tangent)}
    all_arrays |= {f"points {each.name}": getattr(points, each.name) for each in fields(ContactPoints)}
    del all_arrays["points position"]
    return all_arrays, bool(points.active.any())


@pytest.mark.parametrize("name", FORMULATIONS)
def test_an_exact_translation_changes_no_bit(name: str) -> None:
    subject = load_formulation(name)
    assert subject.traits.translation_stable
    formulation, in_contact = subject.with_penalty(3.0), 0
    for seed in range(4):
        for kind in KINDS:
            interface, x = make_on_grid(kind, seed, depth=1e-2 if seed % 2 else 1e-6)
            multipliers = multipliers_of(formulation, interface, seed)
            near, active = answers(formulation, interface, np.append(x, multipliers))
            in_contact += active
            for offset in OFFSETS:
                assert np.array_equal((x + offset) - offset, x)
                moved = Interface(interface.nodes + offset, interface.slave, interface.master)
                far, _ = answers(formulation, moved, np.append(x + offset, multipliers))
                for name_of_array, array in near.items():
                    same = array.tobytes() == far[name_of_array].tobytes()
                    assert same, (kind, seed, offset, name_of_array)
    assert in_contact >= 16
