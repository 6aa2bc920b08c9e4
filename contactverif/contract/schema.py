"""The declaration of what a report holds about outcomes, rows and runs: name, unit, meaning and place of each number.

netCDF, JSON and data frames are made from these tables, and a report is checked and read by them. To add a column, add
a line here, and its attribute to the class. A change of the meaning of a file that exists already raises `SCHEMA`.
The prose is in `reports/README.md`, and a test compares it with a file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from contactverif.contract.property import Verdict

SCHEMA = "4"
CONVENTIONS = "CF-1.11 UGRID-1.0"
TITLE = "contactverif: what a verification of contact formulations found"
UNITS_NOTE = (
    "Lengths are written in m and forces, per unit of thickness, in N; read them as any one consistent system of units."
)
ROOT_NOTE = (
    "promises_kept is true if the formulations do all that they state and every property was judged. The attributes "
    f"n_… count pairs of a formulation and a property. {UNITS_NOTE}"
)
SUMMARY, COUNTEREXAMPLES, TIMING, CASE = "summary", "counterexamples", "timing", "case"
NAMED_CASES = "named_cases"  # The group of the named cases that some formulation fails; only some reports have it.
# Root attributes in which two equal runs may differ.
OFF_THE_RECORD = frozenset(
    {"created", "command", "platform", "blas", "cpu_features", "stored_outcomes", "isolation", "opened", "libraries"}
)
LENGTH, PENALTY, RATIO, SECONDS, UNKNOWN = "m", "N m-2", "1", "s", "unknown"
FORCE, STRESS = "N", "N m-1"  # Forces are per unit of thickness.
PENALTY_MEANING = "distributed penalty: force per length of the interface, per length of penetration"
_PARAMETERS: Mapping[str, str] = {  # {unit: names of parameters}
    LENGTH: "penetration along approach gap offset shift bodies_nodes bodies_imposed bodies_start",
    RATIO: "direction cosine variant probe_segment probe_c ratio stiffness turn bodies_cells bodies_contact "
    "bodies_fixed bodies_count bodies_is_slave bodies_poisson bodies_axis",
    FORCE: "bodies_load",
    STRESS: "pressure bodies_young",
    "m2 N-1": "compliance",
}
PARAMETER_UNITS: Mapping[str, str] = {name: unit for unit, names in _PARAMETERS.items() for name in names.split()}

NONE = "none"  # The value of an attribute without one: some readers drop an attribute that is empty.
NOT_PLANNED = -1  # The verdict behind the last case of a formulation that had fewer cases.
NOT_MEASURED = 9.969209968386869e36  # netCDF's own fill value for doubles; a NaN in a report was measured.
UNSAID = -1  # The code of a part of which the run does not say whether it is provided.

VERDICTS: Mapping[str, int] = {str(verdict).replace(" ", "_"): int(verdict) for verdict in Verdict}
STATES: Mapping[str, int] = {"measured": 1, "no_contact_force": 2, "breaks_the_contract": 4}
PROMISES: Mapping[str, int] = {"no_promise": 0, "promised": 1, "stated_to_fail": 2}
PROMISE_CODES: Mapping[bool | None, int] = {None: 0, True: 1, False: 2}  # The codes of `Row.promise`.
PROVIDED: Mapping[str, int] = {"not_provided": 0, "provided": 1}
SIGNS: Mapping[str, int] = {"as_expected": 0, "opposite": 1}
SIDES: Mapping[str, int] = {"slave": 0, "master": 1}

Kind = Literal["real", "count", "code", "bits", "place", "words"]
_WHERE_EMPTY = "empty where there is nothing to say"


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a report: a variable of a netCDF file, and a key in JSON and in data frames."""

    name: str  # The name of the variable; empty if netCDF has none.
    path: str  # The attribute, such as `measurement.undecided`; None on the way is nothing. Of bits one for each bit.
    # real and count: numbers; code: an integer with a meaning; bits: truths; place: the place of a word among those
    # along the dimension of `axes`; words: text.
    kind: Kind
    meaning: str
    comment: str = ""
    units: str = RATIO
    # The further dimensions: of a mapping that of its names, of a series that of its entries.
    axes: tuple[str, ...] = ()
    fill: float | None = None  # Stands where nothing is.
    meanings: Mapping[str, int] | None = None  # {word: code, or mask of a bit}
    optional: bool = False  # The variable is left out where all words are empty.
    codes: Mapping[bool | None, int] | None = None  # {value: code} of an attribute that is no integer.
    key: str = ""  # The name in JSON and in data frames; empty if they have none.
    type: str = ""  # The type in JSON where the kind does not say it.


