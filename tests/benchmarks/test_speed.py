"""Benchmarks: each call is timed beside a reference, or made once without a clock if `--benchmark-enable` is missing.

A race is named by its group and its name, as `reports/bench/benchmarks.json` keeps it.
"""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from matplotlib.figure import Figure
from plain_skfem import TwoBlocks, exact_pressure
from plain_skfem import solve as plain
from planned_cases import draw_cases
from scipy import sparse
from scipy.sparse.linalg import splu
from subjects import load_property, load_subject, plane_names
from zoo.at_points import LogBarrier

import contactverif
from contactverif import Case, Interface, Property, Rectangle, Run, Scene, Subject, Verdict, evaluate_both, judge_case
from contactverif.mechanics.bulk import assemble_stiffness, condense, forget_condensed
from contactverif.mechanics.scene import forget_bodies
from contactverif.plugins.registry import property_ids
from contactverif.problems.uniform_stress import stress_error
from contactverif.sampling.draw import Sampling
from contactverif_reports.html.report_page import report_page
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.write import write
from contactverif_reports.plot.case_figures import make_case_figure
from contactverif_reports.plot.text import as_text

Call = Callable[[], Any]
Racers = tuple[Call, Call, str]  # A call, its reference, and what the reference is in words.
N_SLAVE, N_DRAWN, N_JUDGED, N_MESHES, N_REPORTED = 300, 25, 4, 10, 200
FORMULATIONS = ("vts-ppt", "mortar-lm", "nts")  # The first to which the property applies is judged.
ROUNDOFF = 1e-11  # The stress error of the plain script and of ours.


def state_of(name: str) -> tuple[Any, Interface, Any]:
    """Return the plugin, as it answers without the checks of the harness, an interface and z with multipliers.

    A wavy slave is pressed into a wavy master of 1.3 times as many segments, all in contact.
    """
    upper, lower = np.linspace(0, N_SLAVE, N_SLAVE + 1), np.linspace(-0.3, N_SLAVE + 0.4, int(1.3 * N_SLAVE) + 1)
    slave = np.column_stack([upper, -0.2 - 0.05 * np.cos(upper) ** 2])
    interface = Interface.from_chains(slave, np.column_stack([lower, 0.05 * np.sin(lower)])[::-1])
    formulation = load_subject(name).with_penalty(10.0)
    multipliers = np.ones(formulation.n_multipliers(interface))
    return formulation.plugin, interface, np.concatenate([interface.nodes.ravel(), multipliers])


def search(name: str) -> Racers:
    plugin, interface, z = state_of(name)
    numbers = np.random.default_rng(1).permutation(interface.nodes.ravel())
    return lambda: plugin.pair(interface, z), lambda: np.sort(numbers), "numpy sorts all coordinates"


def forces_and_tangent(name: str) -> Racers:
    """Race with a copy of as many bytes as the tangent has, the least that any kernel could do."""
    plugin, interface, z = state_of(name)
    pairing = plugin.pair(interface, z)
    matrix = sparse.csr_array(evaluate_both(plugin, interface, pairing, z)[1])
    parts = (matrix.data, matrix.indices, matrix.indptr)
    assert matrix.nnz

    def copy() -> None:
        for part in parts:
            part.copy()

    return lambda: evaluate_both(plugin, interface, pairing, z), copy, "numpy copies the tangent"


def condensation(n_cells: str) -> Racers:
    line = np.arange(int(n_cells) + 1.0)
    body = contactverif.block(Rectangle(line, line), contact="bottom", approach=0.0)
    free = np.flatnonzero(~body.fixed.ravel())
    matrix = assemble_stiffness(body)[0][free][:, free]

    def call() -> None:
        forget_condensed()
        condense(body)

    if hasattr(matrix, "tocsc"):
        compressed = matrix.tocsc()
        return call, lambda: splu(compressed), "scipy factorises the stiffness"
    return call, lambda: np.linalg.cholesky(matrix), "numpy factorises the stiffness"


def random_blocks() -> list[TwoBlocks]:
    """Return random pairs of blocks of equal width, integer nodes, 1 to 6 segments a side and 1 to 3 layers."""
    random = np.random.default_rng(1)
    pairs = []
    for _ in range(N_MESHES):
        width = int(random.integers(6, 25))
        inner = [random.choice(np.arange(1, width), int(random.integers(0, 6)), replace=False) for _ in range(2)]
        slave_x, master_x = (np.sort(np.concatenate([[0, width], nodes])).astype(float) for nodes in inner)
        layers = [np.concatenate([[0], np.cumsum(random.integers(1, 5, random.integers(1, 4)))]) for _ in range(2)]
        slave_y, master_y = layers[0].astype(float), (layers[1] - layers[1][-1]).astype(float)
        pairs.append(TwoBlocks(slave_x, slave_y, master_x, master_y, (1.0, 3.0), (0.3, 0.2), 0.1, 10.0))
    return pairs


def make_scene(blocks: TwoBlocks) -> Scene:
    return contactverif.two_blocks(
        Rectangle(blocks.slave_x, blocks.slave_y, young=blocks.young[0], poisson=blocks.poisson[0]),
        Rectangle(blocks.master_x, blocks.master_y, young=blocks.young[1], poisson=blocks.poisson[1]),
        penalty=blocks.penalty,
        approach=blocks.approach,
    )


def solve_as_scene(blocks: TwoBlocks, subject: Subject) -> float:
    """Do what the plain script does: mesh, bodies, solution, and the comparison of the stresses with the exact ones."""
    scene = make_scene(blocks)
    trace = contactverif.solve(scene, subject.with_penalty(blocks.penalty))
    return stress_error(scene, scene.stresses(trace.solution), exact_pressure(blocks))


