"""A scene comes out of a report as it went in: every body, to the last bit, with a unit on every number."""

from pathlib import Path

import netCDF4
import numpy as np
import pytest
from handmade_run import run_with

from contactverif import Case, Placing, Rectangle, load_formulation, two_blocks
from contactverif.mechanics.scene import has_bodies, scene_of
from contactverif.problems.catalogue import SCENES, load_scene
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import case_ids, read_case
from contactverif_reports.netcdf.write import write

ID = "vts-ppt.patch.flat.transmission"


def odd() -> Case:
    """Numbers that no decimal holds, and an approach instead of a pressure."""
    third = 1 / 3
    return two_blocks(
        Rectangle([0, third, 1], [0, np.pi], young=third, poisson=0.1),
        Rectangle([0, 0.7, 1], [-np.e, 0], young=1e9 / 7, poisson=0.3),
        penalty=np.pi,
        approach=1e-3 / 7,
        placing=Placing((np.cos(1.0), np.sin(1.0)), (1e3, -third), 2.0**-40),
    ).case(seed=2**63 - 5)


CASES = {name: load_scene(name).case() for name in SCENES}
CASES |= {"free": load_scene("c:sides=free,lowered=0,degrees=33").case(), "odd": odd()}


@pytest.mark.parametrize("name", CASES)
def test_a_scene_comes_back_to_the_last_bit(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    write(run_with(case, "vts-ppt"), tmp_path / "a.nc")
    write(run_with(case, "vts-ppt"), tmp_path / "b.nc")
    assert case_ids(tmp_path / "a.nc") == [ID]
    assert same_data(tmp_path / "a.nc", tmp_path / "b.nc") == []
    again = read_case(tmp_path / "a.nc", ID).case
    before, after = case.to_arrays(), again.to_arrays()
    assert list(before) == list(after)
    for key, values in before.items():
        assert values.dtype == after[key].dtype or values.dtype.kind == "U"
        assert values.shape == after[key].shape
        assert values.tobytes() == after[key].tobytes() or values.dtype.kind == "U"
    assert has_bodies(again)
    for first, second in zip(scene_of(case).bodies, scene_of(again).bodies, strict=True):
        for key in ("nodes", "cells", "contact", "fixed", "imposed", "load", "axis", "start"):
            assert getattr(first, key).tobytes() == getattr(second, key).tobytes(), key
        assert (first.young, first.poisson, first.rigid) == (second.young, second.poisson, second.rigid)


def test_what_comes_back_is_solved_to_the_same_bits(tmp_path: Path) -> None:
    case = CASES["free"]
    write(run_with(case, "vts-ppt"), tmp_path / "a.nc")
    again = read_case(tmp_path / "a.nc", ID).case
    subject = load_formulation("vts-ppt")
    (first,), (second,) = (solve_scene(each, [subject]).solutions for each in (case, again))
    assert first.z.tobytes() == second.z.tobytes()
    assert first.residuals.tobytes() == second.residuals.tobytes()


@pytest.mark.parametrize("name", ["c", "odd"])
def test_every_number_of_a_scene_has_its_unit(name: str, tmp_path: Path) -> None:
    write(run_with(CASES[name], "vts-ppt"), tmp_path / "a.nc")
    with netCDF4.Dataset(tmp_path / "a.nc") as report:
        variables = report[f"counterexamples/{ID}/case"].variables
        numbers = {key: value for key, value in variables.items() if value.dtype.kind != "S"}  # The others are words.
        units = {key.removeprefix("parameter_"): value.units for key, value in numbers.items()}
    assert "unknown" not in units.values()
    expected = {
        "bodies_nodes": "m",
        "bodies_load": "N",
        "bodies_young": "N m-1",
        "compliance": "m2 N-1",
        "penalty": "N m-2",
    }
    expected |= {"approach": "m"} if name == "odd" else {"pressure": "N m-1"}
    assert expected.items() <= units.items()
