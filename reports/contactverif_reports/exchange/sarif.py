"""A run as SARIF 2.1.0, the format in which programs report on code: a rule for each property, a result for each row.

A row that makes the run fail is an error, and a failure without a promise a warning. What fails as stated is no result.

References
----------
OASIS, Static Analysis Results Interchange Format (SARIF) Version 2.1.0 (2020).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from typing import Any

import msgspec

from contactverif.contract.counterexample import counterexample_of
from contactverif.contract.property import Verdict
from contactverif.contract.result import OPPOSITE_SIGN, Row, Run
from contactverif_reports.draw import as_text
from contactverif_reports.files import whole

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
SIGN, LOADING = "sign", "import"  # The rules beside the properties.
Place = tuple[str, int]  # A file relative to the working folder, and a line from 1.


def write_sarif(run: Run, path: str | os.PathLike[str], find_place: Callable[[str], Place | None]) -> None:
    """Write a run as SARIF; `find_place` returns where the factory of a formulation stands, None if that is unknown."""
    data = msgspec.json.format(msgspec.json.encode(log_of(run, find_place)), indent=1)
    with whole(path) as part:
        part.write_bytes(data + b"\n")


def log_of(run: Run, find_place: Callable[[str], Place | None]) -> dict[str, Any]:
    """Return the log of one run."""
    rules = [{"id": id_, "shortDescription": {"text": info.summary}} for id_, info in run.properties.items()]
    rules += [
        {"id": SIGN, "shortDescription": {"text": "Contact pushes the bodies apart."}},
        {"id": LOADING, "shortDescription": {"text": "A plugin loads."}},
    ]
    driver = {"name": "contactverif", "version": run.provenance.get("contactverif_version", "unknown"), "rules": rules}
    return {
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [{"tool": {"driver": driver}, "results": list(_results(run, find_place))}],
    }


def _results(run: Run, find_place: Callable[[str], Place | None]) -> Iterator[dict[str, Any]]:
    """Yield the results: what keeps a plugin from loading, then signs, then rows."""
    for item in run.not_loaded:
        yield _result(LOADING, "error", item.formulation, item.reason, find_place)
    for name in run.opposite_signs:
        yield _result(SIGN, "error", name, OPPOSITE_SIGN, find_place)
    for row in run.rows:
        if row.unexpected:
            yield _result(row.property_id, "error", row.formulation, _words(row), find_place)
        elif row.verdict is Verdict.FAIL and row.promise is None and not row.known:
            yield _result(row.property_id, "warning", row.formulation, _words(row), find_place)


def _result(
    rule: str, level: str, formulation: str, text: str, find_place: Callable[[str], Place | None]
) -> dict[str, Any]:
    location: dict[str, Any] = {"logicalLocations": [{"fullyQualifiedName": formulation}]}
    if (place := find_place(formulation)) is not None:
        file, line = place
        location["physicalLocation"] = {"artifactLocation": {"uri": file}, "region": {"startLine": line}}
    return {
        "ruleId": rule,
        "level": level,
        "message": {"text": f"{formulation}: {text}"},
        "locations": [location],
        "partialFingerprints": {"formulationAndProperty/v1": f"{formulation} {rule}"},
    }


def _words(row: Row) -> str:
    """Return why a row fails, with the smallest case as a drawing in text."""
    example = counterexample_of(row)
    drawing = [] if example is None else ["", as_text(example.case)]
    return "\n".join([f"{row.unexpected or 'fails, and promises nothing here'}: {row.reason}", *drawing])
