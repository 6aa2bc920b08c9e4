"""contactverif tells whether a contact formulation is right.

Here are the names that a plugin, a test or a script needs; scripts and documents import them from here and from
`contactverif.testing`, never from the folders below.

Rules for the next editor: each name is imported at its first use, so that ``import contactverif`` imports nothing but
the standard library. A name is public once it is in `_HOMES` and in the block for type checkers; a test compares both
with its own list.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # A name that is imported as itself is one that the package exports.
    from contactverif.api.report import Report as Report
    from contactverif.api.verification import verify as verify
    from contactverif.autodiff import from_energy as from_energy
    from contactverif.autodiff import from_residual as from_residual
    from contactverif.contract.body import Body as Body
    from contactverif.contract.case import Case as Case
    from contactverif.contract.case import Cases as Cases
    from contactverif.contract.engine import Engine as Engine
    from contactverif.contract.engine import EngineAnswer as EngineAnswer
    from contactverif.contract.engine import EngineTraits as EngineTraits
    from contactverif.contract.engine import SceneArrays as SceneArrays
    from contactverif.contract.errors import ContactverifError as ContactverifError
    from contactverif.contract.errors import ContractError as ContractError
    from contactverif.contract.errors import MisuseError as MisuseError
    from contactverif.contract.formulation import ContactPoints as ContactPoints
    from contactverif.contract.formulation import Formulation as Formulation
    from contactverif.contract.formulation import Handle as Handle
    from contactverif.contract.formulation import Pairing as Pairing
    from contactverif.contract.formulation import ResidualOnly as ResidualOnly
    from contactverif.contract.formulation import evaluate_both as evaluate_both
    from contactverif.contract.interface import Interface as Interface
    from contactverif.contract.interface import Surface as Surface
    from contactverif.contract.measurement import Finding as Finding
    from contactverif.contract.measurement import Measurement as Measurement
    from contactverif.contract.measurement import Quantity as Quantity
    from contactverif.contract.property import Outcome as Outcome
    from contactverif.contract.property import Property as Property
    from contactverif.contract.property import Verdict as Verdict
    from contactverif.contract.result import Row as Row
    from contactverif.contract.result import Run as Run
    from contactverif.contract.subject import CheckedFormulation as CheckedFormulation
    from contactverif.contract.subject import Subject as Subject
    from contactverif.contract.traits import Abilities as Abilities
    from contactverif.contract.traits import Evidence as Evidence
    from contactverif.contract.traits import PatchPromises as PatchPromises
    from contactverif.contract.traits import Promises as Promises
    from contactverif.contract.traits import Rules as Rules
    from contactverif.contract.traits import Traits as Traits
    from contactverif.mechanics.bodies import Placing as Placing
    from contactverif.mechanics.bodies import Rectangle as Rectangle
    from contactverif.mechanics.bodies import block as block
    from contactverif.mechanics.bodies import body_from_mesh as body_from_mesh
    from contactverif.mechanics.bodies import rigid_surface as rigid_surface
    from contactverif.mechanics.newton import End as End
    from contactverif.mechanics.newton import Trace as Trace
    from contactverif.mechanics.newton import solve as solve
    from contactverif.mechanics.scene import Scene as Scene
    from contactverif.meshes.mesh_file import read_interface as read_interface
    from contactverif.meshes.mesh_scene import read_scene as read_scene
    from contactverif.plugins.registry import load_formulation as load_formulation
    from contactverif.plugins.registry import load_properties as load_properties
    from contactverif.problems.blocks import two_blocks as two_blocks
    from contactverif.problems.catalogue import load_scene as load_scene
    from contactverif.problems.named_states import named_case as named_case
    from contactverif.problems.shrink_fit import ShrinkFit as ShrinkFit
    from contactverif.problems.shrink_fit import shrink_fit as shrink_fit
    from contactverif.run.judge import judge_case as judge_case

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
    "contract.measurement": ("Finding", "Measurement", "Quantity"),
    "contract.property": ("Outcome", "Property", "Verdict"),
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

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
