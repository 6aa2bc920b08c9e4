"""Forge reports, audit them, and count what is seen.

`python evidence/hostile/forged_reports.py COUNT SEED` prints a table by kind. An audit must see each verdict, count or
counterexample that disagrees with the stored numbers. It must see forged numbers that agree with all else as often as
it says; the last line compares the two.
"""

from __future__ import annotations

import random
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from damage import Campaign, Ending, main, run_command
from damaged_reports import import_everything, write_report

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome
from contactverif.contract.result import Row, Run

PROPERTIES = ("balance.force", "patch.flat.transmission", "hard.deep")
WORDS = ("nts", "vts-ppt", *(word for name in PROPERTIES for word in ("-p", name)))
EXAMPLES, N_NUMBERS = 20, 10
ENDINGS = ("seen", "refused", "missed", "traceback")
HARM = frozenset(ENDINGS[2:])
INLINE = ("--isolation", "inline")
_SIGMAS = 4.0  # A share that is further from what is expected is no chance.


def _variable(file: Any, chance: random.Random, names: Sequence[str]) -> Any:
    """Return one of the variables of these names, in any group."""
    groups, every = [file], []
    while groups:
        group = groups.pop()
        groups += group.groups.values()
        every += [group.variables[name] for name in names if name in group.variables]
    variable = chance.choice([each for each in every if each.dtype.kind != "S"])  # One is a table of words.
    variable.set_auto_maskandscale(False)
    return variable


def _change_code(*names: str) -> Callable[[Any, random.Random], None]:
    """Return a forgery of a code or a count: a small number is another one."""

    def change(file: Any, chance: random.Random) -> None:
        variable = _variable(file, chance, names)
        values = np.array(variable[...])
        place = chance.choice([tuple(index) for index in np.argwhere(values >= 0)] or [()])
        values[place] = chance.choice([code for code in range(5) if code != values[place]])
        variable[...] = values

    return change


def _change_real(*names: str) -> Callable[[Any, random.Random], None]:
    """Return a forgery of a real number: it is a little larger."""

    def change(file: Any, chance: random.Random) -> None:
        places: list[tuple[int, ...]] = []
        while not places:  # Some variables hold zeros alone.
            variable = _variable(file, chance, names)
            values = np.array(variable[...])
            places = [*zip(*np.nonzero(np.isfinite(values) & (np.abs(values) < 1e30) & (values != 0)), strict=True)]
        place = chance.choice(places)
        values[place] *= 1 + 1e-9
        variable[...] = values

    return change


def _change_count_of_root(file: Any, chance: random.Random) -> None:
    """Change a count or the verdict of the whole run."""
    name = chance.choice(["n_passed", "n_judged", "n_broken_promises", "promises_kept"])
    value = file.getncattr(name)
    file.setncattr(name, {"true": "false", "false": "true"}[value] if isinstance(value, str) else np.int32(value + 1))


def _change_case(run: Run, chance: random.Random) -> Run:
    """Change one number of the case of a counterexample; all else agrees with it."""
    rows = [row for row in run.rows if _counterexample(row) is not None]
    row = chance.choice(rows)
    name = _counterexample(row)
    assert name is not None
    outcome = getattr(row, name)
    return _with_row(run, row, replace(row, **{name: replace(outcome, case_or_summary=_move(outcome.case, chance))}))


def _counterexample(row: Row) -> str | None:
    return next((name for name in ("shrunk", "first", "witness") if getattr(row, name) is not None), None)


def _move(case: Case, chance: random.Random) -> Case:
    z = np.array(case.z)
    place = chance.randrange(len(z))
    z[place] += 1e-3 * case.diameter
    return replace(case, z=z)


def _change_numbers(count: int) -> Callable[[Run, random.Random], Run]:
    """Return a forgery of the measured values of some outcomes; all else agrees with them."""

    def change(run: Run, chance: random.Random) -> Run:
        places = [(n, case) for n, row in enumerate(run.rows) for case in range(len(row.outcomes))]
        selection = chance.sample(places, count)
        for n, row in enumerate(run.rows):
            outcomes = list(row.outcomes)
            for number in [case for its_row, case in selection if its_row == n]:
                outcomes[number] = _with_other_value(outcomes[number])
            run = _with_row(run, run.rows[n], replace(run.rows[n], outcomes=tuple(outcomes)))
        return run

    return change


