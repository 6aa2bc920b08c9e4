"""Scenes from Python files of the user: whatever the file does, it does it in a process of its own."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from contactverif import MisuseError, load_scene
from contactverif.isolation import file_reader
from contactverif.mechanics.scene import pack_bodies
from contactverif.meshes.scene_file import digest_scene_file, load_scene_file

FILE = """
import ctypes, os
from dataclasses import replace
import numpy as np
from contactverif import Rectangle, Scene, block, load_scene, rigid_surface

os.environ["CONTACTVERIF_SCENE_FILE_WAS_HERE"] = "1"


def scene():
    print("noise")
    return load_scene("c")


def hang():
    while True:
        pass


def crash():
    ctypes.string_at(0)


def number():
    return 3


def nothing():
    pass


def wrong():
    return {}["key"]


def leave():
    os._exit(3)


def leave_politely():
    raise SystemExit("bye")


def claim():
    return replace(load_scene("c"), facts={"compliance": np.zeros(2)})


def negative():
    punch = block(Rectangle([0, 1, 2], [0, 1], young=-1.0), contact="bottom", approach=0.1)
    return Scene((punch, rigid_surface([[3, 0], [-1, 0]])))


value = 3
"""
ENDING = r"; needed FILE.py:FUNCTION, a function without arguments that returns a contactverif\.Scene$"
WRONG = {
    "hang": r", which gives no scene \(reading it takes longer than 1 s\)",
    "crash": r", which gives no scene \(reading it crashes \(SIGSEGV\)\)",
    "number": r", which gives no scene \(number returns a int, no Scene\)",
    "nothing": r", which gives no scene \(nothing returns nothing\)",
    "wrong": r", which gives no scene \(KeyError: 'key', line 33\)",
    "leave": r", which gives no scene \(reading it ends the process with status 3\)",
    "leave_politely": r", which gives no scene \(SystemExit: bye, line 41\)",
    "negative": r", which gives no scene \(MisuseError: .*found -1\.0; needed Young's modulus > 0, line 49\)",
    "value": r", which gives no scene \(it has no function value\)",
    "absent": r", which gives no scene \(it has no function absent\)",
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "own.py"
    path.write_text(FILE)
    return path


def test_the_scene_is_that_of_the_function_and_the_file_does_not_run_here(file: Path) -> None:
    scene, expected = load_scene_file(f"{file}:scene"), load_scene("c")
    packed, there = (pack_bodies(each.bodies, each.slave) for each in (scene, expected))
    assert packed.keys() == there.keys()
    assert all(np.array_equal(packed[name], there[name]) for name in there)
    assert (scene.penalty, scene.facts.keys()) == (expected.penalty, expected.facts.keys())
    assert "scene_file" not in sys.modules
    assert "CONTACTVERIF_SCENE_FILE_WAS_HERE" not in os.environ


@pytest.mark.parametrize(("function", "message"), WRONG.items())
def test_a_file_that_gives_no_scene_is_one_line(
    file: Path, monkeypatch: pytest.MonkeyPatch, function: str, message: str
) -> None:
    if function == "hang":
        monkeypatch.setattr(file_reader, "_LEAST_SECONDS", 1.0)
    with pytest.raises(MisuseError, match=rf"^--scene-file: found \S+own\.py:{function}{message}{ENDING}") as info:
        load_scene_file(f"{file}:{function}")
    assert "\n" not in str(info.value)


def test_facts_that_no_property_can_use_are_refused(file: Path) -> None:
    with pytest.raises(MisuseError, match=r"own\.py:claim with facts\['along'\], which is nothing; needed finite num"):
        load_scene_file(f"{file}:claim")


@pytest.mark.parametrize("text", ["own.py", ":scene", "own.py:", "own.py:1x", "absent.py:scene"])
def test_a_name_of_no_function_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MisuseError, match=rf"^--scene-file: found '?{text.removesuffix(':scene') or text}.*{ENDING}"):
        load_scene_file(text)


def test_a_file_that_is_no_python_is_refused(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("def scene(:\n")
    with pytest.raises(MisuseError, match=r"gives no scene \(SyntaxError: .*, line 1\)"):
        load_scene_file(f"{tmp_path / 'own.py'}:scene")
    (tmp_path / "own.txt").write_text("x = 1\n")
    with pytest.raises(MisuseError, match=r"gives no scene \(it is no Python file, FILE\.py\)"):
        load_scene_file(f"{tmp_path / 'own.txt'}:scene")


def test_another_file_has_another_digest(file: Path) -> None:
    digest = digest_scene_file(f"{file}:scene")
    file.write_text(f"{FILE}\n")
    assert digest_scene_file(f"{file}:scene") != digest