def patch_tests(name: str) -> Racers:
    every, subject, question = random_blocks(), load_subject("vts-ppt"), load_property("patch.flat.solve")
    assert max(solve_as_scene(blocks, subject) for blocks in every) < ROUNDOFF
    assert max(map(plain, every)) < ROUNDOFF

    def judge_all() -> None:
        forget_bodies()
        for blocks in every:
            judge_case(question, make_scene(blocks).case(), subject)

    def solve_all() -> None:
        for blocks in every:
            solve_as_scene(blocks, subject)

    call = judge_all if "judged" in name else solve_all
    return call, lambda: [plain(blocks) for blocks in every], "a plain scikit-fem script"


def work_as_newton_does() -> None:
    """Take small steps of numpy, and solve a linear system."""
    values, matrix = np.linspace(1.0, 2.0, 64), np.eye(64) + 1 / np.add.outer(np.arange(1.0, 65.0), np.arange(64.0))
    for _ in range(100):
        values = np.sqrt(values * values[::-1])
    np.linalg.solve(matrix, values)


def cases_of(question: Property, count: int) -> tuple[Call, tuple[Case, ...] | Any, str]:
    """Return a call that draws, the source, and the seed."""
    sampling = Sampling(count, 1)
    source, key = sampling.source(question), sampling.key(question)
    return lambda: draw_cases(source, seed=key, examples=count), source, key


def one_case(property_id: str) -> Racers:
    """Judge the last random case, since the first are the simplest, or the first of a list."""
    question = load_property(property_id)
    every = *map(load_subject, FORMULATIONS), Subject("barrier", LogBarrier)
    subjects = [each for each in every if not question.refusal_of(each)]
    subject = next(each for each in subjects if question.needs <= each.provides)
    draw, source, _ = cases_of(question, N_JUDGED)
    case = draw().cases[0 if isinstance(source, tuple) else -1]
    assert judge_case(question, case, subject).verdict in (Verdict.PASS, Verdict.FAIL)
    words = "the yardstick: small steps of numpy, and a linear system"
    return lambda: judge_case(question, case, subject), work_as_newton_does, words


def drawn_cases(property_id: str) -> Racers:
    draw, _, key = cases_of(load_property(property_id), N_DRAWN)
    lists: Any = st.lists(st.integers(1, 8), min_size=1, max_size=12)
    return draw, lambda: draw_cases(lists, seed=key, examples=N_DRAWN), "hypothesis draws lists of integers"


def pictures(name: str) -> Racers:
    def draw(figure: Figure) -> None:
        figure.savefig(BytesIO(), format="png")

    def draw_nothing() -> None:
        figure = Figure(figsize=(6, 4))
        figure.add_subplot()
        draw(figure)

    case = contactverif.named_case("c")
    calls: dict[str, Call] = {
        "test_picture_of_a_case": lambda: draw(make_case_figure(case, title="", forces=None, exact=None)),
        "test_text_of_a_case": lambda: as_text(case),
    }
    return calls[name], draw_nothing, "matplotlib draws empty axes"


def numbers_of(result: Run) -> np.ndarray:
    """Return value, tolerance, verdict and seconds of all outcomes, (n_outcomes, 4)."""
    rows = []
    for row in result.rows:
        for outcome in row.outcomes:
            assert outcome.measurement is not None
            number = outcome.measurement.numbers[0]
            rows.append((number.value, number.tolerance, outcome.verdict, outcome.seconds))
    return np.array(rows)


def reports(name: str, folder: Path) -> Racers:
    questions = [load_property(each) for each in ("balance.force", "patch.flat.transmission", "units")]
    result = contactverif.verify([load_subject("vts-ppt")], questions, examples=N_REPORTED, seed=1)
    report, archive, numbers = folder / "a.nc", folder / "a.npz", numbers_of(result)
    write(result, report)
    np.savez_compressed(archive, numbers)
    if name == "test_reading":
        return lambda: read_run(report), lambda: np.load(archive)["arr_0"], "numpy reads one compressed array"
    calls: dict[str, Call] = {
        "test_writing": lambda: write(result, report),
        "test_page": lambda: report_page(result, report),
    }
    return calls[name], lambda: np.savez_compressed(archive, numbers), "numpy writes one compressed array"


# {group: (what makes the racers of a name, the names)}
GROUPS: dict[str, tuple[Callable[..., Racers], tuple[str, ...]]] = {
    f"search, {N_SLAVE} slave segments": (search, (*plane_names(), "two-pass/nts-ar")),
    f"forces and tangent, {N_SLAVE} slave segments": (forces_and_tangent, (*plane_names(), "two-pass/nts-ar")),
    "condensation of a square block, cells a side": (condensation, ("8", "40")),
    "random patch tests": (
        patch_tests,
        ("test_blocks_solved_and_compared_with_the_exact_stress", "test_blocks_judged_by_all_quantities"),
    ),
    "one case of a property": (one_case, tuple(property_ids())),
    f"{N_DRAWN} random cases drawn": (
        drawn_cases,
        ("patch.flat.transmission", "tangent.directional", "patch.flat.solve"),
    ),
    "a case as a picture": (pictures, ("test_picture_of_a_case", "test_text_of_a_case")),
    f"report of {3 * N_REPORTED} cases": (reports, ("test_writing", "test_reading", "test_page")),
}


RACES = [(group, name) for group, (_, names) in GROUPS.items() for name in names]


@pytest.mark.parametrize(("group", "name"), RACES)
def test_a_call_beside_its_reference(
    race: Callable[[str, str, Racers], None], tmp_path: Path, group: str, name: str
) -> None:
    make, _ = GROUPS[group]
    race(group, name, make(name, tmp_path) if make is reports else make(name))
