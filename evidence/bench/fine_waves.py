"""Solve wavy half-planes on interfaces of 512 to 2,048 segments, whose rows of cells grow with depth.

`tox -e fine-waves` writes `reports/bench/fine_waves.csv`: the errors of six formulations, their linear systems, the
entries of their tangent, and the seconds of an evaluation over those of VTS-PPT on the same mesh. Nothing is condensed:
each system has all unknowns of both bodies. The largest takes some gigabytes, and all take hours.
"""

import csv
import sys
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from contactverif.mechanics.accuracy import solve_for_accuracy
from contactverif.mechanics.scene import WholeScene
from contactverif.plugins.registry import load_formulation
from contactverif.problems.wavy import pose_wavy
from contactverif.studies.bench_cells import TURNS, evaluate
from contactverif.studies.bench_plan import is_solved, largest_errors, vary
from contactverif_reports.bench_costs import REFERENCE
from contactverif_reports.bench_results import ERRORS, RULE, Cell

sys.path.append(str(Path(__file__).parents[1]))

from origin import keep_commit

FILE = Path(__file__).parents[2] / "reports" / "bench" / "fine_waves.csv"
FORMULATIONS = (REFERENCE, "sts", "nts-ar", "mortar", "chen-hisada", "mortar-lm")
INSTANCES = {512: 3, 1024: 2, 2048: 1}  # {segments: instances}
GROWTH = 0.02  # Deep rows then add less to the error of the forces than the segments do.
HEADS = (
    "formulation",
    "mesh",
    "instance",
    "segments",
    "unknowns",
    "systems",
    *ERRORS,
    "tangent nonzeros",
    f"evaluation over {REFERENCE}",
)


def solve(formulation: str, mesh: int, instance: int) -> tuple[str | int, ...]:
    """Return the line of a formulation on an instance of a mesh; errors are empty where there is no solution."""
    names = dict.fromkeys((REFERENCE, formulation))
    subjects = [subject for subject in map(load_formulation, names) if hasattr(subject, "traits")]
    variation = vary(Cell("wavy", mesh, instance), 0)
    problems = [pose_wavy(mesh, RULE.penalty, subject.traits, variation, GROWTH) for subject in subjects]
    pairs = list(zip(subjects, problems, strict=True))
    seconds = np.min([[evaluate(*pair, timed=True).seconds for pair in pairs] for _ in range(TURNS)], axis=0)
    subject, problem = pairs[-1]
    scene = WholeScene.of_scene(problem.scene)
    solution = solve_for_accuracy(scene, subject, None, problem.step)
    errors = largest_errors(problem, solution) if is_solved(solution) else {}
    plain, z = subject.for_case(problem.first_guess), solution.state.z
    entries = plain.tangent(scene.interface, plain.pair(scene.interface, z), z)
    return (
        formulation,
        mesh,
        instance,
        len(scene.interface.slave),
        scene.n_free,
        solution.n_iterations,
        *(f"{errors[kind]:.3g}" if kind in errors else "" for kind in ERRORS),
        np.count_nonzero(entries) if isinstance(entries, np.ndarray) else entries.nnz,
        f"{seconds[-1] / seconds[0]:.2f}",
    )


def main() -> None:
    """Write the table, a line at a time, each from a process of its own."""
    meshes = [(mesh, number) for mesh, count in INSTANCES.items() for number in range(count)]
    runs = [(name, *mesh) for mesh in meshes for name in FORMULATIONS]
    with FILE.open("w", newline="", encoding="utf-8") as file, get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(HEADS)
        for run in runs:
            table.writerow(pool.apply(solve, run))
            file.flush()
            print(*run, flush=True)
    keep_commit(FILE)


if __name__ == "__main__":
    main()
