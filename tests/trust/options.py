"""Ask every property of every built-in formulation with every option, and write down who is accused.

`tox -e trust` writes `reports/trust/options.csv`, a line for each formulation with its options. An accusation is
what makes `contactverif verify` fail: a promise that is broken, a statement to fail that is not true, a crash, or a
breach of the contract. Where too few cases could be judged, the property stands in a column of its own. Two options at
a time are asked without the properties in `SLOW`, which solve many scenes each.
"""

import sys
from functools import cache

from option_names import all_variants, is_pair
from tables import fill

from contactverif import Property, Row, Verdict, load_formulation, load_properties
from contactverif.contract.subject import Subject
from contactverif.run.run import run

FILE = "options.csv"
SEED, EXAMPLES, EXAMPLES_SOLVED = 1, 12, 4
HEADS = ("formulation", "asked", "cases", "undecided", "accusations", "accused", "not judged")
SLOW = ("accuracy.hertz", "accuracy.wavy", "accuracy.wavy-curved", "patch.curved", "hard.touch", "tangent.long")


@cache
def questions() -> tuple[Property, ...]:
    """Return all properties."""
    return tuple(question for question in load_properties() if isinstance(question, Property))


def cells(name: str) -> list[str]:
    """Return the cells of a formulation: counts of properties, cases, undecided cases and accusations; texts."""
    subject = load_formulation(name)
    assert isinstance(subject, Subject), subject
    apt = [question for question in questions() if not (is_pair(name) and question.id in SLOW)]
    rows = []
    for solved, examples in ((False, EXAMPLES), (True, EXAMPLES_SOLVED)):
        of_kind = [question for question in apt if question.bodies == solved]
        rows += run([subject], of_kind, examples=examples, seed=SEED, shrink="none").rows
    rows = [row for row in rows if row.verdict is not Verdict.NOT_APPLICABLE]
    accused = [f"{row.property_id}: {row.unexpected}: {row.reason}" for row in rows if is_accusation(row)]
    open_rows = [f"{row.property_id}: {row.reason}" for row in rows if row.verdict is Verdict.NOT_JUDGED]
    numbers = len(rows), sum(len(row.outcomes) for row in rows), sum(row.undecided for row in rows), len(accused)
    return [*map(str, numbers), "; ".join(accused), "; ".join(open_rows)]


def is_accusation(row: Row) -> bool:
    """Return whether a row accuses the formulation; too few cases that could be judged are no accusation."""
    return bool(row.unexpected) and row.verdict is not Verdict.NOT_JUDGED


if __name__ == "__main__":
    keys = sorted(all_variants(2), key=is_pair)
    fill(FILE, HEADS, keys, cells, processes=int(sys.argv[1]) if len(sys.argv) > 1 else 1)
