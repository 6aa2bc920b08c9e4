"""Any program that speaks the protocol of `docs/reference/protocol.md` is judged as a formulation."""

import ast
import sys
from pathlib import Path

import numpy as np
import pytest
from isolation import hostile_few

from contactverif import Subject, Verdict, load_properties, named_case, verify
from contactverif.contract.errors import PluginError
from contactverif.contract.result import NotLoaded
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import load_remote
from contactverif.isolation.wire import Reply, Request

PLAIN = Path(__file__).with_name("plain_program.py")
PAGE = Path(__file__).parents[2] / "docs/reference/protocol.md"
CASE = named_case("c")


def load(name: str) -> Subject:
    subject = load_remote((sys.executable, str(PLAIN)), name, Limits(seconds=20))
    assert isinstance(subject, Subject), subject
    return subject


def test_the_program_shares_no_code_with_the_harness() -> None:
    nodes = [*ast.walk(ast.parse(PLAIN.read_text(encoding="utf-8")))]
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    assert names == {"msgspec", "numpy", "os", "socket", "struct", "time"}
    assert not [node for node in nodes if isinstance(node, ast.ImportFrom)]


def test_its_answers_are_those_of_the_same_plugin_here() -> None:
    near, far = (subject.for_case(CASE) for subject in (Subject("here", hostile_few.Springs), load("springs")))
    interface, batch = CASE.interface, np.array([[CASE.z, 2 * CASE.z]])
    pairings = [formulation.pair(interface, CASE.z) for formulation in (near, far)]
    assert pairings[0] == pairings[1]
    forces = [f.residual(interface, p, batch) for f, p in zip((near, far), pairings, strict=True)]
    assert np.array_equal(*forces)
    assert far.tangent(interface, pairings[1], CASE.z).shape == (CASE.z.size, CASE.z.size)
    assert np.array_equal(far.residual(interface, pairings[0], CASE.z), forces[0][0, 0])


def test_it_is_judged_as_a_formulation() -> None:
    questions = load_properties(["purity", "tangent.directional", "balance.force"])
    rows = verify([load("springs")], questions, examples=5, seed=1).rows
    verdicts = {row.property_id: row.verdict for row in rows}
    assert verdicts == {"purity": Verdict.PASS, "tangent.directional": Verdict.PASS, "balance.force": Verdict.FAIL}


def test_its_failures_are_those_of_a_plugin() -> None:
    other = load_remote((sys.executable, str(PLAIN)), "other", Limits())
    assert isinstance(other, NotLoaded)
    assert other.reason == "no such springs"
    absent = load_remote(("/no/such/program",), "springs", Limits())
    assert isinstance(absent, NotLoaded)
    assert "/no/such/program does not start" in absent.reason
    formulation = load("springs").for_case(CASE)
    with pytest.raises(PluginError, match="residual: TypeError"):
        formulation.plugin.residual(CASE.interface, None, CASE.z)


def test_the_page_names_each_message_and_its_fields() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for message in (*Request.__args__, *Reply.__args__):
        assert f'`["{message.__struct_config__.tag}", ' in page
