"""The results of a bench: formulations on cells, each with outcome, errors, counts and the seconds of every repeat.

A cell is one scene on one mesh at one penalty. Rules for the next editor: nothing is solved here, a failed solution is
an entry like any other, and no number is averaged before it is stored.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.foreign_text import LONGEST_FACT, name_line, one_line

RANDOM = "random"  # The scene of the performance profiles.
ERRORS = {
    "forces": "E_F of nodal forces, the larger one of slave and master",
    "displacement": "L2 error of displacements of the interface over the exact ones",
    "pressure": "root mean square error of reported pressures",
}
PARTS = {
    "pair": "the search",
    "residual": "forces",
    "tangent": "the tangent, with the forces if the plugin computes both at once",
    "differences": "forces at states beside, for a tangent that the plugin does not have or that did not help",
    "solve": "linear systems",
    "total": "everything from the first iterate to the last, the harness included",
}
COUNTS = {
    "iterations": "linear systems solved",
    "pairs": "calls of the search",
    "residuals": "states at which forces were computed, those for differences not counted",
    "tangents": "tangents computed by the plugin",
    "differences": "states at which forces were computed for differences",
}


class Outcome(IntEnum):
    """The end of a run. The numbers are those of a file."""

    SOLVED = 0
    NOT_SOLVED = 1
    CRASHED = 2

    @property
    def word(self) -> str:
        """The outcome in words."""
        return self.name.lower().replace("_", " ")


@dataclass(frozen=True, slots=True, order=True)
class Cell:
    """One scene on one mesh at one penalty."""

    scene: str  # The name of a problem, or `RANDOM`
    mesh: int  # The fineness, as the problem counts it; the number of a random scene
    stiffness: float  # The penalty ε̂ in the unit of the problem


@dataclass(frozen=True, slots=True, eq=False)
class BenchResults:
    """All numbers of a bench."""

    formulations: tuple[str, ...]  # The formulations, as on the command line.
    cells: tuple[Cell, ...]
    labels: Mapping[str, str]  # {scene: what is solved, in words}; a file of an earlier version has none
    units: Mapping[str, str]  # {scene: unit of its penalties}; empty where they are ε̂ itself
    segments: IntArray  # (n_cells,) The numbers of slave segments and of the unknowns of the scene.
    unknowns: IntArray
    outcomes: IntArray  # (n_formulations, n_cells) The outcomes, see `Outcome`.
    # (n_formulations, n_cells, n_errors) The errors, in the order of `ERRORS`; NaN where nothing is solved, or nothing
    # is reported.
    errors: FloatArray
    counts: IntArray  # (n_formulations, n_cells, n_counts) The counts, in the order of `COUNTS`.
    # (n_formulations, n_cells, n_parts, n_repeats) The processor's time of each part in each repeat, in the order of
    # `PARTS`; NaN where the plugin crashed.
    seconds: FloatArray
    # (n_formulations, n_cells, n_repeats) The time of each repeat by the wall clock; NaN where the plugin crashed, or
    # an old file has none.
    wall: FloatArray
    yardstick: FloatArray  # (n_cells, n_repeats) The time of a fixed piece of work that was done in the same repeats.
    # {(formulation, number of the cell): how a run ended that gave no solution}.
    remarks: Mapping[tuple[str, int], str]
    not_loaded: Mapping[str, str]  # {formulation: why it did not load}.
    provenance: Mapping[str, str]  # Versions, machine, time and command.

    def __post_init__(self) -> None:
        cleaned = {
            "formulations": tuple(map(name_line, self.formulations)),
            "labels": {name_line(name): one_line(text) for name, text in self.labels.items()},
            "units": {name_line(name): name_line(text) for name, text in self.units.items()},
            "remarks": {(name_line(name), cell): one_line(text) for (name, cell), text in self.remarks.items()},
            "not_loaded": {name_line(name): one_line(text) for name, text in self.not_loaded.items()},
            "provenance": {name_line(name): one_line(text, LONGEST_FACT) for name, text in self.provenance.items()},
        }
        for attribute, value in cleaned.items():
            object.__setattr__(self, attribute, value)

    @property
    def scenes(self) -> tuple[str, ...]:
        """The scenes that have cells, without the random ones, as the cells follow one another."""
        return tuple(dict.fromkeys(cell.scene for cell in self.cells if cell.scene != RANDOM))

    def label(self, scene: str) -> str:
        """Return what a scene is, in words; its name if the file does not say."""
        return self.labels.get(scene, scene)

    def penalty_name(self, scene: str, stiffness: float) -> str:
        """Return a penalty of a scene with its unit."""
        return f"ε̂ = {stiffness:g} {self.units.get(scene, '')}".rstrip()

    @property
    def fastest(self) -> FloatArray:
        """The least time (n_formulations, n_cells, n_parts) of all repeats, in seconds."""
        least: FloatArray = self.seconds.min(axis=-1)
        return least

    def times(self, formulation: str, part: str = "total") -> FloatArray:
        """Return the least time (n_cells,) of a part, in seconds; infinite where there is no solution."""
        row = self.formulations.index(formulation)
        least = self.fastest[row, :, list(PARTS).index(part)]
        return np.where(self.outcomes[row] == Outcome.SOLVED, least, np.inf)

    def errors_of(self, formulation: str, kind: str = "forces") -> FloatArray:
        """Return the errors (n_cells,) of a kind; infinite where there is no solution, NaN where none is reported."""
        row = self.formulations.index(formulation)
        values = self.errors[row, :, list(ERRORS).index(kind)]
        return np.where(self.outcomes[row] == Outcome.SOLVED, values, np.inf)

    def cells_of(self, scene: str, stiffness: float | None = None) -> BoolArray:
        """Return which cells (n_cells,) belong to a scene, if wanted at one penalty alone."""
        selection: BoolArray = np.array(
            [cell.scene == scene and stiffness in (None, cell.stiffness) for cell in self.cells], dtype=np.bool_
        )
        return selection

    def stiffnesses_of(self, scene: str) -> tuple[float, ...]:
        """Return the penalties of a scene, soft ones first."""
        return tuple(sorted({cell.stiffness for cell in self.cells if cell.scene == scene}))

    def uses_differences(self, formulation: str) -> bool:
        """Return whether some solution needed differences of forces instead of a tangent."""
        row = self.formulations.index(formulation)
        return bool(self.counts[row, :, list(COUNTS).index("differences")].any())
