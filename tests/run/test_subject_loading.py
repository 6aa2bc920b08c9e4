"""Workers load formulations as this process does: what loads, what does not, and what a user has mistyped."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from pathlib import Path

import pytest

from contactverif.contract.errors import MisuseError
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import code_files, note_code_files, places
from contactverif.plugins.registry import load_subject
from contactverif.run.scheduler import begin_loading
from contactverif.run.worker_pool import worker_pool

LIMITS = Limits()


@pytest.fixture(scope="module")
def executor() -> Iterator[Executor | None]:
    with worker_pool(2) as pool:
        yield pool


def test_a_worker_loads_what_this_process_loads(executor: Executor) -> None:
    (loader,) = begin_loading(["vts-me:n=4"], LIMITS, executor)
    there, here = loader(), load_subject("vts-me:n=4", LIMITS)
    assert isinstance(there, Subject)
    assert isinstance(here, Subject)
    assert (there.name, there.traits, there.provides) == (here.name, here.traits, here.provides)


def test_the_compiled_code_of_a_workers_plugin_is_in_the_report(executor: Executor) -> None:
    (loader,) = begin_loading(["sts"], LIMITS, executor)
    subject = loader()
    assert isinstance(subject, Subject)
    assert any("numba" in str(file) for file in code_files(subject))
    note_code_files(subject, [*code_files(subject), Path(__file__)])  # This process may run the others, too.
    assert Path(__file__).name in places([subject])["libraries"]


def test_a_mistyped_name_is_the_users_mistake_and_the_others_load(executor: Executor) -> None:
    wrong, right = begin_loading(["vts-me:n=four", "nts"], LIMITS, executor)
    with pytest.raises(MisuseError, match="option n of 'vts-me:n=four'") as there:
        wrong()
    with pytest.raises(MisuseError) as here:
        load_subject("vts-me:n=four", LIMITS)
    assert str(there.value) == str(here.value)
    assert isinstance(right(), Subject)


def test_a_wrapper_without_a_formulation_is_told_as_here(executor: Executor) -> None:
    (loader,) = begin_loading(["two-pass"], LIMITS, executor)
    with pytest.raises(MisuseError, match="two-pass/NAME"):
        loader()


def test_what_does_not_load_says_why(executor: Executor) -> None:
    (loader,) = begin_loading(["nts"], Limits(memory=1), executor)
    assert isinstance(loader(), NotLoaded)
