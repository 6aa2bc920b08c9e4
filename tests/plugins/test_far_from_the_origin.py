"""An exact translation changes no bit of a force, a tangent, a decision or a contact point."""

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from every_formulation import FORMULATIONS, draw_multipliers
from surfaces import make_on_grid

from contactverif import ContactPoints, Interface, load_formulation
from contactverif.contract.arrays import dense

KINDS = ("flat", "turned", "tilted", "kinked", "overhanging")
OFFSETS = ((2.0**20, 0.0), (-(2.0**20), 2.0**20), (2.0**10, -(2.0**17)))


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
    assert subject.traits.promises.translation_stable
    formulation, in_contact = subject.with_penalty(3.0), 0
    for seed in range(4):
        for kind in KINDS:
            interface, x = make_on_grid(kind, seed, depth=1e-2 if seed % 2 else 1e-6)
            multipliers = draw_multipliers(formulation, interface, seed)
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
