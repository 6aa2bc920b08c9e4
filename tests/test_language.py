"""Plain English in names, docstrings and comments: what a reader of this project should not have to decode.

One test for each folder, so that `pytest tests/test_language.py -k contract` checks one folder.
The rules, with examples, are in CONTRIBUTING.md. Rule for the next editor: a rule here must be decidable by a short
list of words. What needs judgement belongs to the reviewer.
"""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import pytest
from test_house import PACKAGES, ROOT

# Words that no name contains, because they do not say what the thing is. `find_root` and `expected_force` do.
RIDDLES = {
    *("anywhere", "elsewhere", "nowhere", "somewhere", "whoever", "whatever"),
    *("asked", "told", "posed", "parted", "held", "meant", "gone", "laid", "lain", "borne", "thrown", "handed"),
}
# Participles and fragments that are no name by themselves. A boolean may be called by one (`done`, `solved`).
FRAGMENTS = {
    *("found", "given", "taken", "kept", "said", "seen", "shown", "made", "done", "drawn", "brought", "bought"),
    *("built", "chosen", "felt", "got", "heard", "led", "left_over", "left_out", "lent", "lost", "met", "paid"),
    *("sent", "sought", "spent", "stood", "struck", "taught", "thought", "torn", "understood", "won", "worn"),
    *("one", "own", "of", "it", "its", "whose", "which", "who", "what", "how", "where", "why", "when", "whether"),
}
IRREGULAR = {
    *("begun", "bent", "bought", "bound", "bought", "broken", "brought", "built", "caught", "chosen", "done", "drawn"),
    *("driven", "fed", "felt", "found", "forgotten", "given", "gone", "got", "grown", "heard", "held", "hidden"),
    *("kept", "known", "laid", "led", "left", "lent", "lost", "made", "meant", "met", "paid", "said", "seen", "sent"),
    *("shown", "shrunk", "sought", "spent", "spoken", "spun", "stood", "struck", "swept", "taken", "taught", "thought"),
    *("thrown", "told", "torn", "understood", "won", "worn", "written"),
}
ENDS_LIKE_A_PARTICIPLE = re.compile(r"(?<!e)ed$")  # Words such as seed, need and speed end in eed.
NO_PARTICIPLES = {"bed", "embed", "shed", "red", "sed"}
# First words of a fragment. A docstring says what the thing is, or begins with a verb.
FRAGMENT_BEGINNINGS = re.compile(
    r"(whether|what|how|who|whose|whoever|which|where|when|why|as|of|and|but|or|times|nor|because|that|those (who|that)"
    r"|one (who|that)|so that|never|not|no longer|the same|all that|all of|is|are|has|had|does|may|must)\b",
    re.IGNORECASE,
)
# A constant's comment that goes on where the name has stopped: `GONE = 1e8  # times the first residual`.
COMMENT_BEGINNINGS = re.compile(r"(of|times|in|where|at|by|as|and|but|or|what|how|whether|who|which)\b", re.IGNORECASE)
ARRAY = re.compile(r"^(FloatArray|IntArray|BoolArray|(np|numpy)\.ndarray|ndarray)\b(?!.*(shape|\())")


class Finding(NamedTuple):
    """A breach of a rule: the line of a file, and what is wrong there."""

    line: int
    message: str


class Name(NamedTuple):
    """A name that a file defines, and what it names."""

    line: int
    text: str
    kind: str  # "module", "class", "function", "parameter", "attribute" or "variable"
    boolean: bool  # A property, or something annotated as bool.


def folder_of(path: Path) -> str:
    return path.parent.relative_to(ROOT).as_posix()


def sources() -> Iterator[Path]:
    """Return every Python file that a person reads: packages, tests, examples and scripts of the docs."""
    for folder in [*PACKAGES, *(ROOT / name for name in ("tests", "examples", "docs"))]:
        yield from sorted(folder.rglob("*.py"))


@lru_cache(maxsize=1)
def parse(text: str) -> ast.Module:
    """Parse a file once for all rules, which read it one after the other."""
    return ast.parse(text)


