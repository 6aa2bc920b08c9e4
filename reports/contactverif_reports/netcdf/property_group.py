"""The group of one property: what every formulation made of every case."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from contactverif.contract.arrays import FloatArray
from contactverif.contract.property import Measurement, Outcome, Property, Quantity
from contactverif.contract.result import Row
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.variables import codes, numbers, words

Table = dict[str, xr.Variable]
_EACH = ("formulation", "case")


def property_group(question: Property, rows: Mapping[str, Row], formulations: Sequence[str]) -> xr.Dataset:
    """One property: dimensions `formulation` (of the whole run), `case` (of the longest row) and `quantity`.

    `rows` are this property's, by formulation; one without a row is all padding.
    """
    outcomes = [rows[name].outcomes if name in rows else () for name in formulations]
    witnesses = [rows[name].witness if name in rows else None for name in formulations]
    longest = max(map(len, outcomes))
    table = {
        "formulation": words(["formulation"], formulations, "formulation, as typed on the command line"),
        "case": numbers(["case"], np.arange(longest, dtype=np.int32), "number of the case, in order of judging", "1"),
        "verdict": codes(
            _EACH,
            _spread(outcomes, longest, lambda outcome: outcome.verdict, schema.NOT_PLANNED, np.int8),
            schema.VERDICTS,
            "verdict on the case",
            "missing where the formulation had fewer cases than the longest row",
            fill=schema.NOT_PLANNED,
        ),
    }
    if any(outcome.reason for outcome in _all(outcomes)):
        reasons = [_padded([outcome.reason for outcome in row], longest, "") for row in outcomes]
        table["reason"] = words(_EACH, reasons, "why the verdict is no pass", "empty where there is nothing to say")
    table |= _descriptors(outcomes, longest)
    table |= quantity_notes(question.quantities)
    measured = [_padded([outcome.measurement for outcome in row], longest, None) for row in outcomes]
    table |= quantity_values(question.quantities, measured, _EACH)
    table |= detail_values(measured, _EACH)
    table |= _series(question, outcomes, longest)
    table |= _witnesses(question, witnesses)
    attributes = {
        "property_id": question.id,
        "summary": schema.text(question.summary),
        "needs": ", ".join(sorted(question.needs)) or "nothing but residual",
        "comment": "one property: what every formulation made of every random case that was planned for it",
    }
    return xr.Dataset(table, attrs=attributes)


def quantity_notes(quantities: Sequence[Quantity]) -> Table:
    """What is measured: names, units, formulas and reasons of the tolerances, one each along `quantity`."""
    if not quantities:
        return {}
    one = ["quantity"]
    return {
        "quantity": words(one, [quantity.name for quantity in quantities], "what is measured"),
        "quantity_units": words(one, [quantity.unit for quantity in quantities], "unit of value and tolerance"),
        "tolerance_formula": words(
            one,
            [quantity.tolerance for quantity in quantities],
            "formula of the tolerance",
            "u: unit roundoff; X, S: largest coordinate, of case and state; ℓ: shortest segment; L, D: length and "
            "diameter of the interface; N: number of segments; g: penetration",
        ),
        "tolerance_reason": words(one, [quantity.reason for quantity in quantities], "why that formula"),
        "sense": words(one, [quantity.sense for quantity in quantities], "how the value must lie to the tolerance"),
    }


def quantity_values(quantities: Sequence[Quantity], measured: Any, dims: Sequence[str], prefix: str = "") -> Table:
    """`value` and `tolerance` along dims + `quantity`; `measured` nests like dims, NaN where it holds None."""
    if not quantities:
        return {}
    names = [quantity.name for quantity in quantities]
    units = {quantity.unit for quantity in quantities}
    unit = units.pop() if len(units) == 1 else "see quantity_units"
    axes = [*dims, "quantity"]
    return {
        f"{prefix}value": numbers(
            axes, _nested(measured, names, "values"), "measured value", unit, "NaN: nothing measured", fill=np.nan
        ),
        f"{prefix}tolerance": numbers(
            axes,
            _nested(measured, names, "tolerances"),
            "tolerance that the value is held against",
            unit,
            "made from tolerance_formula; at most or at least: see sense",
            fill=np.nan,
        ),
    }


def detail_values(measured: Any, dims: Sequence[str]) -> Table:
    """Further numbers of the measurements, along dims + `detail`; nothing where there are none."""
    names = list(dict.fromkeys(name for measurement in _leaves(measured) for name in measurement.details))
    if not names:
        return {}
    return {
        "detail": words(["detail"], names, "further numbers, by name"),
        "detail_value": numbers(
            [*dims, "detail"],
            _nested(measured, names, "details"),
            "further numbers of the measurement",
            schema.UNKNOWN,
            "judged by nothing; the property that measured them knows their units",
            fill=np.nan,
        ),
    }


def _series(question: Property, outcomes: Sequence[Sequence[Outcome]], longest: int) -> Table:
    """Numbers by iterate along `_EACH` + `iterate`, NaN behind the last; nothing where the property keeps none."""
    kept = [outcome.measurement.series for outcome in _all(outcomes) if outcome.measurement is not None]
    n_iterates = max((len(values) for series in kept for values in series.values()), default=0)
    table: Table = {}
    for name, unit in question.series.items() if n_iterates else ():
        spread = np.full((len(outcomes), longest, n_iterates), np.nan)
        for formulation, row in enumerate(outcomes):
            for case, outcome in enumerate(row):
                values = outcome.measurement.series.get(name, ()) if outcome.measurement is not None else ()
                spread[formulation, case, : len(values)] = values
        long_name, comment = f"{schema.text(name)} at each iterate", "NaN: no such iterate, or nothing to say there"
        table[f"series_{schema.typeable(name)}"] = numbers(
            [*_EACH, "iterate"], spread, long_name, unit, comment, fill=np.nan
        )
    return table


def _descriptors(outcomes: Sequence[Sequence[Outcome]], longest: int) -> Table:
    """What kind of case it was: sizes, penalty, seed, and parameters that are one number."""

    def count(what: Callable[[Outcome], int], long_name: str) -> xr.Variable:
        return numbers(_EACH, _spread(outcomes, longest, what, -1, np.int32), long_name, "1", fill=-1)

    def real(what: Callable[[Outcome], float], long_name: str, units: str) -> xr.Variable:
        return numbers(_EACH, _spread(outcomes, longest, what, np.nan, np.float64), long_name, units, fill=np.nan)

    table = {
        "n_slave_segments": count(lambda outcome: len(outcome.case.interface.slave), "number of slave segments"),
        "n_master_segments": count(lambda outcome: len(outcome.case.interface.master), "number of master segments"),
        "penalty": real(
            lambda outcome: outcome.case.penalty,
            "distributed penalty: force per length of the interface, per length of penetration",
            schema.PENALTY,
        ),
        "largest_coordinate": real(
            lambda outcome: outcome.case.largest_coordinate, "largest coordinate, of state and reference", schema.LENGTH
        ),
        "shortest_segment": real(
            lambda outcome: outcome.case.shortest_segment, "shortest current segment, both sides", schema.LENGTH
        ),
    }
    found = dict.fromkeys(
        name for outcome in _all(outcomes) for name, values in outcome.case.parameters.items() if values.size == 1
    )
    for name, safe in zip(found, schema.distinct(map(schema.typeable, found)), strict=True):

        def parameter(outcome: Outcome, name: str = name) -> float:
            values = outcome.case.parameters.get(name)
            return values.item() if values is not None and values.size == 1 else np.nan

        units = schema.PARAMETER_UNITS.get(name, schema.UNKNOWN)
        table[f"parameter_{safe}"] = real(parameter, f"parameter of the case: {schema.text(name)}", units)
    return table


def _witnesses(question: Property, witnesses: Sequence[Outcome | None]) -> Table:
    """The named case that a promise "does not" points at; nothing where no formulation has one."""
    if not any(witnesses):
        return {}
    one = ["formulation"]
    verdicts = [schema.NOT_PLANNED if outcome is None else outcome.verdict for outcome in witnesses]
    measured = [outcome and outcome.measurement for outcome in witnesses]
    return {
        "witness": words(one, [outcome.case.name if outcome else "" for outcome in witnesses], "name of the witness"),
        "witness_verdict": codes(
            one,
            verdicts,
            schema.VERDICTS,
            "verdict on the witness",
            "the named case of a promise that the formulation fails; missing where there is none",
            fill=schema.NOT_PLANNED,
        ),
        "witness_reason": words(
            one, [outcome.reason if outcome else "" for outcome in witnesses], "why the witness did not pass"
        ),
    } | quantity_values(question.quantities, measured, one, "witness_")


def _spread(
    outcomes: Sequence[Sequence[Outcome]],
    longest: int,
    what: Callable[[Outcome], float],
    fill: float,
    dtype: type[np.generic],
) -> np.ndarray[Any, Any]:
    """(n_formulations, longest) of one number a case, `fill` behind the last."""
    result = np.full((len(outcomes), longest), fill, dtype=dtype)
    for index, row in enumerate(outcomes):
        result[index, : len(row)] = [what(outcome) for outcome in row]
    return result


def _padded(items: list[Any], longest: int, filler: Any) -> list[Any]:
    return items + [filler] * (longest - len(items))


def _nested(measured: Any, names: Sequence[str], kind: str) -> FloatArray:
    """Numbers by name from measurements nested in lists, (..., n_names); NaN where there is none."""
    if isinstance(measured, list):
        if not measured:
            return np.empty((0, len(names)))
        return np.stack([_nested(entry, names, kind) for entry in measured])
    found: Mapping[str, float] = getattr(measured, kind) if measured is not None else {}
    return np.array([found.get(name, np.nan) for name in names], dtype=np.float64)


def _leaves(measured: Any) -> Iterator[Measurement]:
    if isinstance(measured, list):
        for entry in measured:
            yield from _leaves(entry)
    elif measured is not None:
        yield measured


def _all(outcomes: Sequence[Sequence[Outcome]]) -> Iterator[Outcome]:
    for row in outcomes:
        yield from row
