"""The declaration of what a report holds about outcomes, rows and runs: name, unit, meaning and place of each number.

netCDF, JSON and data frames are made from these tables, and a report is checked and read by them. To add a column, add
a line here, the attribute that it reads to `Outcome`, `Tally` or `Row` in `result.py`, and its sentence to
`reports/README.md`; `python tests/reports/test_exchange.py` writes the JSON schema anew. A change of the meaning of a
file that exists already raises `SCHEMA`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactverif.contract.arrays import freeze
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
class ReportColumn:
    """One column of a report: a variable of a netCDF file, and a key in JSON and in data frames."""

    name: str  # The name of the variable; empty if netCDF has none.
    path: str  # The attribute, such as `measurement.undecided`. If one on the way is None, the number is missing.
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


def _words(name: str, path: str, meaning: str, comment: str = _WHERE_EMPTY, *, key: str = "") -> ReportColumn:
    return ReportColumn(name, path, "words", meaning, comment, optional=True, key=key)


def _real(name: str, path: str, units: str, meaning: str, comment: str = "", *axes: str) -> ReportColumn:
    return ReportColumn(name, path, "real", meaning, comment, units, axes, NOT_MEASURED)


def _count(name: str, path: str, meaning: str, *, key: str = "", fill: int | None = None) -> ReportColumn:
    return ReportColumn(name, path, "count", meaning, fill=fill, key=key)


_AT_PLACE = "at the place; missing behind the last one"
OUTCOME = (
    ReportColumn(
        "verdict", "verdict", "code", "verdict on the case", "missing where there is no such case",
        fill=NOT_PLANNED, meanings=VERDICTS,
    ),
    ReportColumn(
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
    ReportColumn(
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
    ReportColumn("quantity", "name", "words", "name of the measured number"),
    ReportColumn("quantity_units", "unit", "words", "unit of value and tolerance"),
    ReportColumn("tolerance_formula", "tolerance", "words", "formula of the tolerance", _SYMBOLS),
    ReportColumn("tolerance_reason", "reason", "words", "reason for that formula"),
    ReportColumn("sense", "sense", "words", "relation of value to tolerance in a pass"),
)
_SEE_CLOSEST = "see closest_units"
# In the order of JSON and of data frames; a file has the variables in the same order.
ROW = (
    ReportColumn("", "formulation", "words", "formulation, as typed on the command line", key="formulation"),
    ReportColumn("", "property_id", "words", "property, as typed with --property", key="property"),
    ReportColumn("", "info.family", "words", "subject that the property belongs to", key="family"),
    ReportColumn(
        "row_verdict", "verdict", "code", "verdict on the formulation over all cases",
        "crashed and fail first, then not judged, then pass; missing where the property was not checked",
        fill=NOT_PLANNED, meanings=VERDICTS,
    ),
    ReportColumn(
        "result", "result", "words", "the verdict beside what the formulation states, as tables and pages show it",
        key="result",
    ),
    ReportColumn(
        "promise", "promise", "code", "what the traits of the formulation say",
        "stated_to_fail names a witness, a case that always runs", meanings=PROMISES, codes=PROMISE_CODES, fill=0,
        key="promise", type="bool or none",
    ),
    ReportColumn(
        "promised_by", "promised_by", "words", "the traits from which the promise follows",
        "empty if it is one of everybody", key="promised_by",
    ),
    ReportColumn("known", "known", "words", "why a failure is known", "empty where none is", key="known"),
    ReportColumn(
        "unexpected", "unexpected", "words", "why this row makes the run fail", "empty if it does not", key="breaks"
    ),
    ReportColumn("reason", "reason", "words", "why the verdict is no pass, in the worst case", key="reason"),
    _count("planned", "planned", "number of random cases planned", key="planned"),
    _count("judged", "judged", "number of random cases that were decided", key="judged"),
    _count("", "tally.counts.failed", "number of random cases that fail or crash", key="failed"),
    _count("", "undecided", "number of random cases that are undecided", key="undecided"),
    _count("idle", "idle", "number of judged random cases in which nothing was in contact", key="idle"),
    _real(
        "contact_share", "contact_share", RATIO, "share of judged random cases in which something was in contact",
        "clearly below the attribute least_contact of the property nothing is judged; missing where no case was",
    ),
    ReportColumn(
        "suspicion", "suspicion", "words", "whether more cases are undecided than those of right formulations",
        "empty if they are not",
    ),
    ReportColumn("count", "tally.verdicts", "count", "number of random cases with each verdict", axes=("verdict",)),
    ReportColumn(
        "", "closest.number", "real", "number that came closest to its tolerance", key="closest", type="number"
    ),
    _real(
        "closest_value", "closest.number.value", _SEE_CLOSEST,
        "number nearest to its tolerance, or furthest beyond it", "missing where nothing was measured",
    ),
    _real("closest_tolerance", "closest.number.tolerance", _SEE_CLOSEST, "tolerance of closest_value"),
    ReportColumn("closest_quantity", "closest.number.quantity.name", "words", "name of closest_value"),
    ReportColumn("closest_units", "closest.number.quantity.unit", "words", "unit of closest_value"),
    ReportColumn(
        "closest_case", "closest.case", "count", "number of the case with closest_value",
        "the index along `case` in the group of the property; missing where it is the witness", fill=-1,
    ),
    ReportColumn("", "seconds", "real", "time spent judging, shrinking excluded", units=SECONDS, key="seconds"),
)  # fmt: skip


def text(words: str) -> str:
    """Return the words as UTF-8 can hold them, without NUL, which would cut a netCDF string short."""
    return words.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")


Axes = Mapping[str, Sequence[Any]]  # {dimension: what stands along it}; a range where nothing does.


@dataclass(frozen=True)
class Variable:
    """A variable of a group."""

    dims: tuple[str, ...]  # The names of its dimensions.
    values: NDArray[Any]  # Its entries: numbers or words, as bytes where they are to be written.
    attrs: dict[str, Any]  # Its attributes: words, or arrays of numbers.


@dataclass(frozen=True)
class Group(Mapping[str, Variable]):
    """A group of a netCDF file, written or read: a mapping from names to variables."""

    variables: Mapping[str, Variable] = field(default_factory=dict)  # Its variables by name.
    attrs: Mapping[str, Any] = field(default_factory=dict)  # Its attributes: words, or arrays of numbers.

    def __getitem__(self, name: str) -> Variable:
        return self.variables[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.variables)

    def __len__(self) -> int:
        return len(self.variables)

    def words(self, name: str) -> list[str]:
        """Return the entries of a variable as words; none if there is no such variable."""
        return [str(word) for word in self[name].values] if name in self else []

    def labels(self, name: str) -> list[str]:
        """Return the names along a dimension, which are all different."""
        labels = self.words(name)
        if len(set(labels)) != len(labels):
            raise ValueError(f"two of {name} have one name")
        return labels

    @cached_property
    def sizes(self) -> Mapping[str, int]:
        """The lengths of all dimensions of its variables."""
        sizes: dict[str, int] = {}
        for name, variable in self.variables.items():
            for dim, length in zip(variable.dims, variable.values.shape, strict=True):
                if sizes.setdefault(dim, length) != length:
                    raise ValueError(f"{name} is {length} long along {dim}, others {sizes[dim]}")
        return sizes


def numbers(
    dims: Sequence[str], values: ArrayLike, long_name: str, units: str, comment: str = "", *, fill: float | None = None
) -> Variable:
    """Return numbers of any dtype; `fill` marks what is not there."""
    return _variable(dims, np.asarray(values), {"long_name": long_name, "units": units}, comment, fill)


def codes(
    dims: Sequence[str],
    values: ArrayLike,
    meanings: Mapping[str, int],
    long_name: str,
    comment: str = "",
    *,
    fill: int | None = None,
    bits: bool = False,
) -> Variable:
    """Return small integers, each, or with `bits` each bit of them, with a meaning of one word."""
    attributes = {
        "long_name": long_name,
        "units": "1",
        "flag_masks" if bits else "flag_values": np.array(list(meanings.values()), dtype=np.int8),
        "flag_meanings": " ".join(meanings),
    }
    return _variable(dims, np.asarray(values, dtype=np.int8), attributes, comment, fill)


def words(dims: Sequence[str], values: Any, long_name: str, comment: str = "") -> Variable:
    """Return strings: one for no dimensions, a list for one, nested lists for more."""
    characters = np.strings.encode(np.array(_clean_text(values), dtype=np.str_), "utf-8")
    width = max(8, 1 << (characters.dtype.itemsize - 1).bit_length())  # Few widths need few dimensions.
    return _variable(dims, characters.astype(f"S{width}"), {"long_name": long_name}, comment, None)


def _clean_text(values: Any) -> Any:
    return text(values) if isinstance(values, str) else [_clean_text(value) for value in values]


def _variable(
    dims: Sequence[str], values: NDArray[Any], attributes: dict[str, Any], comment: str, fill: float | None
) -> Variable:
    if comment:
        attributes["comment"] = comment
    if values.dtype.kind == "S":
        attributes["_Encoding"] = "utf-8"
    elif fill is not None:
        attributes["_FillValue"] = values.dtype.type(fill)
    return Variable(tuple(dims), values, attributes)


def value_of(record: Any, path: str) -> Any:
    """Return an attribute of an attribute; None where one on the way is None."""
    for name in path.split("."):
        if record is None:
            return None
        record = getattr(record, name)
    return record


def to_variables(
    table: Sequence[ReportColumn],
    records: Sequence[Any],
    dims: Mapping[str, int],
    axes: Axes,
    *,
    prefix: str = "",
    units: Mapping[str, str] | None = None,
) -> dict[str, Variable]:
    """Return the columns of flat records along some dimensions {name: length}; None is no record.

    `axes` has what stands along the further dimensions; a column along one that is empty is left out. `units` takes
    the place of those of some columns.
    """
    variables = {}
    for column in table:
        if column.name and all(len(axes[axis]) for axis in column.axes):
            entries = _array_of(column, records, axes)
            if not column.optional or any(entries):
                unit = (units or {}).get(column.name, column.units)
                variables[f"{prefix}{column.name}"] = _variable_of(column, entries, dims, unit)
    return variables


def _variable_of(column: ReportColumn, entries: Any, dims: Mapping[str, int], unit: str) -> Variable:
    all_dims = (*dims, *(() if column.kind == "place" else column.axes))
    shape, meaning, comment = tuple(dims.values()), column.meaning, column.comment
    if column.kind == "words":
        return words(all_dims, np.array(entries, dtype=object).reshape(shape).tolist(), meaning, comment)
    values = entries.reshape((*shape, *entries.shape[1:]))
    if column.meanings is None:
        return numbers(all_dims, values, meaning, unit, comment, fill=column.fill)
    fill = None if column.codes is not None or column.fill is None else int(column.fill)
    return codes(all_dims, values, column.meanings, meaning, comment, fill=fill, bits=column.kind == "bits")


_DTYPES: Mapping[str, type[np.generic]] = {"real": np.float64, "count": np.int32, "code": np.int8}


def _array_of(column: ReportColumn, records: Sequence[Any], axes: Axes) -> Any:
    """Return the entries of a column as an array (n_records, …), or as a list of words."""
    if column.kind == "bits":
        masks = zip(column.path.split(), (column.meanings or {}).values(), strict=True)
        sums = [[mask * bool(value_of(record, path)) for record in records] for path, mask in masks]
        return np.sum(sums, axis=0, dtype=np.int8)
    values = [value_of(record, column.path) for record in records]
    if column.kind == "words":
        return ["" if value is None else str(value) for value in values]
    missing = 0 if column.fill is None else column.fill
    if column.kind == "place":
        places = {word: place for place, word in enumerate(axes[column.axes[0]])}
        return np.array([places.get(value, missing) for value in values], np.int32)
    if column.codes is not None:
        return np.array([column.codes[value] for value in values], np.int8)
    if not column.axes:
        return np.array([missing if value is None else value for value in values], _DTYPES[column.kind])
    array = np.full((len(values), *(len(axes[axis]) for axis in column.axes)), missing, _DTYPES[column.kind])
    labels = [{label: place for place, label in enumerate(axes[axis])} for axis in column.axes]
    for target, value in zip(array, values, strict=True):
        _fill_in(target, value, labels)
    return array


def _fill_in(target: NDArray[Any], value: Any, places: Sequence[Mapping[Any, int]]) -> None:
    """Write a series or {name: number or series} into an array; names that have no place are left out."""
    if isinstance(value, Mapping):
        for name, entry in value.items():
            place = places[0].get(name)
            if place is not None and len(places) > 1:
                _fill_in(target[place], entry, places[1:])
            elif place is not None:
                target[place] = entry
    elif value is not None:
        target[: len(value)] = value


def join(tables: Sequence[Mapping[str, Variable]], dim: str) -> dict[str, Variable]:
    """Return the variables of several tables, one behind the other along a dimension that all of them have.

    Words may be left out of a table where all of them are empty.
    """
    samples = {name: variable for table in tables for name, variable in table.items()}
    firsts = [next(iter(table.values())) for table in tables]
    lengths = [first.values.shape[first.dims.index(dim)] for first in firsts]
    joined = {}
    for name, sample in samples.items():
        axis, shape = sample.dims.index(dim), sample.values.shape
        parts = [
            table[name].values if name in table else np.zeros((*shape[:axis], length, *shape[axis + 1 :]), "S8")
            for table, length in zip(tables, lengths, strict=True)
        ]
        joined[name] = Variable(sample.dims, np.concatenate(parts, axis=axis), sample.attrs)
    return joined


class StoredColumns:
    """The columns of a group along some dimensions, by flat number of the record; a ValueError says what is damaged.

    The first column of the table says which records there are: those where it is not missing.
    """

    def __init__(
        self, table: Sequence[ReportColumn], group: Group, dims: Sequence[str], axes: Axes, *, prefix: str = ""
    ) -> None:
        self.arrays: dict[str, NDArray[Any]] = {}  # {path: (n_records, …)}
        self._readers: list[tuple[str, Callable[[int], Any]]] = []
        for column in table:
            name = f"{prefix}{column.name}"
            empty = column.optional or any(not len(axes[axis]) for axis in column.axes)
            if not column.name or (empty and name not in group):
                continue
            values = _read_variable(name, column, group[name], tuple(dims), axes)
            if not self.arrays:
                self.present: NDArray[Any] = values != column.fill
            if (flaw := _flaw_of(column, values, values[self.present], axes)) is not None:
                raise ValueError(f"{name} holds {flaw}")
            self.arrays[column.path] = values
            if column.kind == "bits":
                masks = zip(column.path.split(), (column.meanings or {}).values(), strict=True)
                self._readers += [(path, partial(_has_bit, values, mask)) for path, mask in masks]
            else:
                self._readers.append((column.path, _reader_of(column, values, axes)))

    def at(self, number: int) -> dict[str, Any]:
        """Return {path: value} of one record, without what has no variable."""
        return {path: reader(number) for path, reader in self._readers}


def _read_variable(
    name: str, column: ReportColumn, variable: Variable, dims: tuple[str, ...], axes: Axes
) -> NDArray[Any]:
    """Return a variable as an array (n_records, …) of the dimensions and the type that its column says."""
    further = () if column.kind == "place" else column.axes
    if variable.dims != (*dims, *further):
        raise ValueError(f"{name} has the dimensions {variable.dims}")
    values = variable.values
    if values.dtype.kind != {"words": "U", "real": "f"}.get(column.kind, "i"):
        raise ValueError(f"{name} is of the type {values.dtype}")
    lengths = values.shape[len(dims) :]
    if lengths != tuple(len(axes[axis]) for axis in further):
        raise ValueError(f"the numbers of {name} are not as many as their names")
    return values.reshape(-1, *lengths)


def _flaw_of(column: ReportColumn, values: NDArray[Any], present: NDArray[Any], axes: Axes) -> str | None:
    """Return what is wrong with the numbers of a column, of which `present` are those of a record."""
    match column.kind:
        case "code" if not np.isin(values, [*(column.meanings or {}).values(), int(column.fill or 0)]).all():
            return "a code without a meaning"
        case "bits" if (present & ~sum((column.meanings or {}).values())).any():
            return "a code without a meaning"
        case "place" if ((present < -1) | (present >= len(axes[column.axes[0]]))).any():
            return "a code without a meaning"
        case "count" if (present < 0).any():
            return "a number below 0"
    return None


def _has_bit(values: NDArray[Any], mask: int, number: int) -> bool:
    return bool(values[number] & mask)


def _reader_of(column: ReportColumn, values: NDArray[Any], axes: Axes) -> Callable[[int], Any]:
    if column.kind == "words":
        return lambda number: str(values[number])
    if column.kind == "place":
        labels = [*axes[column.axes[0]], ""]  # A case of none has the code −1, which is the last.
        return lambda number: labels[values[number]]
    if column.codes is not None:
        by_code = {code: value for value, code in column.codes.items()}
        return lambda number: by_code[int(values[number])]
    if not column.axes:
        return lambda number: values[number].item()
    names = axes[column.axes[0]]
    if len(column.axes) == 2:
        return lambda number: {
            name: freeze(series[:length], np.float64)
            for name, series in zip(names, values[number], strict=True)
            if (length := _length(series))
        }
    if isinstance(names, range):
        return lambda number: tuple(values[number, : _length(values[number])].tolist())
    fill = column.fill
    return lambda number: {
        name: value for name, value in zip(names, values[number].tolist(), strict=True) if value != fill
    }


def _length(series: NDArray[Any]) -> int:
    """Return the number of entries in front of the padding."""
    present = np.flatnonzero(series != NOT_MEASURED)
    return int(present[-1]) + 1 if len(present) else 0
