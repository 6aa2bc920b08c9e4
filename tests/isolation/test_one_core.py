"""The core that a judge shares with a plugin's process: taken after some questions, and given back."""

import os

import pytest

from contactverif.isolation import one_core

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system holds no process on a core")


def test_a_judge_is_held_after_some_questions_and_let_go_again(monkeypatch: pytest.MonkeyPatch) -> None:
    cores = os.sched_getaffinity(0)
    monkeypatch.setattr(one_core, "_QUESTIONS_FIRST", 2)
    monkeypatch.setattr(one_core, "_SECONDS_ON_A_CORE", 0.0)
    judge = one_core.Judge()
    states = []
    for _ in range(5):
        judge.ask()
        states.append((judge.core >= 0, os.sched_getaffinity(0) == ({judge.core} if judge.core >= 0 else cores)))
    judge.let_go()
    assert states == [(False, True), (False, True), (True, True), (False, True), (True, True)]
    assert os.sched_getaffinity(0) == cores