FILES: dict[str, list[Path]] = {}
for source in sources():
    FILES.setdefault(folder_of(source), []).append(source)


# --------------------------------------------------------------------------------------------------------------
# Names


def is_boolean(annotation: ast.expr | None) -> bool:
    return annotation is not None and bool(re.search(r"\b(bool|BoolArray|bool_)\b", ast.unparse(annotation)))


def is_property(node: ast.FunctionDef) -> bool:
    return any("property" in ast.unparse(decorator) for decorator in node.decorator_list)


def names_of(target: ast.expr, line: int, boolean: bool) -> Iterator[Name]:
    """Return the names that an assignment binds, tuples taken apart."""
    match target:
        case ast.Name(id=name):
            yield Name(line, name, "variable", boolean)
        case ast.Attribute(value=ast.Name(id="self" | "cls"), attr=name):
            yield Name(line, name, "attribute", boolean)
        case ast.Tuple(elts=elements) | ast.List(elts=elements):
            for element in elements:
                yield from names_of(element, line, boolean)
        case ast.Starred(value=value):
            yield from names_of(value, line, boolean)


def is_true_or_false(value: ast.expr | None) -> bool:
    """Return whether an assigned expression is clearly a boolean: a comparison, `not`, True or False."""
    match value:
        case ast.BoolOp(values=values):
            return all(map(is_true_or_false, values))
        case ast.BinOp(left=left, op=ast.BitAnd() | ast.BitOr(), right=right):
            return is_true_or_false(left) or is_true_or_false(right)
        case (
            ast.Compare()
            | ast.UnaryOp(op=ast.Not() | ast.Invert())
            | ast.Constant(value=True | False)
            | ast.Call(func=ast.Name(id="all" | "any" | "bool" | "isinstance"))
            | ast.Call(func=ast.Attribute(attr="all" | "any" | "isfinite" | "isnan"))
        ):
            return True
    return False


def parameters_of(node: ast.FunctionDef | ast.Lambda) -> Iterator[Name]:
    arguments = node.args
    everything = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.vararg, arguments.kwarg]
    parts_of_a_message = {argument.arg for argument in everything if argument} >= {"found", "needed"}
    for argument in filter(None, everything):
        if not (parts_of_a_message and argument.arg in ("found", "needed")):
            line = getattr(argument, "lineno", 1)
            yield Name(line, argument.arg, "parameter", is_boolean(argument.annotation))


def names_in(tree: ast.Module, module: str) -> Iterator[Name]:
    """Return all names that a file defines, its own included."""
    yield Name(1, module, "module", False)
    for node in ast.walk(tree):
        match node:
            case ast.ClassDef(name=name):
                yield Name(node.lineno, name, "class", False)
            case ast.FunctionDef(name=name):
                yield Name(node.lineno, name, "function", is_property(node))
                yield from parameters_of(node)
            case ast.Lambda():
                yield from parameters_of(node)
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    yield from names_of(target, node.lineno, is_true_or_false(value))
            case ast.AnnAssign(target=target, annotation=annotation):
                yield from names_of(target, node.lineno, is_boolean(annotation))
            case ast.NamedExpr(target=target, value=value):
                yield from names_of(target, node.lineno, is_true_or_false(value))
            case (
                ast.For(target=target)
                | ast.comprehension(target=target)
                | ast.withitem(optional_vars=ast.expr() as target)
            ):
                yield from names_of(target, getattr(target, "lineno", 1), False)


def words_of(name: str) -> list[str]:
    """Return the words of `snake_case` or `CamelCase`, in small letters."""
    return [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z0-9]+", name)]


def is_participle(word: str) -> bool:
    if word in NO_PARTICIPLES:
        return False
    return word in IRREGULAR or bool(ENDS_LIKE_A_PARTICIPLE.search(word))