def _words(name: str, path: str, meaning: str, comment: str = _WHERE_EMPTY, *, key: str = "") -> Column:
    return Column(name, path, "words", meaning, comment, optional=True, key=key)


def _real(name: str, path: str, units: str, meaning: str, comment: str = "", *axes: str) -> Column:
    return Column(name, path, "real", meaning, comment, units, axes, NOT_MEASURED)


def _count(name: str, path: str, meaning: str, *, key: str = "", fill: int | None = None) -> Column:
    return Column(name, path, "count", meaning, fill=fill, key=key)


_AT_PLACE = "at the place; missing behind the last one"
OUTCOME = (
    Column(
        "verdict", "verdict", "code", "verdict on the case", "missing where there is no such case",
        fill=NOT_PLANNED, meanings=VERDICTS,
    ),
    Column(
        "state", "measurement measurement.idle breach", "bits", "how the case was measured",
        "bits: numbers were measured; nothing was in contact; the plugin broke the contract", meanings=STATES,
    ),
    _words("reason", "reason", "why the verdict is no pass"),
    _words("undecided", "measurement.undecided", "why a failure would not be the fault of the formulation"),
    _words("broken", "measurement.broken", "a breach that no number shows"),
    _words(
        "place", "measurement.finding.place", "place of the worst number, such as a row and a column of the tangent"
    ),
    _words("finding_unit", "measurement.finding.unit", "unit of found and right"),
    _words("found_name", "measurement.finding.found_name", "what was found at the place"),
    _words("right_name", "measurement.finding.right_name", "what is right there"),
    _words("finding_remark", "measurement.finding.remark", "remark about the place"),
    _real("found", "measurement.finding.found", "see finding_unit", "numbers: found", _AT_PLACE, "component"),
    _real("right", "measurement.finding.right", "see finding_unit", "numbers: right", _AT_PLACE, "component"),
    _real(
        "value", "measurement.values", "see quantity_units", "measured value", "missing where nothing was measured",
        "quantity",
    ),
    _real(
        "tolerance", "measurement.tolerances", "see quantity_units", "tolerance of the value",
        "made from tolerance_formula; for the side see sense", "quantity",
    ),
    _real(
        "detail_value", "measurement.details", UNKNOWN, "further numbers",
        "not judged; the property that measured them knows their units", "detail",
    ),
    _real(
        "series_value", "measurement.series", "see series_units", "numbers by iterate", "missing behind the last one",
        "series", "iterate",
    ),
)  # fmt: skip
CASE_COLUMNS = (
    _count("n_slave_segments", "summary.n_slave_segments", "number of slave segments", fill=-1),
    _count("n_master_segments", "summary.n_master_segments", "number of master segments", fill=-1),
    _real("penalty", "summary.penalty", PENALTY, PENALTY_MEANING),
    _real("largest_coordinate", "summary.largest_coordinate", LENGTH, "largest coordinate, of state and reference"),
    _real("shortest_segment", "summary.shortest_segment", LENGTH, "shortest current segment, both sides"),
    _real(
        "parameter_value", "summary.parameters", "see parameter_units", "parameters of the case that are one number",
        "missing where the case has no such parameter", "parameter",
    ),
    Column(
        "case_kind", "summary.kind", "place", "kind of situation of the case",
        "the index along `kind`; missing where the case is of none", axes=("kind",), fill=-1,
    ),
    _words("case_name", "summary.name", "name of the case"),
)  # fmt: skip
# What stands along `quantity`: the attributes of a `Quantity`.
_SYMBOLS = (
    "u: unit roundoff; X, S: largest coordinate, of case and state; ℓ: shortest segment; L, D: length and "
    "diameter of the interface; N: number of segments; g: penetration"
)
QUANTITY = (
    Column("quantity", "name", "words", "name of the measured number"),
    Column("quantity_units", "unit", "words", "unit of value and tolerance"),
    Column("tolerance_formula", "tolerance", "words", "formula of the tolerance", _SYMBOLS),
    Column("tolerance_reason", "reason", "words", "reason for that formula"),
    Column("sense", "sense", "words", "relation of value to tolerance in a pass"),
)
_SEE_CLOSEST = "see closest_units"
# In the order of JSON and of data frames; a file has the variables in the same order.
ROW = (
    Column("", "formulation", "words", "formulation, as typed on the command line", key="formulation"),
    Column("", "property_id", "words", "property, as typed with --property", key="property"),
    Column("", "info.family", "words", "subject that the property belongs to", key="family"),
    Column(
        "row_verdict", "verdict", "code", "verdict on the formulation over all cases",
        "crashed and fail first, then not judged, then pass; missing where the property was not checked",
        fill=NOT_PLANNED, meanings=VERDICTS,
    ),
    Column(
        "result", "result", "words", "the verdict beside what the formulation states, as tables and pages show it",
        key="result",
    ),
    Column(
        "promise", "promise", "code", "what the traits of the formulation say",
        "stated_to_fail names a witness, a case that always runs", meanings=PROMISES, codes=PROMISE_CODES, fill=0,
        key="promise", type="bool or none",
    ),
    Column(
        "promised_by", "promised_by", "words", "the traits from which the promise follows",
        "empty if it is one of everybody", key="promised_by",
    ),
    Column("known", "known", "words", "why a failure is known", "empty where none is", key="known"),
    Column(
        "unexpected", "unexpected", "words", "why this row makes the run fail", "empty if it does not", key="breaks"
    ),
    Column("reason", "reason", "words", "why the verdict is no pass, in the worst case", key="reason"),
    _count("planned", "planned", "number of random cases planned", key="planned"),
    _count("judged", "judged", "number of random cases that were decided", key="judged"),
    _count("", "tally.counts.failed", "number of random cases that fail or crash", key="failed"),
    _count("", "undecided", "number of random cases that are undecided", key="undecided"),
    _count("idle", "idle", "number of judged random cases in which nothing was in contact", key="idle"),
    _real(
        "contact_share", "contact_share", RATIO, "share of judged random cases in which something was in contact",
        "clearly below the attribute least_contact of the property nothing is judged; missing where no case was",
    ),
    Column(
        "suspicion", "suspicion", "words", "whether more cases are undecided than those of right formulations",
        "empty if they are not",
    ),
    Column("count", "tally.verdicts", "count", "number of random cases with each verdict", axes=("verdict",)),
    Column("", "closest.number", "real", "number that came closest to its tolerance", key="closest", type="number"),
    _real(
        "closest_value", "closest.number.value", _SEE_CLOSEST,
        "number nearest to its tolerance, or furthest beyond it", "missing where nothing was measured",
    ),
    _real("closest_tolerance", "closest.number.tolerance", _SEE_CLOSEST, "tolerance of closest_value"),
    Column("closest_quantity", "closest.number.quantity.name", "words", "name of closest_value"),
    Column("closest_units", "closest.number.quantity.unit", "words", "unit of closest_value"),
    Column(
        "closest_case", "closest.case", "count", "number of the case with closest_value",
        "the index along `case` in the group of the property; missing where it is the witness", fill=-1,
    ),
    Column("", "seconds", "real", "time spent judging, shrinking excluded", units=SECONDS, key="seconds"),
)  # fmt: skip


def text(words: str) -> str:
    """Return the words as UTF-8 can hold them, without NUL, which would cut a netCDF string short."""
    return words.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")
