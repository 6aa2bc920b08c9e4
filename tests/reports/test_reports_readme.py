"""The examples of reports/README.md run."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from handmade_report import run_with_kinds, small_run

from contactverif import verify
from contactverif.contract.result import Run
from contactverif_reports.netcdf.write import write

README = Path(__file__).parents[2] / "reports" / "README.md"


def test_examples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    write(verify(["vts-me:n=4", "vts-ppt"], "patch.flat.*", examples=3, seed=1), "report.nc")
    examples = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len(examples) == 2
    for example in examples:
        exec(compile(example, str(README), "exec"), {})
    printed = capsys.readouterr().out
    assert "vts-me_n_4.patch.flat.transmission.witness · error of a nodal force " in printed
    assert "vts-me:n=4 patch.flat.transmission fail" in printed
    assert "slave   ●─" in printed
    assert [*tmp_path.glob("vts-me_n_4.patch.flat.transmission.*svg")]


@pytest.mark.parametrize("make", [small_run, run_with_kinds])
def test_every_group_and_variable_is_in_the_prose(tmp_path: Path, make: Callable[[], Run]) -> None:
    import xarray as xr

    write(make(), tmp_path / "report.nc")
    prose = README.read_text(encoding="utf-8")
    with xr.open_datatree(tmp_path / "report.nc") as tree:
        for group in tree.subtree:
            for name in group.to_dataset().data_vars:
                is_parameter = group.name == "case" and str(name).startswith("parameter_")
                assert f"`{name}`" in prose or is_parameter, f"{group.path}/{name}"
