"""Find how small the counterexample of each mutant is: its segments, and the bits of its coordinates.

`python tests/trust/smallest_cases.py` writes `reports/trust/smallest_cases.csv`, a line at a time, and goes on where it
was stopped. A run judges a mutant by the property that is meant to catch it and shrinks what failed. The table holds,
for each seed, slave segments, master segments and bits, as "1 2 3". Bits are those of the coordinate that needs most,
from its first to its last one.

`smallest_cases_before.csv` is what this script wrote at commit ec60901, before cases were drawn without hypothesis'
engine, for mutants that need more than a segment a side today. Mutants of properties with a finite list of cases are
left out, since nothing in a list is shrunk.
"""

import sys
from math import frexp

import numpy as np
from subjects import load_property
from tables import fill
from wrong import MUTANTS

from contactverif import Case, Subject
from contactverif.run.run import run

FILE, BEFORE = "smallest_cases.csv", "smallest_cases_before.csv"
SEEDS = (0,)
EXAMPLES = 100
PRECISION = 53  # The bits of a float.


def bits(number: float) -> int:
    """Return the number of bits of a float from the first to the last that is not 0."""
    digits = int(frexp(abs(number))[0] * 2**PRECISION)
    return len(f"{digits:b}".rstrip("0"))


def size(case: Case) -> str:
    """Return slave segments, master segments and bits of a case."""
    interface = case.interface
    coordinates = np.concatenate([interface.nodes.ravel(), case.positions.ravel()])
    return f"{len(interface.slave)} {len(interface.master)} {max(map(bits, coordinates.tolist()))}"


def cells(name: str) -> list[str]:
    """Return the property that is meant to catch a mutant, and the size of its smallest case with each seed."""
    (mutant,) = (mutant for mutant in MUTANTS if mutant.name == name)
    subject, question = Subject(mutant.name, mutant.make), load_property(mutant.caught_by)
    sizes = []
    for seed in SEEDS:
        (row,) = run([subject], [question], examples=EXAMPLES, seed=seed, shrink="all").rows
        sizes.append("" if row.shrunk is None else size(row.shrunk.case))
    return [mutant.caught_by, *sizes]


def names() -> list[str]:
    """Return the mutants of properties with random cases, those that solve bodies last."""
    questions = {name: load_property(name) for name in {mutant.caught_by for mutant in MUTANTS}}
    mutants = [mutant for mutant in MUTANTS if not isinstance(questions[mutant.caught_by].cases(None), tuple)]
    return [mutant.name for mutant in sorted(mutants, key=lambda mutant: questions[mutant.caught_by].bodies)]


if __name__ == "__main__":
    heads = ["mutant", "caught by", *(f"seed {seed}" for seed in SEEDS)]
    fill(FILE, heads, names(), cells, processes=int(sys.argv[1]) if len(sys.argv) > 1 else 1)
