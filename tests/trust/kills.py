"""Ask every property about every mutant, and keep who catches whom.

`tox -e trust` writes `reports/trust/kills.csv`: a line for each mutant with the property that is meant to
catch it, and for each property the number of the first case that did, empty where none did. The tests ask the property
that is meant to; the others are asked here, with more cases than a test run has time for.

The slow properties are asked where it matters, about mutants that at most one other property catches. Elsewhere their
cells are "-".
"""

import sys

from killing import OTHERS, caught_at, properties
from tables import SURVIVES, UNKNOWN, fill
from wrong import MUTANTS, SURVIVORS

from contactverif import Property, Subject

FILE = "kills.csv"
NAMED = {mutant.name: mutant for mutant in MUTANTS} | {SURVIVES + mutant.name: mutant for mutant in SURVIVORS}
# Cases of properties that are not meant to catch the mutant, where they are not OTHERS: these take seconds each.
SLOW = {
    **dict.fromkeys(("accuracy.arc", "accuracy.hertz", "accuracy.wavy", "accuracy.wavy-curved"), 1),
    **dict.fromkeys(("hard.touch", "patch.kinked", "purity.long", "stability.locking", "tangent.long"), 1),
    "tangent.directional": 5,
}


def examples(question: Property) -> int:
    """Return the number of cases of a property that is not meant to catch the mutant."""
    if question.id in SLOW:
        return SLOW[question.id]
    return 1 if question.bodies or isinstance(question.cases(None), tuple) else OTHERS


def cells(name: str) -> list[str]:
    """Return the property that is meant to catch a mutant, and the number of the first case that did, for each one."""
    mutant = NAMED[name]
    row = dict[str, str]()
    for question in sorted(properties(), key=lambda question: question.id in SLOW):
        intended, subject = question.id == mutant.caught_by, Subject(mutant.name, mutant.make)
        if question.id in SLOW and not intended and sum(map(bool, row.values())) > 1:
            row[question.id] = UNKNOWN
        else:
            row[question.id] = str(caught_at(question, subject, None if intended else examples(question)) or "")
    return [mutant.caught_by, *(row[question.id] for question in properties())]


if __name__ == "__main__":
    heads = ["mutant", "caught by", *(question.id for question in properties())]
    fill(FILE, heads, NAMED, cells, processes=int(sys.argv[1]) if len(sys.argv) > 1 else 1)
