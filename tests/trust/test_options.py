"""A few random cases of every built-in formulation with every option; `tox -e trust` asks each of them everything."""

from functools import cache

import pytest
from option_names import all_variants
from subjects import load_property, load_subject

from contactverif import Case, Property, Verdict, judge_case
from contactverif.sampling.draw import draw_cases

# Properties that solve nothing, and have hardly an idle or an undecided case.
QUICK = (
    *("balance.force", "balance.moment", "mirror", "objectivity", "projection.forces", "purity", "renumbering"),
    *("units", "swap", "symmetric", "unilateral", "nodal-push", "stability.translation", "tangent.sparsity"),
)
EXAMPLES, EACH = 2, 3  # Random cases of a property; properties for each name, in rotation.


@cache
def cases_of(question: Property) -> tuple[Case, ...]:
    return tuple(draw_cases(question.cases(None), seed=1, examples=EXAMPLES).cases)


@pytest.mark.parametrize("part", range(4))
def test_a_formulation_with_an_option_keeps_its_promises(part: int) -> None:
    accused = []
    for number, name in list(enumerate(all_variants()))[part::4]:
        subject = load_subject(name)
        for property_id in (QUICK[(EACH * number + each) % len(QUICK)] for each in range(EACH)):
            question = load_property(property_id).for_traits(subject.traits)
            if question.refusal_of(subject) or question.needs - subject.provides:
                continue
            for case in cases_of(question):
                outcome = judge_case(question, case, subject)
                broken = question.promise(subject.traits) is True and outcome.verdict is Verdict.FAIL
                if broken or outcome.breach or outcome.verdict is Verdict.CRASHED:
                    accused.append(f"{name}, {property_id}: {outcome.reason}")
    assert not accused
