"""The program of an engine's process, which is started by its path in the interpreter of the code.

`python engine_worker.py MODULE:FUNCTION OPTIONS PLACES [FOLDER …]`: it makes the engine with options in JSON, and
answers scenes until its judge is gone. It finds modules in the folders too, and those that PLACES names in JSON,
{name: folder}, but nothing else beside them. Rule for the next editor: numpy and the standard library alone; of the
harness nothing that imports more.
"""

from __future__ import annotations

import importlib
import json
import os
import socket
import struct
import sys
from collections.abc import Callable
from dataclasses import asdict
from importlib.machinery import ModuleSpec, PathFinder
from time import perf_counter
from typing import Any, ClassVar

if __name__ == "__main__":  # The folder of this file holds modules of the harness, and none that engines need.
    sys.path[:1] = []
    sys.path += [folder for folder in sys.argv[4:] if folder not in sys.path]

    class Places:
        """A finder of the modules that PLACES names, each in its folder, after all others."""

        folders: ClassVar[dict[str, str]] = json.loads(sys.argv[3])

        @classmethod
        def find_spec(cls, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
            """Return where a module is, or None; what lies in a package is found as usual."""
            return PathFinder.find_spec(name, [cls.folders[name]]) if name in cls.folders else None

    sys.meta_path.append(Places)

import numpy as np

from contactverif.contract.engine import EngineAnswer, SceneArrays
from contactverif.isolation.confine import SOCKET, confine
from contactverif.isolation.plain_msgpack import decode, encode

_LENGTH = struct.Struct("<Q")
_LONGEST = 500  # Characters of the words of an error.


def main(make: Callable[[], Any]) -> None:
    """Answer the judge until it is gone."""
    confine()
    line = socket.socket(fileno=int(os.environ[SOCKET]))
    stream, engine = line.makefile("rb"), None
    while head := stream.read(_LENGTH.size):
        replies = []
        for kind, *content in decode(stream.read(*_LENGTH.unpack(head))):
            try:
                if kind == "load":
                    engine = make()
                    replies.append(["loaded", content[0], asdict(engine.traits), ["solve"]])
                elif kind == "solve":
                    replies.append(_solve(engine, *content))
            except BaseException as error:  # A code may raise anything.
                replies.append(["failure", content[0], "plugin", "exception", [f"{kind}: {_words(error)}"]])
        if replies:
            frame = encode(replies)
            line.sendall(_LENGTH.pack(len(frame)) + frame)
    os._exit(0)  # What a code wants to do at the end of its process is not waited for.


def _solve(engine: Any, question: int, arrays: dict[str, Any]) -> list[Any]:
    unpacked = {name: np.frombuffer(data, dtype).reshape(shape) for name, (dtype, shape, data) in arrays.items()}
    scene = SceneArrays.from_arrays(unpacked)
    start = perf_counter()
    answer: EngineAnswer = engine.solve(scene)
    seconds = perf_counter() - start
    names = ("displacements", "contact_forces", "pressures")
    values = {name: getattr(answer, name) for name in names if getattr(answer, name) is not None}
    packed = {name: _pack(array) for name, array in values.items()}
    return ["solved", question, packed, bool(answer.converged), int(answer.iterations), str(answer.message), seconds]


def _pack(array: Any) -> list[Any]:
    plain = np.asarray(array)
    return [plain.dtype.str, list(plain.shape), plain.tobytes()]


def _words(error: BaseException) -> str:
    trace, place = error.__traceback__, ""
    while trace is not None:
        place = f" ({os.path.basename(trace.tb_frame.f_code.co_filename)}, line {trace.tb_lineno})"
        trace = trace.tb_next
    try:
        return f"{type(error).__name__}: {error}"[:_LONGEST] + place
    except Exception:  # Its own text may raise.
        return type(error).__name__ + place


def _make() -> Any:
    module, _, function = sys.argv[1].partition(":")
    return getattr(importlib.import_module(module), function)(**json.loads(sys.argv[2]))


if __name__ == "__main__":
    main(_make)