def _with_other_value(outcome: Outcome) -> Outcome:
    assert outcome.measurement is not None
    number, *others = outcome.measurement.numbers
    value = number.value * (1 + 1e-12) or 1e-300
    numbers = [replace(number, value=value), *others]
    return replace(outcome, measurement=replace(outcome.measurement, numbers=numbers))


def _with_row(run: Run, row: Row, other: Row) -> Run:
    return replace(run, rows=tuple(other if each is row else each for each in run.rows))


# What disagrees with the numbers beside it, then what agrees with all.
FILES: dict[str, Callable[[Any, random.Random], None]] = {
    "the verdict on a case": _change_code("verdict", "witness_verdict"),
    "the verdict on a row": _change_code("row_verdict"),
    "a promise": _change_code("promise"),
    "a count": _change_code("count", "judged", "planned", "idle", "kind_count"),
    "a count of the run": _change_count_of_root,
    "the closest number": _change_real("closest_value", "closest_tolerance", "contact_share"),
    "a mesh": _change_real("node_x", "node_y", "current_x", "current_y"),
}
RUNS: dict[str, Callable[[Run, random.Random], Run]] = {
    "a counterexample": _change_case,
    "one number": _change_numbers(1),
    f"{N_NUMBERS} numbers": _change_numbers(N_NUMBERS),
}
KINDS = (*FILES, *RUNS)
NUMBERS = {"one number": 1, f"{N_NUMBERS} numbers": N_NUMBERS}


class Forgery(Campaign):
    """A report, and what audits saw of forgeries of it."""

    head, endings, harmful = "forgery", ENDINGS, HARM
    kinds = KINDS

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.report, self.forged = folder / "report.nc", folder / "forged.nc"
        self.chances: list[float] = []  # Of each report with forged numbers, that the audit sees one.
        # Forks find everything imported, and the kernels loaded.
        import_everything()
        write_report(self.forged, PROPERTIES)
        words = ("verify", *WORDS, "--examples", str(EXAMPLES), "--seed", "1", "--jobs", "1", *INLINE)
        ending = run_command([*words, "--out", str(self.report)], seconds=600)
        assert ending.status == 0, ending.errors
        ending = self._audit(self.report)
        assert ending.status == 0, ending.output + ending.errors
        self.chance = {count: float(share) / 100 for count, share in re.findall(r"(\d+): (\d+)%", ending.output)}

    def attack(self, kind: str, chance: random.Random, name: str = "") -> str:
        """Audit a forged report, and return what came of it."""
        from contactverif_reports.netcdf.read import read_run
        from contactverif_reports.netcdf.write import write

        if kind in FILES:
            self.forged.write_bytes(self.report.read_bytes())
            with netCDF4.Dataset(self.forged, "a") as file:
                FILES[kind](file, chance)
        else:
            write(RUNS[kind](read_run(self.report), chance), self.forged)
        if kind in NUMBERS:
            self.chances.append(self.chance[str(NUMBERS[kind])])
        ending = self._audit(self.forged)
        if ending.status not in (0, 1, 2) or "Traceback" in ending.errors:
            print(ending.errors, file=sys.stderr)
            return self.add(kind, "traceback")
        return self.add(kind, ("missed", "seen", "refused")[ending.status])

    def _audit(self, path: Path) -> Ending:
        return run_command(["audit", str(path), *INLINE], seconds=600)

    def n_seen(self) -> int:
        """Return the number of reports with forged numbers in which one was seen."""
        return sum(self.counts[kind]["seen"] for kind in NUMBERS)

    def harm(self) -> int:
        """Count tracebacks, forgeries that no audit may miss, and forged numbers seen not as often as audits say."""
        spread = sqrt(sum(share * (1 - share) for share in self.chances))
        as_often = abs(self.n_seen() - sum(self.chances)) <= _SIGMAS * spread + 0.5  # Up to chance.
        return super().harm() - sum(self.counts[kind]["missed"] for kind in NUMBERS) + (not as_often)

    def text(self) -> str:
        """Return the table in Markdown, and how often forged numbers were seen."""
        often = f"seen in {self.n_seen()} of {len(self.chances)} reports, {sum(self.chances):.1f} expected"
        return f"{super().text()}\n\nforged numbers: {often}"


if __name__ == "__main__":
    main(Forgery, count=200)
