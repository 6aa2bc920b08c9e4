"""The results of a bench: three numbers of each formulation beside its errors, never their sum.

They are the seconds of one evaluation, what a solution takes (linear systems, nonzeros), and the seconds of one
factorisation. The harness takes part in none of them. A cell is one instance of one scene on one mesh; each is solved
in all `VARIANTS`. Rules for the next editor: nothing is solved here, a failed solution is an entry like any other, and
no number is averaged before it is stored.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.errors import LONGEST_FACT, name_line, one_line

ERRORS = {
    "forces": "E_F of nodal forces, the larger one of slave and master",
    "displacement": "L2 error of displacements of the interface over the exact ones",
    "pressure": "root mean square error of reported pressures",
}
COUNTS = {
    "iterations": "linear systems solved",
    "pairs": "calls of the search",
    "residuals": "states at which forces were computed, those for differences not counted",
    "tangents": "tangents computed by the plugin",
    "differences": "states at which forces were computed for differences",
}
WORK = {
    "calls": "methods of formulations that run in one evaluation, also those that a formulation calls itself",
    "tangent_nonzeros": "entries of the tangent at the solution",
    "factor_nonzeros": "entries of the LU factors of the whole system there: all bodies, contact, multipliers",
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


@dataclass(frozen=True, slots=True)
class Variant:
    """The penalty and the start of a solution."""

    penalty: float  # ε̂ in E/h
    start: str  # "near", "deep" or "deepest", as the problem declares them

    @property
    def label(self) -> str:
        """The variant in words."""
        return f"{self.penalty:g} E/h from {self.start}"


RULE = Variant(10.0, "near")  # The penalty that is fixed beforehand.
DEEP = Variant(10.0, "deep")
DEEPEST = Variant(10.0, "deepest")
VARIANTS = (RULE, DEEP, DEEPEST, Variant(1.0, "near"), Variant(100.0, "near"))
BEST = tuple(number for number, variant in enumerate(VARIANTS) if variant.start == RULE.start)  # The best afterwards.


@dataclass(frozen=True, slots=True, order=True)
class Cell:
    """One instance of one scene on one mesh."""

    scene: str  # The name of a problem
    mesh: int  # The fineness, as the problem counts it
    instance: int  # The number of the variation, the same on all meshes


@dataclass(frozen=True, slots=True, eq=False)
class BenchResults:
    """All numbers of a bench."""

    formulations: tuple[str, ...]  # The formulations, as on the command line.
    cells: tuple[Cell, ...]
    labels: Mapping[str, str]  # {scene: what is solved, in words}
    targets: Mapping[str, tuple[float, ...]]  # {scene: errors that cost is measured at, from large to small}
    segments: IntArray  # (n_cells,) The numbers of slave segments and of free unknowns of all bodies.
    unknowns: IntArray
    best_pressure: FloatArray  # (n_cells,) The error of the best continuous linear pressure on the slave's mesh.
    outcomes: IntArray  # (n_formulations, n_cells, n_variants) The outcomes, see `Outcome`.
    # (n_formulations, n_cells, n_variants, n_errors) The errors, in the order of `ERRORS`; NaN where nothing is solved,
    # or nothing is reported.
    errors: FloatArray
    counts: IntArray  # (n_formulations, n_cells, n_variants, n_counts) The counts, in the order of `COUNTS`.
    work: IntArray  # (n_formulations, n_cells, n_work) `WORK` of the variant `RULE`; entries are 0 without a solution.
    # (n_formulations, n_cells, n_processes) The least seconds of one evaluation (pair, residual and tangent, or
    # differences) in each process of the plugin, by the clock there; NaN where it crashed.
    evaluation: FloatArray
    factorisation: FloatArray  # (n_formulations, n_cells) The least seconds of one factorisation; NaN without one.
    remarks: Mapping[tuple[str, int, int], str]  # {(formulation, cell, variant): how a run ended without a solution}
    not_loaded: Mapping[str, str]  # {formulation or problem: why it did not load, or failed to be posed}.
    provenance: Mapping[str, str]  # Versions, machine, time and command.

    def __post_init__(self) -> None:
        cleaned = {
            "formulations": tuple(map(name_line, self.formulations)),
            "labels": {name_line(name): one_line(text) for name, text in self.labels.items()},
            "remarks": {(name_line(name), *run): one_line(text) for (name, *run), text in self.remarks.items()},
            "not_loaded": {name_line(name): one_line(text) for name, text in self.not_loaded.items()},
            "provenance": {name_line(name): one_line(text, LONGEST_FACT) for name, text in self.provenance.items()},
        }
        for attribute, value in cleaned.items():
            object.__setattr__(self, attribute, value)

    @property
    def scenes(self) -> tuple[str, ...]:
        """The scenes, as the cells follow one another."""
        return tuple(dict.fromkeys(cell.scene for cell in self.cells))

    @property
    def settings(self) -> str:
        """The numbers of instances and processes, in words."""
        n_instances, n_processes = len({cell.instance for cell in self.cells}), self.evaluation.shape[-1]
        return f"{n_instances} instances of each mesh, {n_processes} processes of each formulation"

    def label(self, scene: str) -> str:
        """Return what a scene is, in words; its name if the file does not say."""
        return self.labels.get(scene, scene)

    def meshes_of(self, scene: str) -> tuple[int, ...]:
        """Return the meshes of a scene, coarse ones first."""
        return tuple(sorted({cell.mesh for cell in self.cells if cell.scene == scene}))

    def ladders(self, scene: str) -> IntArray:
        """Return the numbers of the cells (n_instances, n_meshes) of a scene, coarse meshes first."""
        cells = sorted((cell, number) for number, cell in enumerate(self.cells) if cell.scene == scene)
        numbers = np.array([number for _, number in cells], np.int64)
        return numbers.reshape(len(self.meshes_of(scene)), -1).T

    def errors_of(self, formulation: str, kind: str = "forces") -> FloatArray:
        """Return the errors (n_cells, n_variants); infinite where there is no solution, NaN where none is reported."""
        row = self.formulations.index(formulation)
        values = self.errors[row, :, :, list(ERRORS).index(kind)]
        return np.where(self.outcomes[row] == Outcome.SOLVED, values, np.inf)

    def counts_of(self, formulation: str, kind: str) -> IntArray:
        """Return a count (n_cells, n_variants)."""
        counts: IntArray = self.counts[self.formulations.index(formulation), :, :, list(COUNTS).index(kind)]
        return counts

    def failures(self, formulation: str, scene: str) -> BoolArray:
        """Return which runs (n_cells of the scene, n_variants) gave no solution."""
        failed = self.outcomes[self.formulations.index(formulation)] != Outcome.SOLVED
        selection: BoolArray = failed[self.ladders(scene).reshape(-1)]
        return selection

    def uses_differences(self, formulation: str, scene: str) -> bool:
        """Return whether some solution of a scene at the rule's penalty needed differences instead of a tangent."""
        return bool(self.counts_of(formulation, "differences")[self.ladders(scene), VARIANTS.index(RULE)].any())
