"""Ask every property in space about right formulations on faces, and about wrong ones, and keep who is accused.

`tox -e trust` writes `reports/trust/faces.csv`, a line for each formulation and property, and `face_kills.csv`, a line
for each wrong formulation, with the first case that accuses it and what else does. A list of cases is asked once.
"""

import sys
from functools import cache

from campaign import NUMBERS, Count
from face_killing import MUTANTS, first_accused, properties_in_space
from face_page import FACES, KILLS
from tables import fill

from contactverif import Case, Subject, load_formulation
from contactverif.contract.property import Property
from contactverif.sampling.draw import draw_cases

FORMULATIONS = ("sts-3d", "mortar-3d", "vts-cell-3d", "vts-ppt-3d", "nts-3d", "nts-ar-3d")
EXAMPLES = 700  # Random cases of each property and formulation.
INTENDED, OTHERS = 300, 5  # Cases of the property that is meant to catch a mutant, and of each other one.
LONG = ("tangent.long", "hard.touch")  # Properties that are asked about mutants that are meant for them alone.


@cache
def cases(question: Property) -> tuple[Case, ...]:
    """Return the cases of a variant of a property."""
    return draw_cases(question.cases(None), seed=f"faces/{question.id}", examples=EXAMPLES).cases


def count(key: str) -> list[str]:
    """Return the cells of a line, whose key is a formulation and a property, such as "sts-3d/mirror"."""
    name, _, property_id = key.partition("/")
    subject, total = load_formulation(name), Count()
    assert isinstance(subject, Subject)
    question = properties_in_space()[property_id].for_traits(subject.traits)
    total.ask(question, cases(question), subject)
    return [*total.numbers, "; ".join(total.accused)]


def kill(name: str) -> list[str]:
    """Return the property that is meant to catch a mutant, the first case that did, and what else catches it."""
    (mutant,) = (mutant for mutant in MUTANTS if mutant.name == name)
    subject = Subject(mutant.name, mutant.make)
    first, others = "", []
    for property_id, question in properties_in_space().items():
        intended = property_id == mutant.caught_by
        if property_id in LONG and not intended:
            continue
        number = first_accused(question, subject, INTENDED if intended else OTHERS)[0]
        if intended:
            first = str(number)
        elif number:
            others.append(property_id)
    return [mutant.caught_by, first, "; ".join(others)]


if __name__ == "__main__":
    n_processes = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    fill(KILLS, ("mutant", "caught by", "first case", "also"), [each.name for each in MUTANTS], kill, n_processes)
    keys = [f"{name}/{property_id}" for name in FORMULATIONS for property_id in properties_in_space()]
    fill(FACES, ("formulation/property", *NUMBERS, "accused"), keys, count, n_processes)
