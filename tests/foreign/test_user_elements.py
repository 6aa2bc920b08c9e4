"""User elements of Abaqus and FEAP: right ones are what ours are, wrong writes are named, crashes are contained."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contactverif import MisuseError, load_formulation, named_case
from contactverif.contract.errors import ContractError, NonFiniteError, PluginError
from contactverif.isolation.host import end_all
from contactverif.isolation.limits import Limits
from foreign.comparison import CASES, Build, agree, compare, ring_case, subject_of

OFFSET, SOURCE = named_case("offset-c"), Path(__file__).with_name("wrong_writes.f90")


@pytest.mark.parametrize("name", CASES)
def test_a_uel_is_what_nts_is(name: str, build: Build) -> None:
    compare(f"uel:file={build('nts_uel.f90')},nodes=3", "nts", named_case(name))


@pytest.mark.parametrize("name", CASES)
def test_an_element_of_feap_is_what_nts_is(name: str, build: Build) -> None:
    compare(f"feap:file={build('nts_feap.f90')},number=7", "nts", named_case(name))


def test_a_closed_master_has_no_free_end(build: Build) -> None:
    compare(f"uel:file={build('nts_uel.f90')}", "nts", ring_case())


@pytest.mark.parametrize("name", ["a1", "b", "c-prime", "tilted"])
def test_segments_that_overlap_give_the_forces_of_sts(name: str, build: Build) -> None:
    """Compare where every gap is closed, so that two points and three integrate the same."""
    case = named_case(name)
    mine, ours = (
        subject_of(text).with_penalty(case.penalty).residual(case.interface, None, case.z)
        for text in (f"uel:file={build('sts_uel.f90')},nodes=4", "sts")
    )
    agree(mine, ours)


@pytest.fixture
def ask(build: Build) -> Iterator[Callable[..., Any]]:
    """Return a function that asks an element with a fault, the first of `props`, for its forces; then end all."""

    def residual(options: str, limits: Limits | None = None) -> Any:
        checked = subject_of(f"uel:file={build('wrong_writes.f90')},{options}", limits).for_case(OFFSET)
        return checked.residual(OFFSET.interface, None, OFFSET.z)

    yield residual
    end_all()


def test_an_element_of_chains_knows_their_sizes(ask: Callable[..., Any]) -> None:
    n_slave, n_nodes = OFFSET.interface.n_slave_nodes, OFFSET.interface.n_nodes
    assert ask("nodes=n,props=12")[:6].tolist() == [n_slave, n_nodes - n_slave, 0, 0, n_nodes, 1]


def test_the_traits_beside_a_library_are_its_own(build: Build) -> None:
    subject = subject_of(f"uel:file={build('nts_uel.f90')}")
    assert subject.traits.rules.penalty == "nodal"
    assert subject.traits.promises.symmetric
    assert subject.traits.witness("patch.flat.solve") == "a1"


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (1, "number 5 of SVARS, which has 4"),
        (2, "number 37 of AMATRX, which has 36, 6 × 6"),
        (3, "the input COORDS, number 6 of 6"),
        (7, "the place before SVARS"),
        (8, "the input NNODE"),
        (11, "number 5 of JPROPS, which has 4"),
        (5, "set PNEWDT to 0.25"),
    ],
)
def test_a_wrong_write_is_named_with_array_and_element(wrong: int, message: str, ask: Callable[..., Any]) -> None:
    with pytest.raises(ContractError) as error:
        ask(f"svars=4,props={wrong}")
    assert message in str(error.value)
    assert "uel: element 2 (nodes 1, " in str(error.value)


def test_what_reads_behind_an_array_shows(ask: Callable[..., Any]) -> None:
    with pytest.raises(NonFiniteError, match=r"element 2 .* of RHS is not finite; is an array read past its end"):
        ask("props=9")


def test_state_variables_are_zero_before_each_call(ask: Callable[..., Any]) -> None:
    forces = [ask("svars=4,props=10") for _ in range(2)]
    assert np.count_nonzero(forces[0]) == 1
    assert (forces[0] == forces[1]).all()


@pytest.mark.parametrize(
    ("options", "limits", "cause", "words"),
    [
        ("svars=4,props=4", Limits(), "signal", "ended its process"),
        ("svars=4,props=6", Limits(), "exit", "its process ended with status 3: STOP 3"),
        ("props=13", Limits(seconds=2.0), "hang", r"an endless loop\? \(--time-limit\)"),
    ],
)
def test_a_crash_or_a_hang_ends_the_process_of_the_plugin_alone(
    options: str, limits: Limits, cause: str, words: str, ask: Callable[..., Any]
) -> None:
    with pytest.raises(PluginError, match=words) as error:
        ask(options, limits)
    assert error.value.cause == cause


def test_a_relative_path_is_that_of_the_working_folder(build: Build, monkeypatch: pytest.MonkeyPatch) -> None:
    library = build("nts_uel.f90")
    monkeypatch.chdir(library.parent)
    try:
        assert subject_of(f"uel:file={library.name}", Limits()).traits.promises.symmetric
    finally:
        end_all()


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ("file=nowhere/lib.so", ["option file: found no such file: ", "nowhere/lib.so", "needed a shared library"]),
        ("file=.", ["found a folder"]),
        ("nodes=4", ["no file", "file=PATH"]),
        ("nts.so", ["'nts.so'", "needed uel:file=PATH"]),
        ("file={source}", ["this is source text: gfortran -shared -fPIC -o wrong_writes.so wrong_writes.f90"]),
        ("file={uel},nodes=5", ["option nodes: found 5", "3, 4, n"]),
        ("file={uel},svars=-1", ["svars: found -1"]),
        ("file={uel},props=a:2", ["option props: found 'a:2'", "such as 0.3:2"]),
        ("file={uel},node=4", ["'node'", "nearest: nodes"]),
        ("file={toml}", ["option file", "needed a shared library for this machine"]),
        ("file={uel},traits=nowhere.toml", ["nowhere.toml", "a TOML file with traits"]),
        ("file={feap}", ["nts_feap.so without the function uel_", "one of uel_, uel, UEL"]),
    ],
)
def test_what_the_user_wrote_wrong_is_one_line(options: str, parts: list[str], build: Build) -> None:
    library = build("nts_uel.f90")
    text = options.format(uel=library, feap=build("nts_feap.f90"), toml=library.with_suffix(".toml"), source=SOURCE)
    with pytest.raises(MisuseError) as error:
        load_formulation(f"uel:{text}")
    assert "\n" not in str(error.value)
    for part in parts:
        assert part in str(error.value)


def test_the_number_of_an_element_of_feap_is_checked(build: Build) -> None:
    with pytest.raises(MisuseError, match=r"option number: found 100; needed a whole number from 1 to 99"):
        load_formulation(f"feap:file={build('nts_feap.f90')},number=100")
    with pytest.raises(MisuseError, match="without the function elmt01_"):
        load_formulation(f"feap:file={build('nts_feap.f90')}")


def test_a_library_that_needs_the_solver_is_refused_with_its_reason(build: Build) -> None:
    with pytest.raises(MisuseError, match=r"undefined symbol: xit_; needed a stub of it, such as: subroutine xit; "):
        load_formulation(f"uel:file={build('needs_solver.f90')}")
