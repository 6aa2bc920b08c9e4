"""Ask every property about every mutant, and keep who catches whom.

`tox -e trust` writes `reports/trust/kills.csv`: a line for each mutant with the property that is meant to
catch it, and for each property the number of the first case that did, empty where none did. The tests ask the property
that is meant to; all others are asked here, with more cases than a test run has time for.
"""

from __future__ import annotations

import csv
from pathlib import Path

from killing import kills, properties
from wrong import MUTANTS, SURVIVORS

FILE = Path(__file__).parents[2] / "reports" / "trust" / "kills.csv"
OTHERS = 20  # Random cases of each property that is not meant to catch the mutant.
SURVIVES = "survives: "


def write() -> None:
    """Judge all mutants and write the table, a line at a time."""
    ids = [question.id for question in properties()]
    with FILE.open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["mutant", "caught by", *ids])
        named = [*((mutant, "") for mutant in MUTANTS), *((mutant, SURVIVES) for mutant in SURVIVORS)]
        for number, (mutant, prefix) in enumerate(named, 1):
            row = kills(mutant, OTHERS)
            table.writerow([prefix + mutant.name, mutant.caught_by, *(row[question] or "" for question in ids)])
            stream.flush()
            print(f"{number} of {len(named)}: {mutant.name}", flush=True)


if __name__ == "__main__":
    write()