def wrong_names(text: str, module: str) -> list[Finding]:
    tree = parse(text)
    excepted = {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef) and node.name in ("MisuseError", "Finding")
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    names = list(names_in(tree, module))
    # What is found beside what is needed, or beside what is right.
    excepted |= {name.line for name in names if name.text.strip("_") == "right"}
    wrong = []
    for name in names:
        if name.line in excepted and name.text.strip("_") in ("found", "needed"):
            continue
        if name.kind == "function" and name.text.startswith("test_"):
            continue
        words = words_of(name.text)
        plain = name.text.strip("_").lower()
        if riddles := sorted(RIDDLES & set(words)):
            wrong.append(Finding(name.line, f"{name.kind} {name.text}: {riddles[0]!r} says nothing"))
        elif name.boolean:
            continue
        elif plain in FRAGMENTS:
            wrong.append(Finding(name.line, f"{name.kind} {name.text}: a name says what the thing is"))
        elif name.kind == "function" and len(words) == 1 and is_participle(plain):
            wrong.append(Finding(name.line, f"function {name.text}: a function is called by a verb"))
    return sorted(set(wrong))


# --------------------------------------------------------------------------------------------------------------
# Docstrings


def docstrings(tree: ast.Module) -> Iterator[tuple[ast.AST, int, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield node, node.body[0].lineno, text


def entries(text: str) -> Iterator[tuple[str, str, str]]:
    """Return (name, type, description) of all that the sections of a docstring list."""
    lines = text.splitlines()
    for at, line in enumerate(lines):
        if re.fullmatch(r"-{3,}", line) and at and lines[at - 1] in ("Parameters", "Attributes", "Returns", "Yields"):
            for below in range(at + 1, len(lines)):
                if re.fullmatch(r"-{3,}", lines[min(below + 1, len(lines) - 1)]):
                    break
                if lines[below] and not lines[below].startswith(" "):
                    name, colon, kind = lines[below].partition(" : ")
                    after = lines[below + 1].strip() if below + 1 < len(lines) else ""
                    yield (name, kind, after) if colon else ("", lines[below], after)


def wrong_docstrings(text: str, module: str) -> list[Finding]:
    wrong = []
    for node, line, docstring in docstrings(parse(text)):
        first = docstring.splitlines()[0]
        if fragment := FRAGMENT_BEGINNINGS.match(first):
            wrong.append(Finding(line, f"a docstring does not begin with {fragment[0]!r}: {first}"))
        elif first[0].islower() and not isinstance(node, ast.Module):
            wrong.append(Finding(line, f"a docstring begins with a capital: {first}"))
        for name, kind, description in entries(docstring):
            if ARRAY.search(kind):
                wrong.append(Finding(line, f"{name or 'the result'} : {kind} does not say its shape"))
            if re.match(r"Of\b", description):
                wrong.append(Finding(line, f"the description of {name or 'the result'} begins with 'Of'"))
    return sorted(set(wrong))


# --------------------------------------------------------------------------------------------------------------
# Comments of constants


def wrong_comments(text: str, module: str) -> list[Finding]:
    constants = {
        node.end_lineno
        for node in ast.walk(parse(text))
        if isinstance(node, ast.Assign | ast.AnnAssign)
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        if isinstance(target, ast.Name) and target.id.isupper()  # The comment of a field may say where it is known.
    }
    wrong = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        line = token.start[0]
        if token.type == tokenize.COMMENT and line in constants and token.line[: token.start[1]].strip():
            comment = token.string.lstrip("# ")
            if comment.startswith(("type:", "noqa", "pragma", "(", "[")):
                continue
            if beginning := COMMENT_BEGINNINGS.match(comment):
                wrong.append(Finding(line, f"a constant's comment does not begin with {beginning[0]!r}: {comment}"))
    return wrong


# --------------------------------------------------------------------------------------------------------------
# Sentences


def wrong_sentences(text: str, module: str) -> list[Finding]:
    """Return the sentences that hide their actor behind the word."""
    lines = enumerate(text.splitlines(), start=1)
    return [Finding(number, "name the actor") for number, line in lines if re.search(r"\bWho[e]ver\b", line)]


# --------------------------------------------------------------------------------------------------------------
# The rules, folder by folder

RULES = (wrong_names, wrong_docstrings, wrong_comments, wrong_sentences)


@pytest.mark.parametrize("folder", FILES)
def test_a_folder_reads_as_plain_english(folder: str) -> None:
    wrong = []
    for path in FILES[folder]:
        text = path.read_text(encoding="utf-8")
        findings = sorted(finding for rule in RULES for finding in rule(text, path.stem))
        wrong += [f"{path.relative_to(ROOT)}:{finding.line}: {finding.message}" for finding in findings]
    assert not wrong, "\n" + "\n".join(wrong)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def told(): ...", "function told: 'told' says nothing"),
        ("def f(*, asked): ...", "parameter asked: 'asked' says nothing"),
        ("def turned(): ...", "function turned: a function is called by a verb"),
        ("def rotated(): ...", "function rotated: a function is called by a verb"),
        ("class Posed: ...", "class Posed: 'posed' says nothing"),
        ("for one in x: ...", "variable one: a name says what the thing is"),
        ("a, (found, b) = x", "variable found: a name says what the thing is"),
        ("def f(self):\n  self.kept = 1", "attribute kept: a name says what the thing is"),
        ("[found for found in x]", "variable found: a name says what the thing is"),
        ("if found := f(): ...", "variable found: a name says what the thing is"),
        ("with f() as held: ...", "variable held: 'held' says nothing"),
        ("f(lambda own: 1)", "parameter own: a name says what the thing is"),
    ],
)
def test_a_name_that_says_nothing_is_seen(text: str, message: str) -> None:
    assert [finding.message for finding in wrong_names(text, "module")] == [message]


