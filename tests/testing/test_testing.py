"""`parametrize_with_properties` in a test file of an author, with fake entry points."""

import subprocess
from importlib.metadata import entry_points

import pytest

# They import numpy, scipy and hypothesis before pytester notes which modules to forget again.
import scipy.linalg  # noqa: F401
from fresh_process import PYTHON

from contactverif.plugins import registry
from contactverif.sampling import hypothesis_draws  # noqa: F401

pytest_plugins = ["pytester"]

CONFTEST = """
import numpy as np
import pytest
from dataclasses import replace
from importlib.metadata import EntryPoint
from hypothesis import strategies as st
from contactverif import Case, Interface, Measurement, PatchPromises, Promises, Property, Quantity, Traits
from contactverif.plugins import registry

ERROR = Quantity("error", "1e-6", "a number for a test")

def a_case(size):
    x = np.arange(size + 1.0)
    interface = Interface.from_chains(np.column_stack([x, 0 * x]), np.column_stack([x[::-1], 0 * x]))
    return Case(interface, interface.nodes.ravel())

def measured(case, subject):
    forces = subject.for_case(case).residual(case.interface, None, case.z)
    return Measurement([ERROR.check(float(np.abs(forces).max()), 1e-6)])

def cases(interface):
    return st.integers(1, 60).map(a_case)

def undecided(case, subject):
    return Measurement([ERROR.check(1.0, 0.0)], "a kink")

PROMISE = lambda traits: traits.promises.patch.flat
ZERO = Property("patch.zero", "patch", "No force at rest.", (ERROR,), cases, measured, PROMISE)
TANGENT = replace(ZERO, id="tangent.zero", needs=frozenset({"tangent"}), promise=lambda traits: None)
CURVED = replace(ZERO, id="patch.curved", applicable=lambda traits: "flat only")
KINK = replace(ZERO, id="patch.kink", measure=undecided)

class Plugin:
    def __init__(self, least, promise):
        self.least, self.traits = least, Traits(Promises(PatchPromises(flat=promise)))
    def residual(self, interface, pairing, z):
        return 1.0 * (len(interface.slave) >= self.least) + 0 * z

def good(*, penalty): return Plugin(10**9, True)
def bad(*, penalty): return Plugin(5, True)
def silent(*, penalty): return Plugin(5, None)
def lost(*, penalty): raise RuntimeError("no licence")

class Entry:
    dist, pattern, module = None, EntryPoint.pattern, "fakes"
    def __init__(self, name, what): self.name, self.what, self.value = name, what, name
    def load(self): return self.what

INSTALLED = {
    registry.FORMULATIONS: [Entry(make.__name__, make) for make in (good, bad, silent, lost)],
    registry.PROPERTIES: [Entry(question.id, question) for question in (ZERO, TANGENT, CURVED, KINK)],
}
registry.entry_points = lambda *, group: INSTALLED.get(group, ())
"""


@pytest.fixture
def author(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """Return a folder with the fakes above; the real entry points come back after the test."""
    monkeypatch.setattr(registry, "entry_points", entry_points)
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)
    pytester.makeconftest(CONFTEST)
    return pytester


def a_test(arguments: str) -> str:
    return f"""
from contactverif.testing import parametrize_with_properties
from conftest import bad

@parametrize_with_properties({arguments})
def test_mine(check):
    check()
"""


def test_every_formulation_meets_every_property(author: pytest.Pytester) -> None:
    author.makepyfile(test_it=a_test("'good', 'bad', properties=('patch.zero', 'tangent.*', 'patch.curved'), seed=1"))
    result = author.runpytest("-v", "-rs")
    result.assert_outcomes(passed=1, failed=1, skipped=4)
    result.stdout.fnmatch_lines(
        [
            "test_it.py::test_mine[[]good-patch.curved[]] SKIPPED*",
            "test_it.py::test_mine[[]good-patch.zero[]] PASSED*",
            "test_it.py::test_mine[[]good-tangent.zero[]] SKIPPED*",
            "test_it.py::test_mine[[]bad-patch.curved[]] SKIPPED*",
            "test_it.py::test_mine[[]bad-patch.zero[]] FAILED*",
            "test_it.py::test_mine[[]bad-tangent.zero[]] SKIPPED*",
        ]
    )
    result.stdout.fnmatch_lines_random(["SKIPPED [[]2[]] *: flat only", "SKIPPED [[]2[]] *: tangent: not provided"])
    result.stdout.fnmatch_lines(["contactverif: 6 checks, 120 cases planned, 120 judged; same cases with *-seed=1"])


def test_a_failure_tells_all_that_one_needs(author: pytest.Pytester) -> None:
    """No traceback through our own files, numbers against tolerances, a drawing, and how to ask again."""
    author.makepyfile(test_it=a_test("'bad', properties=('patch.zero',), seed=1, examples=40"))
    result = author.runpytest()
    result.stdout.fnmatch_lines(
        [
            "check = <check bad-patch.zero>",
            ">       check()",
            "E       AssertionError: bad, patch.zero: promised to pass, but fails",
            "E         The property: No force at rest.",
            "E         40 of 40 cases could be judged.",
            "E         The worst case: error 1, at most 1e-06",
            "E         The smallest case that fails:",
            "E           ✗ error: 1; needed: at most 1e-06",
            "E             tolerance: 1e-6 (a number for a test)",
            "E         To run it again: pytest 'test_it.py::test_mine[[]bad-patch.zero[]]' "
            "--contactverif-seed=1 --contactverif-examples=40",
        ]
    )
    lines = result.stdout.lines
    drawing = lines[lines.index("E             tolerance: 1e-6 (a number for a test)") + 1 :]
    assert not drawing[0].startswith("E         To run")
    result.stdout.no_fnmatch_line("*contactverif/testing/*")


