"""Right formulations from a textbook, with all parts of the contract: no property may accuse them."""

import pytest
from subjects import load_property
from textbook_cells import ClippedCells, WeightedGaps
from textbook_springs import CentredSprings, NodalMultipliers, QuadraticSprings

from contactverif import Subject, Verdict, judge_case
from contactverif.plugins.registry import property_ids
from contactverif.sampling.draw import draw_cases

FORMULATIONS = (CentredSprings, QuadraticSprings, NodalMultipliers, ClippedCells, WeightedGaps)
FAMILIES = ("stability", "projection", "hard")
OTHERS = ("purity", "units", "objectivity", "unilateral", "tangent.directional")
LARGE = ("hard.touch", "hard.contrast")  # Their meshes are large for loops.
EXAMPLES = 8  # Random cases of each property that solves no bodies.
FEW = 2  # Cases of the others, and of a finite list, evenly spread over it.


def properties_without_long_loops() -> list[str]:
    """Return the ids of the properties that judge rounding, projection, hard cases and memory."""
    names = [name for name in property_ids() if name.split(".")[0] in FAMILIES or name in OTHERS]
    return [name for name in names if name not in LARGE]


@pytest.mark.parametrize("property_id", properties_without_long_loops())
def test_a_right_formulation_is_not_accused(property_id: str) -> None:
    question = load_property(property_id)
    source = question.cases(None)
    count = FEW if question.bodies or isinstance(source, tuple) else EXAMPLES
    cases = draw_cases(source, seed=f"textbook/{property_id}", examples=count).cases
    for make in FORMULATIONS:
        subject = Subject(make.__name__, make)
        if question.refusal_of(subject) or question.promise(subject.traits) is None:
            continue
        for case in cases[:: max(1, len(cases) // count)]:
            outcome = judge_case(question, case, subject)
            assert outcome.verdict in (Verdict.PASS, Verdict.UNDECIDED), (make.__name__, case.name, outcome.reason)
