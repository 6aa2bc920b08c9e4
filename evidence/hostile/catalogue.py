"""All hostile plugins by name, and how they come onto the path of a command: as entry points of an installed project.

A name is the kind and the function, `dies-exit-0`. The first line of the function's docstring says what it does.
"""

import importlib
import os
import sys
from dataclasses import dataclass
from pathlib import Path

sys.path += [str(Path(__file__).parent / "plugins"), str(Path(__file__).parents[1] / "trust")]

import tables

FOLDER = Path(__file__).parent / "plugins"

KINDS = {
    "dies": "hostile_deaths",
    "hangs": "hostile_hangs",
    "memory": "hostile_memory",
    "raises": "hostile_exceptions",
    "answers": "hostile_answers",
    "pairs": "hostile_pairings",
    "inputs": "hostile_inputs",
    "prints": "hostile_output",
    "process": "hostile_process",
    "leaves": "hostile_leftovers",
    "says": "hostile_messages",
    "cheats": "hostile_cheats",
    "reaches": "hostile_box",
}
# {name: (module, end, what it does)} of modules that act when they are imported, so that nobody imports them here.
AT_IMPORT = {
    "dies-at-import": ("hostile_import_exits", "caught", "End the process with status 0 when it is imported."),
    "hangs-at-import": ("hostile_import_hangs", "caught", "Sleep when it is imported."),
    "raises-at-import": ("hostile_import_raises", "caught", "Raise SystemExit with status 0 when it is imported."),
    "process-import-exits": ("hostile_import_patches", "either", "Make every later import end the process."),
}


@dataclass(frozen=True)
class HostilePlugin:
    """A hostile plugin."""

    name: str  # On the command line
    target: str  # Module and function of its factory, as an entry point names them
    ends: str  # The end that a run with it must have, of `hostile_kit`
    summary: str  # What it does, in one line
    verb: str = "import"  # The method in which it does it

    @property
    def kind(self) -> str:
        """The kind of its act."""
        return self.name.partition("-")[0]


def _plugins() -> dict[str, HostilePlugin]:
    entries = []
    for kind, module in KINDS.items():
        for function, make in vars(importlib.import_module(module)).items():
            if callable(make) and hasattr(make, "ends"):
                name = f"{kind}-{function.replace('_', '-')}"
                summary = (make.__doc__ or "").partition("\n")[0]
                entries.append(HostilePlugin(name, f"{module}:{function}", make.ends, summary, make.verb))
        entries += [
            HostilePlugin(name, f"{target}:make", ends, summary)
            for name, (target, ends, summary) in AT_IMPORT.items()
            if name.partition("-")[0] == kind
        ]
    return {entry.name: entry for entry in entries}


PLUGINS = _plugins()


def install(folder: Path, others: dict[str, str] | None = None) -> str:
    """Make all hostile plugins, or others, entry points of a project; return the PYTHONPATH that finds them."""
    targets = {plugin.name: plugin.target for plugin in PLUGINS.values()} if others is None else others
    path = [tables.install(folder, targets), str(FOLDER), os.environ.get("PYTHONPATH", "")]
    return os.pathsep.join(filter(None, path))