@pytest.mark.parametrize(
    ("arguments", "outcome", "reason"),
    [
        (
            "'silent', properties=('patch.zero',)",
            "xfailed",
            "fails; the formulation promises nothing here: error 1, at most 1e-06",
        ),
        ("'bad', properties=('patch.zero',), known={'patch.zero': 'issue 12'}", "xfailed", "known failure: issue 12"),
        (
            "'good', properties=('patch.zero',), known={'patch.zero': 'x'}",
            "failed",
            "listed as a known failure, but passes",
        ),
        ("'good', properties=('patch.kink',)", "failed", "not judged"),
        ("'lost', properties=('patch.zero',)", "failed", "lost: not loaded: make: RuntimeError: no licence"),
        ("bad, properties=('patch.zero',)", "failed", "bad, patch.zero: promised to pass, but fails"),
        ("lambda *, penalty: bad(penalty=penalty), properties=('patch.curved',)", "skipped", "<lambda>-patch.curved"),
    ],
)
def test_what_becomes_of_a_row(author: pytest.Pytester, arguments: str, outcome: str, reason: str) -> None:
    author.makepyfile(test_it=a_test(arguments))
    result = author.runpytest("-rA", "-v")
    result.assert_outcomes(**{outcome: 1})
    assert reason in result.stdout.str()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("'goood'", "formulation: found 'goood'*nearest: good"),
        ("'good:n=1'", "option of 'good:n=1': found 'n'*it has none"),
        ("'good', properties=('patch.zeros',)", "property: found 'patch.zeros'*nearest: patch.zero*"),
        ("'good', profile='nigtly'", "profile: found 'nigtly'*nearest: nightly"),
        ("'good', known={'patch.zer': 'why'}", "known failure: found 'patch.zer'*nearest: patch.zero*"),
        ("'good', properties='patch.zero'", "*properties: found 'patch.zero'; needed a sequence*"),
        ("properties=('patch.zero',)", "*formulations: found (); needed names or factories, at least one*"),
        ("'good', examples=0", "examples: found 0; needed at least 1, at most 1000000000"),
    ],
)
def test_what_is_written_wrong_is_an_error_of_the_collection(
    author: pytest.Pytester, arguments: str, message: str
) -> None:
    author.makepyfile(test_it=a_test(arguments))
    result = author.runpytest()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([f"*{message}*"])


@pytest.mark.parametrize(
    ("arguments", "options", "line"),
    [
        ("'good'", ["--contactverif-examples=7"], "4 checks, 14 cases planned, 7 judged"),
        ("'good', seed=3", ["--contactverif-seed=5"], "same cases with --contactverif-seed=5"),
        ("'good', seed=3, profile='ci'", [], "same cases with --contactverif-seed=3"),
        ("'good'", ["--contactverif-profile=ci"], "same cases with --contactverif-seed=0"),
        ("'good', profile='nightly', examples=9", ["--contactverif-profile=ci"], "18 cases planned"),
    ],
)
def test_options_overrule_the_file(author: pytest.Pytester, arguments: str, options: list[str], line: str) -> None:
    author.makepyfile(test_it=a_test(arguments))
    author.runpytest(*options).stdout.fnmatch_lines([f"contactverif: *{line}*"])


def test_decorators_add_up(author: pytest.Pytester) -> None:
    author.makepyfile(
        test_it=a_test("'good', properties=('patch.zero',)").replace(
            "@", "@parametrize_with_properties('bad', properties=('patch.curved',))\n@"
        )
    )
    author.runpytest().assert_outcomes(passed=1, skipped=1)


def test_a_session_has_one_fresh_seed(author: pytest.Pytester) -> None:
    author.makepyfile(test_it=a_test("'good', 'bad', properties=('patch.zero',)"))
    [first] = [line for line in author.runpytest().outlines if line.startswith("contactverif:")]
    [second] = [line for line in author.runpytest().outlines if line.startswith("contactverif:")]
    assert "same cases with --contactverif-seed=" in first
    assert first != second


def test_workers_share_the_seed_and_their_counts_are_added(author: pytest.Pytester) -> None:
    pytest.importorskip("xdist")
    author.makepyfile(test_it=a_test("'good', 'bad', properties=('patch.zero',)"))
    result = author.runpytest_subprocess("-n2")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["contactverif: 2 checks, 120 cases planned, 120 judged; same cases with *-seed=*"])


def test_other_tests_are_left_alone(author: pytest.Pytester) -> None:
    author.makepyfile("def test_else(): pass")
    result = author.runpytest("--strict-markers", "-Werror")
    result.assert_outcomes(passed=1)
    result.stdout.no_fnmatch_line("contactverif: *")


def test_the_plugin_is_cheap_to_import() -> None:
    """It loads in every pytest run where contactverif is installed."""
    heavy = ["hypothesis", "numba", "scipy", "xarray", "matplotlib", "contactverif.run.run", "numpy"]
    script = f"import sys, contactverif.testing.pytest_plugin; print([name for name in {heavy} if name in sys.modules])"
    answer = subprocess.run([*PYTHON, "-c", script], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
