"""The plan of a bench: which cells, how many repeats. Two plans that are equal give equal results but for seconds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from contactverif.contract.errors import MisuseError
from contactverif_reports.bench.results import RANDOM, SCENES, Cell

# {scene: (meshes, penalties from soft to stiff)}. Finer meshes are about 1.4 times finer each.
GRID: dict[str, tuple[tuple[int, ...], tuple[float, ...]]] = {
    "wavy": ((1, 2, 3, 4, 6), (1.0, 30.0, 1e3)),
    "hertz": ((16, 22, 30, 42), (1.0, 10.0, 100.0)),
    "rings": ((1, 2, 4, 6), (1e2, 1e3, 1e4)),
    "kinked": ((1, 2, 4), (1.0, 30.0, 1e3)),
}
N_RANDOM = 24  # Random scenes of a full bench.
QUICK_MESHES, QUICK_RANDOM = 2, 6  # Meshes of each scene, and random scenes, of a quick bench.
MOST_REPEATS = 1000
REPEATS = 7  # Repeats of each solution that are timed.


@dataclass(frozen=True, slots=True)
class BenchPlan:
    """The cells of a bench, how often each is repeated, and the seed of its random scenes.

    Attributes
    ----------
    cells : tuple[Cell, ...]
        The cells, in the order in which they are run.
    repeats : int
        The number of timed repeats.
    seed : int
        The seed of the random scenes.
    """

    cells: tuple[Cell, ...]
    repeats: int = REPEATS
    seed: int = 0


def make_plan(
    scenes: Sequence[str] = (), *, quick: bool = False, repeats: int = REPEATS, n_random: int | None = None
) -> BenchPlan:
    """Return the plan of a bench.

    Parameters
    ----------
    scenes : Sequence[str]
        The scenes; all by default.
    quick : bool
        True takes the coarsest meshes, the penalty in the middle and few random scenes.
    repeats : int
        The number of timed repeats.
    n_random : int | None
        The number of random scenes.

    Raises
    ------
    MisuseError
        If there is no such scene, or a number is too small or too large.
    """
    usual = QUICK_RANDOM if quick else N_RANDOM
    count = usual if n_random is None else n_random
    _check_numbers(scenes, repeats, count)
    selection = tuple(scenes) or tuple(SCENES)
    cells: list[Cell] = []
    for scene, (meshes, penalties) in GRID.items():
        if scene in selection:
            grid = (meshes[:QUICK_MESHES], penalties[1:2]) if quick else (meshes, penalties)
            cells += [Cell(scene, mesh, stiffness) for stiffness, mesh in product(grid[1], grid[0])]
    cells += [Cell(RANDOM, number, 1.0) for number in range(count * (RANDOM in selection))]
    if not cells:
        raise MisuseError("--random", "0 random scenes and no other", "at least one scene")
    return BenchPlan(tuple(cells), repeats)


def _check_numbers(scenes: Sequence[str], repeats: int, count: int) -> None:
    """Refuse scenes that there are not, and numbers that are too small."""
    for scene in scenes:
        if scene not in SCENES:
            raise MisuseError("--scene", repr(scene), f"one of {', '.join(SCENES)}")
    if not 1 <= repeats <= MOST_REPEATS:
        raise MisuseError("--repeats", f"{repeats}", f"at least 1, at most {MOST_REPEATS}")
    if count < 0:
        raise MisuseError("--random", f"{count}", "at least 0")
