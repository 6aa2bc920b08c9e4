"""A run made by hand, whose only counterexample is a given case."""

from subjects import load_property

from contactverif import Case, Outcome, Row, Run, Verdict


def run_with(case: Case, formulation: str, property_id: str = "patch.flat.transmission") -> Run:
    """Return a run in which the formulation failed an installed property on the case."""
    question = load_property(property_id)
    failed = Outcome(case, Verdict.FAIL, "made by hand")
    row = Row(formulation, question, Verdict.FAIL, None, planned=1, outcomes=(failed,), shrunk=failed)
    parts = {"pair": True, "tangent": True, "contact_points": True}
    return Run(
        (row,), (), {formulation: parts}, {"created": "2025-01-01T00:00:00", "command": "", "platform": "", "seed": "0"}
    )
