"""The text that explains a property: what it asks, why, what it measures, its tolerance, and its known failures.

For a reader who asks why a case fails, the numbers of the case stand beside the tolerance that they make.
"""

import ast
import csv
import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from itertools import combinations
from math import isclose, nan
from typing import Any

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.contract.case import Case
from contactverif.contract.counterexample import Counterexample
from contactverif.contract.property import CheckedNumber, Property, Quantity, checked_numbers
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.explanations.terms import plain, read_text, sentence, symbol_meanings

_MOST_MISTAKES = 4


@cache
def _table(name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(read_text(name).splitlines()))


def planted_mistakes(property_id: str) -> list[str]:
    """Return the mistakes that a property is meant to catch, the plainest first, as the table has them."""
    return [row["mutant"] for row in _table("kills.csv") if row["caught by"] == property_id]


def smallest_mesh(property_id: str) -> str:
    """Return in words the smallest mesh on which a planted mistake failed a property; empty if none was shrunk."""
    sizes = [
        (tuple(map(int, row["seed 0"].split())), row["mutant"])
        for row in _table("smallest_cases.csv")
        if row["caught by"] == property_id
    ]
    if not sizes:
        return ""
    (n_slave, n_master, _), mutant = min(sizes, key=lambda item: (sum(item[0][:2]), item[0]))
    segments = f"{n_slave} slave segment{'s' * (n_slave > 1)} on {n_master} of the master"
    return f"{segments}, for the mistake “{plain(mutant)}”"


def known_failures(question: Property) -> str:
    """Return in Markdown which mistakes fail a property, and how small the mesh is that shows it."""
    facts = []
    if mistakes := planted_mistakes(question.id):
        listed = "; ".join(map(plain, mistakes[:_MOST_MISTAKES]))
        others = f"; and {len(mistakes) - _MOST_MISTAKES} more" if len(mistakes) > _MOST_MISTAKES else ""
        facts.append(f"- **Usual causes:** it is meant to catch mistakes such as these: {listed}{others}.")
    if mesh := smallest_mesh(question.id):
        facts.append(f"- **Smallest failing mesh:** {mesh}.")
    elif mistakes:
        facts.append("- **Smallest failing mesh:** the cases are a list, none of which is made smaller.")
    return _lines(["## Known failures\n", *facts])


def stated_failures(question: Property, installed: Iterable[object]) -> str:
    """Return in Markdown which of the installed formulations state that they fail a property, and by which witness.

    What is installed may be a wrapper, or may not load; neither states anything.
    """
    failing = [
        f"`{subject.name}` (`{subject.traits.witness(question.id)}`)"
        for subject in installed
        if isinstance(subject, Subject)
        and question.promise(subject.traits) is False
        and not question.refusal_of(subject)
    ]
    if not failing:
        return "No installed formulation states that it fails.\n"
    return f"These formulations state that they fail, each with a witness: {', '.join(failing)}.\n"


_ALWAYS = (
    "flat normal single overhang kinked symmetric conserves_force conserves_moment converges inf_sup "
    "integrates_linear_gap local unbiased nodes_push opens_at_ends translation_stable"
)
_STATEMENTS: tuple[tuple[str, Any], ...] = (  # (name, value) of the traits from which a promise may follow.
    *((name, True) for name in _ALWAYS.split()),
    *(("tangent", "exact"), ("continuity", "C0"), ("locks", False), ("area", "current"), ("area", "reference")),
    *(("penalty", "distributed"), ("penalty", "nodal"), ("enforcement", "multiplier")),
    *(("independent_multipliers", True), ("never_intersects", True)),
    *(("force_along", "master normal"), ("force_along", "slave normal"), ("published_forces", {"a1": "1 2 1; 2 2"})),
)


def promised_by(question: Property) -> str:
    """Return in words which traits promise that the property passes; each small set of traits is tried."""
    if question.promise(Traits()):
        return "every formulation, whatever its traits say"
    for size in (1, 2):
        sets = (dict(pairs) for pairs in combinations(_STATEMENTS, size))
        hits = [each for each in sets if len(each) == size and question.promise(Traits().revise(**each))]
        if hits:
            return " or ".join(" with ".join(f"`{name}={hit[name]!r}`" for name in sorted(hit)) for hit in hits)
    return "no trait"


def property_text(question: Property) -> str:
    """Return in Markdown all that is known of a property without the formulations that are installed."""
    cases = "elastic bodies, solved by Newton's method" if question.bodies else "an interface alone; nothing is solved"
    needs = ", ".join(f"`{part}`" for part in sorted(question.needs)) or "`residual` only"
    in_space = ", and in space, where a segment is a face" if question.cases_in_space else ""
    facts = [
        ("Cases", cases),
        ("Dimensions", f"in the plane{in_space}"),
        ("Parts of the plugin that it needs", needs),
        ("Promised by", promised_by(question)),
        *([("Not asked of a law of its own", question.linear)] if question.linear else []),
    ]
    answers = []
    for paragraph in question.question.split("\n\n"):
        title, body = re.fullmatch(r"(?:\*\*([^*]+)\.\*\* )?(.*)", paragraph, re.DOTALL).groups()  # type: ignore[union-attr]
        answers.append((f"**{title}.** " if title else "") + plain(body) + "\n")
    if not any(answer.startswith("**Source.**") for answer in answers):
        answers.append("**Source.** No publication is named; the requirement follows from mechanics.\n")
    text = [
        f"# {question.id}\n",
        sentence(plain(question.summary)) + "\n",
        *answers,
        _lines(f"- **{title}:** {words}" for title, words in facts),
        "## Measured numbers\n",
        _tolerances(question.quantities),
        _reasons(question.quantities),
    ]
    symbols = dict.fromkeys(symbol for quantity in question.quantities for symbol in symbols_of(quantity.tolerance))
    if symbols:
        text.append(_lines(["The symbols:\n", *(f"- {each}: {plain(symbol_meanings()[each])}" for each in symbols)]))
    if question.series:
        names = ", ".join(f"{plain(name)} ({unit})" for name, unit in question.series.items())
        text.append(f"The report also keeps, for each iterate: {names}.\n")
    return "\n".join([*text, known_failures(question)])


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


def _tolerances(quantities: Sequence[Quantity]) -> str:
    """Return the list of quantities with their tolerances; what several share stands once."""
    groups: dict[tuple[str, str], list[str]] = {}
    for quantity in quantities:
        sign = "≤" if quantity.sense == "at most" else "≥"
        groups.setdefault((f"{sign} {quantity.tolerance}", quantity.unit), []).append(quantity.name)
    return _lines(
        f"- **{plain('; '.join(names))}** {plain(tolerance)} ({'ratio' if unit == '1' else unit})"
        for (tolerance, unit), names in groups.items()
    )


def _reasons(quantities: Sequence[Quantity]) -> str:
    """Return the list of the reasons of tolerances: first those that all quantities share."""
    owners: dict[str, list[str]] = {}
    for quantity in quantities:
        for part in re.split(r";|\.(?= )", quantity.reason):  # Its sentences, or parts between semicolons.
            if clause := part.strip(" ."):
                owners.setdefault(clause, []).append(quantity.name)
    everywhere = [clause for clause, names in owners.items() if len(names) == len(quantities)]
    lines = [f"- {sentence(plain(clause))}" for clause in everywhere]
    lines += [
        f"- *{plain(', '.join(names))}:* {sentence(plain(clause))}"
        for clause, names in owners.items()
        if clause not in everywhere
    ]
    return _lines(["Why these tolerances:\n", *lines])


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
