"""Ask every property of every right formulation of a stranger, with many random cases, and count whoever is accused.

`tox -e trust` writes `reports/trust/strangers.csv`, a line for each seed and formulation, with how near it came to an
accusation. Named cases are the same for every seed, and are asked with the first one. Where a formulation states
nothing of a property, only a crash or a breach of the contract can accuse it: where bodies are solved, such a property
is asked with every tenth case.
"""

import sys

from campaign import NUMBERS, Count, random_cases
from stranger_cases import EXAMPLES, SEEDS, UNSTATED
from strangers import STRANGERS
from tables import fill

from contactverif import Subject, load_properties
from contactverif.contract.property import Property

FILE = "strangers.csv"
HEADS = ("seed/formulation", *NUMBERS, "property", "accused")


def count(key: str) -> list[str]:
    """Return the cells of a line, whose key is a seed and a formulation, such as "1/nodal least squares"."""
    seed, _, name = key.partition("/")
    total, subject = Count(), Subject(name, STRANGERS[name])
    for question in load_properties():
        assert isinstance(question, Property)
        part = UNSTATED if question.bodies and question.promise(subject.traits) is not True else 1
        listed = question.cases(None)
        if not isinstance(listed, tuple):
            total.ask(question, random_cases(question, f"{seed}/{question.id}", EXAMPLES // part), subject)
        elif int(seed) == SEEDS[0]:
            total.ask(question, listed[::part], subject)
    return [*total.numbers, total.closest.rpartition(", ")[2], "; ".join(total.accused)]


if __name__ == "__main__":
    keys = [f"{seed}/{name}" for seed in SEEDS for name in STRANGERS]
    fill(FILE, HEADS, keys, count, processes=int(sys.argv[1]) if len(sys.argv) > 1 else 1)
