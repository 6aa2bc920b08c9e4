"""The numbers of a case beside the tolerance that they make, for a reader who asks why a case fails."""

import ast
import operator
import re
from collections.abc import Callable, Mapping
from math import isclose, nan

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.contract.case import Case
from contactverif.contract.counterexample import Counterexample
from contactverif.contract.property import CheckedNumber, checked_numbers
from contactverif.explanations.terms import plain, symbol_meanings

# A word, or a product of two symbols such as uX; what follows may make it another symbol: h_m, K', P1.
_WORD = re.compile(r"ΣH/M|ε̂|[A-Za-z]+|[^\W\d_]", re.UNICODE)
_OPERATIONS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_FUNCTIONS: dict[str, Callable[..., float]] = {"abs": abs, "min": min, "max": max}
_DIGITS = 0.01  # Numbers are printed with three digits.
_CONTINUES = re.compile(r"[_'0-9₀-₉]")


def symbols_of(formula: str) -> list[str]:
    """Return the symbols in the formula of a tolerance, each once, those that the page on tolerances explains."""
    return list(dict.fromkeys(symbol for _, _, symbols in _symbol_places(formula) for symbol in symbols))


def _symbol_places(formula: str) -> list[tuple[int, int, list[str]]]:
    """Return (start, end, symbols) of all places of a formula where one symbol stands, or u times another."""
    meanings, places = symbol_meanings(), []
    for match in _WORD.finditer(formula):
        word = match[0]
        symbols = [word] if word in meanings else list(word) if len(word) == 2 and word[0] == "u" else []
        if symbols and all(each in meanings for each in symbols) and not _CONTINUES.match(formula, match.end()):
            places.append((match.start(), match.end(), symbols))
    return places


def symbol_numbers(case: Case) -> dict[str, float]:
    """Return the numbers of the symbols that a case knows; a scene has other ones where it is solved."""
    numbers = {
        "u": UNIT_ROUNDOFF,
        "X": case.largest_coordinate,
        "S": float(np.abs(case.positions).max()),
        "ℓ": case.resolution,
        "L": case.slave_length,
        "D": case.diameter,
        "N": float(case.n_segments),
        "n": float(len(case.interface.slave)),
    }
    penetration = case.parameters.get("penetration")
    return numbers if penetration is None else {**numbers, "g": float(penetration)}


def put_in(formula: str, numbers: Mapping[str, float]) -> str:
    """Return a formula with numbers in place of its symbols, as far as they are known."""
    text, last = "", 0
    for start, end, symbols in _symbol_places(formula):
        text += formula[last:start]
        product = "·".join(f"{numbers[symbol]:.3g}" if symbol in numbers else symbol for symbol in symbols)
        text = f"{text.rstrip()}·{product}" if text.rstrip()[-1:].isdigit() else text + product
        last = end
    return re.sub(r"(\d) ?(\()", r"\1·\2", text + formula[last:])  # A number before a bracket is a factor.


def value_of(formula: str) -> float:
    """Return the value of a formula without symbols; NaN if it is no arithmetic, such as where a symbol is left."""
    text = re.sub(r"\|([^|]+)\|", r"abs(\1)", formula).replace("·", "*").replace("−", "-").replace("^", "**")
    try:
        return _evaluate(ast.parse(text, mode="eval").body)
    except (ArithmeticError, SyntaxError, TypeError, ValueError):
        return nan


def _evaluate(node: ast.expr) -> float:
    """Return the value of an expression of numbers; it calls a few functions alone, because reports are foreign."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_evaluate(operand)
        case ast.BinOp(left=left, op=operation, right=right) if type(operation) in _OPERATIONS:
            return float(_OPERATIONS[type(operation)](_evaluate(left), _evaluate(right)))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in _FUNCTIONS:
            return float(_FUNCTIONS[name](*map(_evaluate, arguments)))
    raise ValueError(f"{type(node).__name__} is no arithmetic")


def case_text(example: Counterexample, diagnosis: str = "", *, solved: bool) -> str:
    """Return in Markdown the numbers of a counterexample beside their tolerances, and how these come about.

    Where the case is `solved`, the numbers in its tolerances are those of its solution, which are not stored.
    """
    measured = checked_numbers(example.row.info, example.outcome.measurement)
    wrong = [number for number in measured if number.ratio > 1] or list(measured)
    numbers = {} if solved else symbol_numbers(example.case)
    lines = [_number_line(number, numbers) for number in wrong] or [f"- {plain(example.reason)}"]
    finding = example.outcome.measurement.finding if example.outcome.measurement is not None else None
    lines += [f"- **The worst place:** {plain(str(finding))}."] if finding is not None else []
    lines += [f"- **Diagnosis:** {plain(diagnosis)}."] if diagnosis else []
    title = f"## {plain(example.formulation)}, {plain(example.property_id)}: {plain(example.row.result)}\n"
    return "\n".join([title, *lines]) + "\n"


def _number_line(number: CheckedNumber, numbers: Mapping[str, float]) -> str:
    """Return a number beside its tolerance, and the formula with the numbers of the case put in."""
    quantity, tolerance = number.quantity, f"{number.tolerance:.3g}"
    symbols = symbols_of(quantity.tolerance)
    known = [f"{symbol} = {numbers[symbol]:.3g}" for symbol in symbols if symbol in numbers and symbol != "g"]
    formula, _, further = quantity.tolerance.partition("; ")
    if filled := _formula_that_fits(number, numbers):
        tolerance = f"{formula} = {filled} = {tolerance}"
    elif symbols:
        tolerance = f"{formula} = {tolerance}{', where the case has ' if known else ''}{', '.join(known)}"
    tolerance += f" ({further})" if further else ""
    return f"- **{plain(quantity.name)}:** {number.value:.3g}, must be {quantity.sense} {plain(tolerance)}."


def _formula_that_fits(number: CheckedNumber, numbers: Mapping[str, float]) -> str:
    """Return the formula with the numbers of the case put in if they make the tolerance, else an empty string."""
    formula = number.quantity.tolerance
    if not numbers or not symbols_of(formula):
        return ""
    # Which distance Z stands for depends on the traits, which a report does not keep.
    choices = [put_in(formula, {**numbers, "Z": numbers[name]}) for name in ("D", "X")]
    return next((text for text in choices if isclose(value_of(text), number.tolerance, rel_tol=_DIGITS)), "")
