"""`contactverif.verify` takes what a person has at hand, and says what is wrong with the rest."""

import os
import re
from collections.abc import Callable
from typing import Any

import pytest
from formulations_of_a_session import Half, Right
from subjects import load_property

from contactverif import MisuseError, Report, Subject, Verdict, load_formulation, verify
from contactverif.contract.result import NotLoaded
from contactverif.isolation import host, process

FORCES = "patch.flat.transmission"


def verdicts(formulations: Any, properties: Any = FORCES) -> dict[tuple[str, str], Verdict]:
    rows = verify(formulations, properties, examples=3, seed=1, shrink="none").rows
    return {(row.formulation, row.property_id): row.verdict for row in rows}


def make_half(*, penalty: float) -> Half:
    return Half(penalty=penalty)


@pytest.mark.parametrize(
    ("formulations", "rows"),
    [
        ("vts-ppt", {"vts-ppt": Verdict.PASS}),
        (Right, {"Right": Verdict.PASS}),
        (make_half, {"make_half": Verdict.FAIL}),
        (Right(penalty=3.0), {"Right": Verdict.PASS}),
        (Right(penalty=3.0, factor=0.5), {"Right": Verdict.FAIL}),
        (Subject("mine", Half), {"mine": Verdict.FAIL}),
        ([Right, "vts-me:n=2", Half], {"Right": Verdict.PASS, "vts-me:n=2": Verdict.FAIL, "Half": Verdict.FAIL}),
        ((item for item in (Right,)), {"Right": Verdict.PASS}),
    ],
    ids=["name", "class", "factory", "instance", "instance with an option", "subject", "list", "generator"],
)
def test_a_formulation_is_a_name_a_factory_an_instance_a_subject_or_a_list(
    formulations: Any, rows: dict[str, Verdict]
) -> None:
    assert verdicts(formulations) == {(name, FORCES): verdict for name, verdict in rows.items()}


@pytest.mark.parametrize(
    ("properties", "ids"),
    [
        (FORCES, {FORCES}),
        ("balance.*", {"balance.force", "balance.moment"}),
        (["balance.*", "*.force"], {"balance.force", "balance.moment"}),
        (load_property("mirror"), {"mirror"}),
        (["balance.force", load_property("mirror")], {"balance.force", "mirror"}),
    ],
)
def test_properties_are_names_patterns_or_objects(properties: Any, ids: set[str]) -> None:
    assert verdicts(Right, properties).keys() == {("Right", id_) for id_ in ids}


def test_without_properties_all_that_are_installed_are_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    from contactverif.api import verification

    every = [load_property("mirror"), load_property("balance.force")]
    monkeypatch.setattr(verification, "load_properties", lambda: every)
    assert verdicts(Right, None).keys() == {("Right", "mirror"), ("Right", "balance.force")}


def test_a_plugin_that_does_not_load_is_told_beside_those_that_do() -> None:
    report = verify([NotLoaded("lost", "no licence"), Right], FORCES, examples=2, seed=1)
    assert "lost: not loaded: no licence" in repr(report)
    assert not report.promises_kept


class Misspelt:
    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def residaul(self, interface: Any, pairing: Any, z: Any) -> Any:
        return z


class Fixed:
    """An instance of it cannot be made anew: it does not keep `length`."""

    def __init__(self, *, penalty: float, length: float) -> None:
        self.stiffness = penalty * length

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return z


WRONG: dict[str, tuple[Callable[[], Any], str]] = {
    "no list": (lambda: verify([]), r"formulations: found an empty list; needed a name, a class"),
    "None": (lambda: verify(None), r"formulations: found None; needed a name"),  # type: ignore[arg-type]
    "number": (lambda: verify([3]), r"formulations: found 3; needed a name"),  # type: ignore[list-item]
    "object": (lambda: verify(object()), r"formulations: found an instance of object"),  # type: ignore[arg-type]
    "name": (lambda: verify("vts-pt"), r"formulation: found 'vts-pt'; needed .* nearest: vts-ppt"),
    "property": (lambda: verify(load_property("mirror")), r"formulations: found the property mirror; needed"),
    "misspelt": (
        lambda: verify(Misspelt, FORCES),
        r"formulations: found Misspelt, which .* the nearest name is `residaul`\); needed .* factory",
    ),
    "no penalty": (lambda: verify(dict, "mirror"), r"formulations: found dict, which cannot be judged"),
    "fixed": (
        lambda: verify(Fixed(penalty=1.0, length=2.0), FORCES),
        r"formulations: found an instance of Fixed \(.*'length'\); needed the class itself, or a factory",
    ),
    "twice": (lambda: verify([Right, Right], FORCES), r"formulation: found Right 2 times; needed each of them once"),
    "no properties": (lambda: verify(Right, []), r"properties: found an empty list; needed an id or a pattern"),
    "property name": (lambda: verify(Right, "mirrors"), r"property: found 'mirrors'; needed .* nearest: mirror"),
    "no property": (lambda: verify(Right, [4]), r"properties: found 4; needed an id or a pattern"),  # type: ignore[list-item]
    "place": (lambda: verify("nts", FORCES, isolation="jail"), r"isolation: found 'jail'; needed box, landlock"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_judged_is_told_with_what_to_do(name: str) -> None:
    call, message = WRONG[name]
    with pytest.raises(MisuseError) as caught:
        call()
    assert re.search(message, str(caught.value)), caught.value


def test_the_error_of_a_class_is_the_cause() -> None:
    def make(*, penalty: float) -> Any:
        raise RuntimeError("no licence")

    with pytest.raises(
        MisuseError,
        match=r"found make, which cannot be judged \(make: RuntimeError: no licence \(test_verification\.py, line",
    ) as c:
        verify(make, FORCES)
    assert isinstance(c.value.__cause__, Exception)


def test_a_registered_name_runs_in_a_process_that_ends_with_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process, "adopt_orphans", lambda: None)  # Other tests do not expect orphans of others.
    cores = os.sched_getaffinity(0)
    report = verify(["vts-me", Right], FORCES, examples=3, seed=1, isolation="process")
    assert isinstance(report, Report)
    assert report.provenance["isolation"] == "inline; process"
    assert not host._HOSTS
    (failure,) = report.failures
    assert "force of the formulation" in failure.draw()._repr_html_()  # It is asked once more.
    assert not host._HOSTS
    assert os.sched_getaffinity(0) == cores


def test_the_place_of_the_project_is_that_of_a_name(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pyproject.toml").write_text('[tool.contactverif]\nisolation = "jail"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MisuseError, match="found 'jail'; needed box, landlock, process or inline"):
        verify("vts-me", FORCES)
    assert verify([load_formulation("vts-me")], FORCES, examples=2, seed=1).rows  # It is here already.


def test_a_name_is_no_place() -> None:
    with pytest.raises(MisuseError, match=r"place: found .*; needed an Interface or a Case: `read_interface`"):
        verify("nts", "purity", place="own.msh")  # type: ignore[arg-type]  # The mistake that is refused
