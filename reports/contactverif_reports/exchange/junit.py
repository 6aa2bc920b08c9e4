"""A run as JUnit's XML, as servers read it that run tests: a suite for each formulation, a test case for each row.

A row that makes the run fail is a failure, or an error where the plugin crashed. What is not asked is skipped, with the
reason, and so is what fails as stated or without a promise: a server shows it neither as a failure nor as a success.
"""

import os
from xml.etree.ElementTree import Element, ElementTree, SubElement, indent

from contactverif.contract.counterexample import Counterexample, counterexamples
from contactverif.contract.errors import printable
from contactverif.contract.property import Verdict
from contactverif.contract.result import OPPOSITE_SIGN, Result, Row, Run
from contactverif_reports.files import whole
from contactverif_reports.plot.text import as_text

_SKIPPED = (Result.FAIL, Result.FAILS_AS_STATED, Result.NOT_APPLICABLE, Result.NOT_PROVIDED, Result.UNDECIDED)


def write_junit(run: Run, path: str | os.PathLike[str]) -> None:
    """Write a run as the XML that JUnit has made common."""
    examples = {(each.formulation, each.property_id): each for each in counterexamples(run).values()}
    suites = Element("testsuites", name="contactverif")
    for formulation in run.formulations:
        suite = SubElement(suites, "testsuite", name=formulation)
        for row in run.rows_of(formulation):
            end = _end_of(row, examples.get((formulation, row.property_id)))
            _add_case(suite, formulation, row.property_id, row.seconds, *end)
        if formulation in run.opposite_signs:
            _add_case(suite, formulation, "sign", 0.0, "failure", OPPOSITE_SIGN, "opposite sign")
    for item in run.not_loaded:
        suite = SubElement(suites, "testsuite", name=item.formulation)
        _add_case(suite, item.formulation, "import", 0.0, "error", item.reason, str(Result.NOT_LOADED))
    for suite in suites:
        suite.set("tests", str(len(suite)))
        for name, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
            suite.set(name, str(len(suite.findall(f"testcase/{tag}"))))
        suite.set("time", f"{sum(float(case.attrib['time']) for case in suite):.3f}")
    tree = ElementTree(suites)
    indent(tree)
    with whole(path) as part:
        tree.write(part, encoding="utf-8", xml_declaration=True)


def _end_of(row: Row, example: Counterexample | None) -> tuple[str, ...]:
    """Return tag, message, type and words of the element that says how a row ended; nothing if it passed."""
    if row.unexpected:
        drawing = [] if example is None else [example.label, as_text(example.case)]
        tag = "error" if row.verdict is Verdict.CRASHED else "failure"
        words = "\n".join([f"{row.unexpected}: {row.reason}", *drawing])
        return tag, row.reason or str(row.result), str(row.result), words
    if row.result in _SKIPPED:
        words = "fails, and promises nothing here" if row.result is Result.FAIL else row.result
        return "skipped", f"{words}: {row.known or row.reason}".removesuffix(": ")
    return ()


def _add_case(suite: Element, formulation: str, name: str, seconds: float, *end: str) -> None:
    case = SubElement(suite, "testcase", classname=printable(formulation), name=name, time=f"{seconds:.3f}")
    if end:
        tag, message, kind, words = (*end, "", "")[:4]
        attributes = {"message": printable(message), "type": kind}
        element = SubElement(case, tag, {key: text for key, text in attributes.items() if text})
        element.text = printable(words) or None
