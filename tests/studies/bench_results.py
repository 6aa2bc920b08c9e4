"""Results of a bench made by hand, for the tests of what is read from them."""

from collections.abc import Mapping, Sequence

import numpy as np

from contactverif_reports.bench_results import COUNTS, ERRORS, VARIANTS, WORK, BenchResults, Cell, Outcome

N_PROCESSES = 3


def make_cells(scene: str = "wavy", meshes: Sequence[int] = (8, 16), n_instances: int = 6) -> tuple[Cell, ...]:
    """Return the cells of a scene, all instances of each mesh."""
    return tuple(Cell(scene, mesh, instance) for mesh in meshes for instance in range(n_instances))


def make_results(
    cells: Sequence[Cell],
    runs: Mapping[str, Mapping[int, tuple[float, float, int]]],
    *,
    noise: float = 0.0,
    targets: Sequence[float] = (1e-2, 1e-3),
) -> BenchResults:
    """Return results of {formulation: {mesh: (seconds of an evaluation, error, linear systems)}}.

    An error of inf has failed. All variants have the same outcome. Each instance and each process has its own factor
    of the seconds, up to 1 ± `noise`; a factorisation takes a millisecond for each unit of the mesh.
    """
    dice = np.random.default_rng(1)
    rows = np.array([[run[cell.mesh] for cell in cells] for run in runs.values()])  # (n_formulations, n_cells, 3)
    shape = len(runs), len(cells)
    seconds, errors, systems = (np.repeat(rows[..., place, None], len(VARIANTS), axis=-1) for place in range(3))
    factors = 1 + noise * dice.uniform(-1, 1, (*shape, N_PROCESSES))
    unsolved = np.isinf(errors)
    meshes = np.array([cell.mesh for cell in cells])
    scenes = dict.fromkeys(cell.scene for cell in cells)
    return BenchResults(
        formulations=tuple(runs),
        cells=tuple(cells),
        labels={scene: f"the scene {scene}" for scene in scenes},
        targets=dict.fromkeys(scenes, tuple(targets)),
        segments=meshes.astype(np.int64),
        unknowns=(4 * meshes).astype(np.int64),
        best_pressure=0.1 / meshes,
        outcomes=np.where(unsolved, int(Outcome.NOT_SOLVED), int(Outcome.SOLVED)),
        errors=np.repeat(np.where(unsolved, np.nan, errors)[..., None], len(ERRORS), axis=-1),
        counts=np.repeat(systems[..., None].astype(np.int64), len(COUNTS), axis=-1),
        work=np.full((*shape, len(WORK)), 100),
        evaluation=seconds[..., :1] * factors,
        factorisation=np.broadcast_to(1e-3 * meshes, shape).copy(),
        remarks={(list(runs)[row], cell, variant): "2-cycle" for row, cell, variant in np.argwhere(unsolved).tolist()},
        not_loaded={"absent": "no such module"},
        provenance={"command": "contactverif bench", "seed": "0"},
    )