@pytest.mark.parametrize(
    "text",
    [
        "def seed(): ...\ndef proceed(): ...\nspeed = 1",
        "class A:\n  done: bool\n  @property\n  def converged(self): ...",
        "def f(*, shown: bool): ...",
        "found = a == b",
        "class MisuseError:\n  def __init__(self, argument, found, needed):\n    self.found = found",
        "def wrong(argument, found, needed): ...",
        "rotated_mesh = expected = found_forces = 1",
    ],
)
def test_a_plain_name_passes(text: str) -> None:
    assert not wrong_names(text, "module")


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ('"""Whether it is so."""', "Whether"),
        ('def f():\n  """As it was."""', "As"),
        ('def f():\n  """How many."""', "How"),
        ('class A:\n  """what a file needs."""', "what"),
        ('def f():\n  """Add.\n\n  Returns\n  -------\n  FloatArray\n      The sum.\n  """', "shape"),
        ('def f(a):\n  """Add.\n\n  Parameters\n  ----------\n  a : int\n      Of nodes.\n  """', "Of"),
    ],
)
def test_a_docstring_that_is_a_fragment_is_seen(text: str, word: str) -> None:
    (finding,) = wrong_docstrings(text, "module")
    assert word in finding.message


@pytest.mark.parametrize(
    "text",
    [
        '"""The parts of a mesh."""',
        'def f(a):\n  """Return whether."""',
        'def f():\n  """Add.\n\n  Returns\n  -------\n  FloatArray, shape (n, 2)\n      The sum.\n  """',
        'def f(a):\n  """Add.\n\n  Parameters\n  ----------\n  a : FloatArray (..., n)\n      Positions.\n  """',
    ],
)
def test_a_docstring_that_says_what_the_thing_is_passes(text: str) -> None:
    assert not wrong_docstrings(text, "module")


def test_a_sentence_without_an_actor_is_seen() -> None:
    text = "x = 1\n# {}ever has none lacks nothing.\n".format("Who")
    assert wrong_sentences(text, "module") == [(2, "name the actor")]
    assert not wrong_sentences("# The author, whoever that is.", "module")


def test_a_comment_that_continues_the_name_is_seen() -> None:
    (finding,) = wrong_comments("GONE = 1e8  # times the first residual\n", "module")
    assert "'times'" in finding.message
    assert not wrong_comments(
        "FACTOR = 1e8  # Divergence factor of the first residual\nX = (\n  1  # of them\n)\n", "m"
    )
