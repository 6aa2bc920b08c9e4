"""A report written and read beside numpy's own archive of the same numbers."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from racing import Race
from subjects import load_property, load_subject

from contactverif import Run, verify
from contactverif_reports.html.report_page import report_page
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.write import write

N_EXAMPLES = 200


@pytest.fixture(scope="module")
def result() -> Run:
    questions = [load_property(name) for name in ("balance.force", "patch.flat.transmission", "units")]
    return verify([load_subject("vts-ppt")], questions, examples=N_EXAMPLES, seed=1)


def numbers_of(result: Run) -> np.ndarray:
    """Return value, tolerance, verdict and seconds of all outcomes, (n_outcomes, 4)."""
    rows = []
    for row in result.rows:
        for outcome in row.outcomes:
            measurement = outcome.measurement
            assert measurement is not None
            pair = next(iter(measurement.values.values())), next(iter(measurement.tolerances.values()))
            rows.append((*pair, outcome.verdict, outcome.seconds))
    return np.array(rows)


def test_writing(race: Race, benchmark: Any, result: Run, tmp_path: Path) -> None:
    benchmark.group = f"report of {3 * N_EXAMPLES} cases"
    numbers = numbers_of(result)
    race(
        lambda: write(result, tmp_path / "a.nc"),
        lambda: np.savez_compressed(tmp_path / "a.npz", numbers),
        "numpy writes one compressed array",
    )


def test_reading(race: Race, benchmark: Any, result: Run, tmp_path: Path) -> None:
    benchmark.group = f"report of {3 * N_EXAMPLES} cases"
    write(result, tmp_path / "a.nc")
    np.savez_compressed(tmp_path / "a.npz", numbers_of(result))
    race(
        lambda: read_run(tmp_path / "a.nc"),
        lambda: np.load(tmp_path / "a.npz")["arr_0"],
        "numpy reads one compressed array",
    )


def test_page(race: Race, benchmark: Any, result: Run, tmp_path: Path) -> None:
    benchmark.group = f"report of {3 * N_EXAMPLES} cases"
    numbers = numbers_of(result)
    race(
        lambda: report_page(result, tmp_path / "a.nc"),
        lambda: np.savez_compressed(tmp_path / "a.npz", numbers),
        "numpy writes one compressed array",
    )
