"""A case outlives its maker bit by bit, and its scales are those of the tolerances."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from subjects import same_case

from contactverif import Case, Interface, MisuseError, Surface

PAIR = Interface.from_chains([[0, 0], [1, 0], [4, 0]], [[4, 0], [-2, 0]])
Z = PAIR.nodes.reshape(-1) + np.array([0, -0.5] * 3 + [0, 0] * 2)


def odd_case() -> Case:
    """Numbers that a careless round trip would change."""
    awkward = Z.copy()
    awkward[:4] = -0.0, 5e-324, 0.1 + 0.2, np.nextafter(1.0, 2.0)
    parameters: dict[str, Any] = {"gap": 0.1, "directions": [[1.0, 1e-300], [-0.0, 3]], "empty": [], "nan": np.nan}
    return Case(PAIR, awkward, 1 / 3, parameters, 2**63 - 1, "C′", kind="odd")


def case_of_rings() -> Case:
    """Several chains, open and closed, numbered as they come."""
    ring = np.array([[0.0, 0], [1, 0], [0, 1]])
    nodes = np.vstack([ring, ring + 5, 3 * ring])
    surfaces = Surface([[4, 5], [0, 1], [1, 2], [2, 0], [3, 4]]), Surface([[6, 8], [8, 7], [7, 6]])
    return Case(Interface(nodes, *surfaces), nodes.reshape(-1))


@pytest.mark.parametrize("case", [odd_case(), case_of_rings()])
def test_round_trip_through_a_file(case: Case, tmp_path: Path) -> None:
    np.savez(tmp_path / "case.npz", **case.to_arrays())  # type: ignore[arg-type]
    with np.load(tmp_path / "case.npz") as arrays:
        again = Case.from_arrays(arrays)
    assert same_case(case, again)
    assert np.array_equal(again.interface.slave.chain_order, case.interface.slave.chain_order)
    assert (again.name, again.seed, again.penalty, again.kind) == (case.name, case.seed, case.penalty, case.kind)


def test_scales() -> None:
    case = Case(PAIR, Z, parameters={"gap": np.array(-0.5)})
    assert case.positions.shape == (5, 2)
    assert case.positions[1].tolist() == [1, -0.5]
    assert case.largest_coordinate == 4
    assert case.shortest_segment == 1
    assert case.slave_length == 4
    assert case.diameter == np.hypot(6, 0.5)
    assert case.n_segments == 3
    assert case.parameter("gap") == -0.5


def test_the_largest_coordinate_is_of_state_and_reference() -> None:
    assert Case(PAIR, Z - 100).largest_coordinate == 102
    assert Case(PAIR.at(PAIR.nodes - 100), Z).largest_coordinate == 102


def test_a_case_is_a_read_only_copy() -> None:
    z, directions = Z.copy(), np.ones(3)
    case = Case(PAIR, z, parameters={"directions": directions})
    z[:], directions[:] = 9, 9
    assert np.array_equal(case.z, Z)
    assert case.parameters["directions"].tolist() == [1, 1, 1]
    for array in (case.z, case.positions, case.parameters["directions"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


NO_PENALTIES = 0, -1.0, np.nan, np.inf, "10", None, [1.0, 2.0]
NO_SEEDS = -1, 0.5, 2**63, 2**70


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"z": Z[:-1]}, "z: found shape (9,); needed (10,): n_nodes × dim, flat"),
        ({"z": Z.reshape(5, 2)}, "z: found shape (5, 2); needed (10,)"),
        ({"z": np.where(np.arange(10) == 3, np.nan, Z)}, "z: found NaN or infinity; needed finite positions"),
        ({"z": np.where(np.arange(10) == 3, np.inf, Z)}, "z: found NaN or infinity"),
        ({"z": Z * 1j}, "z: found dtype complex128; needed real numbers"),
        ({"z": ["a"] * 10}, "z: found dtype <U1; needed real numbers"),
        *(({"penalty": each}, f"penalty: found {each!r}; needed a finite number > 0") for each in NO_PENALTIES),
        *(({"seed": each}, f"seed: found {each}; needed an integer from 0 to 2^63 − 1") for each in NO_SEEDS),
    ],
)
def test_wrong_cases(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(MisuseError, match=re.escape(message)):
        Case(**({"interface": PAIR, "z": Z} | changed))
