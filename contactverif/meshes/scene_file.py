"""A scene that a Python file of the user makes: the file runs in a child process, and plain arrays come back.

Rule for the next editor: this process never imports the file, and checks every array that it gets.
"""

import importlib.util
import os
import sys
import traceback
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from contactverif.contract.errors import MisuseError
from contactverif.isolation.file_reader import ReadError, check_ordinary, limits_for, read_in_child
from contactverif.isolation.wire import PackedArray
from contactverif.mechanics.scene import Scene, pack_bodies, unpack_bodies

OPTION = "--scene-file"
_NEEDED = "FILE.py:FUNCTION, a function without arguments that returns a contactverif.Scene"
_PackedScene = tuple[dict[str, PackedArray], dict[str, PackedArray], float]  # Its bodies, facts and penalty.


def load_scene_file(text: str) -> Scene:
    """Return the scene that a function of a Python file makes, FILE.py:FUNCTION, called in a child process.

    A file that crashes, takes too long or returns something else is a `MisuseError`.
    """
    path, function = split_scene_file(text)
    try:
        packed = read_in_child(f"{__name__}:pack_scene", f"{os.path.abspath(path)}:{function}", limits_for(0))
    except ReadError as error:
        raise MisuseError(OPTION, f"{text}, which gives no scene ({error})", _NEEDED) from None
    try:
        return _unpack(msgspec.msgpack.decode(packed, type=_PackedScene))
    except MisuseError as error:
        raise MisuseError(OPTION, f"{text} with {error.argument}, which is {error.found}", error.needed) from None
    except (msgspec.DecodeError, ValueError, KeyError, IndexError, TypeError) as error:
        raise MisuseError(OPTION, f"{text} with a damaged scene ({error})", _NEEDED) from None


def split_scene_file(text: str) -> tuple[str, str]:
    """Return file and function of FILE.py:FUNCTION; the file is there."""
    path, _, function = text.rpartition(":")
    if not path or not function.isidentifier():
        raise MisuseError(OPTION, repr(text), _NEEDED)
    check_ordinary(path, OPTION, _NEEDED)
    return path, function


def digest_scene_file(text: str) -> str:
    """Return the digest of the file of FILE.py:FUNCTION, for a report: another file makes another scene."""
    path, _ = split_scene_file(text)
    return sha256(Path(path).read_bytes()).hexdigest()[:16]


def pack_scene(text: str) -> bytes:
    """Return the scene of a file and function as bytes, in a child process; whatever is wrong is a ValueError."""
    path, _, name = text.rpartition(":")
    answer = _call(path, name)
    scene = getattr(answer, "scene", answer)  # That of a `ProblemInstance`.
    if not isinstance(scene, Scene):
        raise ValueError(f"{name} returns {'nothing' if answer is None else f'a {type(answer).__name__}, no Scene'}")
    parts = pack_bodies(scene.bodies, scene.slave), scene.facts
    packed = [{key: PackedArray.pack(values, key) for key, values in part.items()} for part in parts]
    return msgspec.msgpack.encode((*packed, float(scene.penalty)))


def _call(path: str, name: str) -> Any:
    """Return what a function of a file returns; its exception becomes a ValueError with the line of the file."""
    sys.path.insert(0, os.path.dirname(path))
    spec = importlib.util.spec_from_file_location("scene_file", path)
    if spec is None or spec.loader is None:
        raise ValueError("it is no Python file, FILE.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # A dataclass of the file looks for its module here.
    try:
        spec.loader.exec_module(module)
        function = getattr(module, name, None)
        if not callable(function):
            raise ValueError(f"it has no function {name}")
        return function()
    except (Exception, SystemExit) as error:
        if isinstance(error, SyntaxError):
            raise ValueError(f"SyntaxError: {error.msg}, line {error.lineno}") from None
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
        words = ": ".join(filter(None, (type(error).__name__, str(error)))) if lines else str(error)
        raise ValueError(words + (f", line {lines[-1]}" if lines else "")) from None


def _unpack(stored: _PackedScene) -> Scene:
    packed, packed_facts, penalty = stored
    facts = {key: np.asarray(values.unpack(), dtype=np.float64) for key, values in packed_facts.items()}
    bodies, slave, master = unpack_bodies({key: values.unpack() for key, values in packed.items()})
    scene = Scene(bodies, slave, master, penalty, facts)
    if "compliance" in facts:  # Those of a uniform pressure, which no property could use otherwise
        along = (scene.interface.n_nodes,)
        shapes: dict[str, tuple[int, ...]] = {"compliance": (2,), "along": along, "direction": (2,)}
        shapes["pressure" if "pressure" in facts else "approach"] = ()
        for name, shape in shapes.items():
            values = facts.get(name)
            if values is None or values.shape != shape or not np.isfinite(values).all():
                actual = "nothing" if values is None else f"shape {values.shape} or numbers that are not finite"
                needed = f"finite numbers of shape {shape}, as `two_blocks` gives them"
                raise MisuseError(f"facts[{name!r}]", actual, needed)
    scene.case()  # It checks the interface and the penalty.
    return scene
