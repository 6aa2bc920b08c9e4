"""Drawings are legible, say what they show, and fit."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from fresh_process import PYTHON
from handmade_report import awkward, flat

from contactverif import Case, Interface, Surface
from contactverif_reports.plot.case_figures import plot_case
from contactverif_reports.plot.geometry import format_number
from contactverif_reports.plot.text import as_text


def make_kinked_case() -> Case:
    interface = Interface.from_chains([[0, 0], [1.5, 0.5], [3, 1], [5, -0.5]], [[5, -0.5], [3, 1], [0, 0]])
    moved = interface.nodes.copy()
    moved[:4, 1] -= 0.01
    return Case(interface, moved.ravel())


def ring(n_slave: int = 7, n_master: int = 5) -> Case:
    def circle(n: int, turn: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        angles = np.arange(n) * 2 * np.pi / n + turn
        return np.column_stack([np.cos(angles), np.sin(angles)])

    slave = np.array([[i, (i + 1) % n_slave] for i in range(n_slave)])
    master = n_slave + np.array([[i, (i - 1) % n_master] for i in range(n_master)])
    nodes = np.vstack([circle(n_slave, 0.0), circle(n_master, 0.1)])
    return Case(Interface(nodes, Surface(slave), Surface(master)), nodes.ravel())


def many(n: int = 60) -> Case:
    return flat([1.0 + i % 3 for i in range(n)], [2.0 + i % 2 for i in range(n - 15)])


def shift(case: Case, by: float) -> Case:
    return Case(case.interface.at(case.interface.nodes + by), case.z + by)


def stretch() -> Case:
    case = flat([2, 2], [4])
    return Case(case.interface.at(case.interface.nodes / [4, 1]), case.z)


CASES = {
    "one": flat([1], [1]),
    "stretched": stretch(),
    "C": flat([2, 2, 4, 4], [3, 3, 3, 3]),
    "turned": flat([2, 1 / 3], [7 / 3], angle=2.5),
    "uneven": flat([1e-5, 12], [6, 6.5]),
    "ratio": flat([1e6, 1, 3], [7, 1e6]),
    "tiny": flat([2, 2], [4], scale=2.0**-40),
    "huge": flat([2, 2], [4], scale=2.0**60, angle=0.3),
    "barely": flat([2, 2], [4], penetration=1e-9),
    "touching": flat([2, 2], [4], penetration=0.0),
    "open": flat([2, 2], [4], penetration=-0.5),
    "overhang": flat([3, 2, 2], [2, 2.5]),
    "offset": shift(flat([2, 2], [4]), 1e8),
    "many": many(),
    "kinked": make_kinked_case(),
    "ring": ring(),
    "fine ring": ring(60, 41),
    "awkward": awkward(),
    "upside down": flat([1], [1], penetration=0.1, angle=np.pi),
}


def test_case_c_as_one_would_draw_it() -> None:
    assert as_text(CASES["C"]).splitlines() == [
        "4 slave on 4 master segments, flat",
        "nodes   0   1   2       3       4",
        "slave   ●─2─●─2─●───4───●───4───●",
        "master  o──3──o──3──o──3──o──3──o",
        "nodes   9     8     7     6     5",
        "penetration 1/8 at every slave node",
        "penalty 10   seed 7",
    ]


def test_lengths_in_units_of_a_power_of_two() -> None:
    assert as_text(CASES["tiny"]).splitlines() == [
        "2 slave on 1 master segment, flat",
        "nodes   0           1           2",
        "slave   ●─────1─────●─────1─────●",
        "master  o───────────2───────────o",
        "nodes   4                       3",
        "lengths, positions and gaps in units of 2^-39",
        "penetration 1/16 at every slave node",
        "penalty 10   seed 7",
    ]


def test_very_uneven_lengths_are_not_to_scale() -> None:
    assert as_text(CASES["uneven"]).splitlines()[1:6] == [
        "nodes   0        1      2",
        "slave   ●──1e-5──●──12──●",
        "master  o───6.5───o──6───o",
        "nodes   5         4      3",
        "not to scale",
    ]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("turned", "flat, rotated by 143.2°"),
        ("touching", "touching at every slave node"),
        ("open", "open by 1/2 at every slave node"),
        ("barely", "penetration 1e-9 at every slave node"),
        ("overhang", "2 beyond it"),
        ("stretched", "lengths in the reference: slave 1/2, 1/2; master 1"),
        ("many", "too many segments"),
        ("many", "60 segments of length 1 to 3"),
        ("kinked", "2    3   0.99     -0.008      6  0     0"),
        ("kinked", "drawn apart"),
        ("awkward", "C′ №1: 2 slave on 3 master segments, not flat"),
    ],
)
def test_says_what_it_shows(name: str, words: str) -> None:
    assert words in as_text(CASES[name])


@pytest.mark.parametrize("width", [60, 72, 120])
@pytest.mark.parametrize("name", CASES)
def test_fits(name: str, width: int) -> None:
    lines = as_text(CASES[name], width).splitlines()
    assert max(map(len, lines)) <= width
    assert len(lines) < 40


def test_nodes_of_small_meshes_all_have_their_numbers() -> None:
    for name in ("one", "C", "uneven", "kinked", "ring"):
        words = as_text(CASES[name]).split()
        assert all(str(node) in words for node in range(CASES[name].interface.n_nodes)), name


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (-0.0, "0"), (3.0, "3"), (-3.0, "-3"), (0.5, "1/2"), (1.5, "3/2"), (1 / 3, "1/3"), (0.1, "0.1"),
        (1e-5, "1e-5"), (1e6, "1e6"), (3 * 2.0**-40, "3·2^-40"), (-(2.0**-60), "-2^-60"), (2.0**1000, "2^1000"),
        (np.pi, "3.142"), (float("nan"), "–"), (5e-324, "5e-324"), (1.7976931348623157e308, "1.798e308"),
        (12345.0, "12345"),
    ],
)  # fmt: skip
def test_numbers_as_by_hand(value: float, text: str) -> None:
    assert format_number(value) == text


def test_numbers_within_roundoff() -> None:
    assert format_number(2 + 4e-16, 1e-15) == "2"
    assert format_number(2 + 4e-16) == "2"  # to four digits
    assert format_number(1e-9, 1e-7) == "1e-9"  # a small number is not nothing


@pytest.mark.parametrize("name", CASES)
def test_figures(name: str, tmp_path: Path) -> None:
    forces = np.zeros((CASES[name].interface.n_nodes, 2))
    forces[0] = [0.0, 1.0]
    picture = tmp_path / "a.png"
    plot_case(CASES[name], picture, title=f"$ {name} \\alpha_ ′ ℓ", forces=forces, exact=forces.ravel() * 1.5)
    assert picture.stat().st_size > 1000


def test_figures_without_forces(tmp_path: Path) -> None:
    for forces in (None, np.zeros((CASES["awkward"].interface.n_nodes, 2))):
        plot_case(CASES["awkward"], tmp_path / "a.svg", forces=forces)
        assert (tmp_path / "a.svg").stat().st_size > 1000


def test_a_figure_says_what_it_shows(tmp_path: Path) -> None:
    plot_case(CASES["barely"], tmp_path / "a.svg", title="nts: patch")
    plot_case(CASES["barely"], tmp_path / "b.svg", title="nts: patch")
    words = (tmp_path / "a.svg").read_text()
    assert "nts: patch" in words
    assert "gap -1e-9, drawn 2e8 times larger" in words
    assert (tmp_path / "b.svg").read_text() == words
    plot_case(CASES["upside down"], tmp_path / "c.svg")
    words = (tmp_path / "c.svg").read_text()
    assert all(text in words for text in ("rotated by 180°, here turned back", "along the slave", "ℓ=1"))


def test_matplotlib_and_xarray_are_imported_late() -> None:
    """Only reading a report needs xarray at once: it is what the reader is made of."""
    code = (
        "import sys, contactverif_reports.plot.text, contactverif_reports.netcdf.write;"
        "print({'matplotlib', 'xarray', 'netCDF4'} & {*sys.modules})"
    )
    modules = subprocess.run([*PYTHON, "-c", code], capture_output=True, text=True, check=True).stdout
    assert modules == "set()\n"
