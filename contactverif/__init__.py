"""contactverif tells whether a contact formulation is right.

Here are the names that a plugin, a test or a script needs; scripts and documents import them from here and from
`contactverif.testing`, never from the folders below.

Rules for the next editor: each name is imported at its first use, so that ``import contactverif`` imports nothing but
the standard library. A name is public once it is in `_HOMES`, in `__all__` and in the block for type checkers; a test
compares them with its own list.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contactverif.api.report import Report
    from contactverif.api.verification import verify
    from contactverif.autodiff import from_energy, from_residual
    from contactverif.contract.body import Body
    from contactverif.contract.case import Case, Cases
    from contactverif.contract.engine import Engine, EngineAnswer, EngineTraits, SceneArrays
    from contactverif.contract.errors import ContactverifError, ContractError, MisuseError
    from contactverif.contract.formulation import (
        ContactPoints,
        Formulation,
        Handle,
        Pairing,
        ResidualOnly,
        evaluate_both,
    )
    from contactverif.contract.interface import Interface, Surface
    from contactverif.contract.property import Finding, Measurement, Outcome, Property, Quantity, Verdict
    from contactverif.contract.result import Row, Run
    from contactverif.contract.subject import CheckedFormulation, Subject
    from contactverif.contract.traits import Abilities, Evidence, PatchPromises, Promises, Rules, Traits
    from contactverif.mechanics.bodies import Placing, Rectangle, block, body_from_mesh, rigid_surface
    from contactverif.mechanics.newton import End, Trace, solve
    from contactverif.mechanics.scene import Scene
    from contactverif.meshes.mesh_file import read_interface
    from contactverif.meshes.mesh_scene import read_scene
    from contactverif.plugins.registry import load_formulation, load_properties
    from contactverif.problems.blocks import two_blocks
    from contactverif.problems.catalogue import load_scene
    from contactverif.problems.named_states import named_case
    from contactverif.problems.shrink_fit import ShrinkFit, shrink_fit
    from contactverif.run.judge import judge_case

__version__ = "0.1.0"

_HOMES = {
    "api.report": ("Report",),
    "api.verification": ("verify",),
    "autodiff": ("from_energy", "from_residual"),
    "contract.body": ("Body",),
    "contract.case": ("Case", "Cases"),
    "contract.engine": ("Engine", "EngineAnswer", "EngineTraits", "SceneArrays"),
    "contract.errors": ("ContactverifError", "ContractError", "MisuseError"),
    "contract.formulation": ("ContactPoints", "Formulation", "Handle", "Pairing", "ResidualOnly", "evaluate_both"),
    "contract.interface": ("Interface", "Surface"),
    "contract.property": ("Finding", "Measurement", "Outcome", "Property", "Quantity", "Verdict"),
    "contract.result": ("Row", "Run"),
    "contract.subject": ("CheckedFormulation", "Subject"),
    "contract.traits": ("Abilities", "Evidence", "PatchPromises", "Promises", "Rules", "Traits"),
    "mechanics.bodies": ("Placing", "Rectangle", "block", "body_from_mesh", "rigid_surface"),
    "mechanics.newton": ("End", "Trace", "solve"),
    "mechanics.scene": ("Scene",),
    "meshes.mesh_file": ("read_interface",),
    "meshes.mesh_scene": ("read_scene",),
    "plugins.registry": ("load_formulation", "load_properties"),
    "problems.blocks": ("two_blocks",),
    "problems.catalogue": ("load_scene",),
    "problems.named_states": ("named_case",),
    "problems.shrink_fit": ("ShrinkFit", "shrink_fit"),
    "run.judge": ("judge_case",),
}
_MODULE_OF = {name: f"contactverif.{module}" for module, names in _HOMES.items() for name in names}

__all__ = [
    "Abilities", "Body", "Case", "Cases", "CheckedFormulation", "ContactPoints", "ContactverifError",
    "ContractError", "End", "Engine", "EngineAnswer", "EngineTraits", "Evidence", "Finding", "Formulation",
    "Handle", "Interface", "Measurement", "MisuseError", "Outcome", "Pairing", "PatchPromises", "Placing",
    "Promises", "Property", "Quantity", "Rectangle", "Report", "ResidualOnly", "Row", "Rules", "Run", "Scene",
    "SceneArrays", "ShrinkFit", "Subject", "Surface", "Trace", "Traits", "Verdict", "block", "body_from_mesh",
    "evaluate_both", "from_energy", "from_residual", "judge_case", "load_formulation", "load_properties",
    "load_scene", "named_case", "read_interface", "read_scene", "rigid_surface", "shrink_fit", "solve",
    "two_blocks", "verify",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
