"""An engine as the harness sees it: a subject like a formulation, every answer checked, that solves whole scenes."""

from __future__ import annotations

from typing import Any

import numpy as np

from contactverif.contract.engine import Engine, EngineAnswer, EngineTraits, SceneArrays
from contactverif.contract.errors import ContractError, NonFiniteError, PluginError
from contactverif.contract.foreign_text import describe_error, name_line, place_of_error
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.contract.traits import PatchPromises, Promises, Rules, Traits

ENGINE = "engine/"  # The names of engines begin so wherever those of formulations stand beside them.
SOLVE = "solve"  # The one part that an engine provides; a formulation provides others.


class EngineSubject(Subject):
    """An engine as it was loaded. It has no penalty of its own: each scene says its own.

    Parameters
    ----------
    name : str
        The name as on the command line, with options.
    engine : Engine
        The engine.

    Attributes
    ----------
    engine : Engine
        The engine itself.
    engine_traits : EngineTraits
        The statements of the engine.
    traits : Traits
        The same statements, as far as formulations can state them.

    Raises
    ------
    ContractError
        If it has no ``solve``, or its ``traits`` are no `EngineTraits`.
    """

    def __init__(self, name: str, engine: Engine) -> None:
        self.name = name_line(name)
        self.engine = engine
        self.first_answers = None
        if not callable(getattr(engine, SOLVE, None)):
            raise ContractError(f"make: returned a {type(engine).__name__} without a `solve`")
        traits = getattr(engine, "traits", None)
        if not isinstance(traits, EngineTraits):
            needed = "contactverif.contract.engine.EngineTraits"
            raise ContractError(f"traits: found a {type(traits).__name__}; needed {needed}")
        self.engine_traits = traits
        self.traits = _as_traits(traits)
        self.provides = frozenset({SOLVE})
        self.counts_multipliers = False

    def with_penalty(self, penalty: float) -> CheckedFormulation:
        """Raise a ContractError: nobody can ask an engine for forces."""
        raise ContractError("an engine gives displacements alone")

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Return the checked answer of the engine to a scene.

        Raises
        ------
        PluginError
            If the engine raises an exception, or its process ends.
        ContractError
            If the answer has the wrong kind, shape or dtype.
        NonFiniteError
            If it says that it has converged, and a displacement is NaN or infinite.
        """
        answer = self._call(scene)
        if not isinstance(answer, EngineAnswer):
            raise ContractError(f"solve: returned a {type(answer).__name__}; needed an EngineAnswer")
        if flaw := answer.flaw(scene):
            raise ContractError(f"solve: {flaw}")
        if answer.converged and not np.isfinite(answer.displacements).all():
            raise NonFiniteError("solve: converged, with displacements that are not finite")
        return answer

    def _call(self, scene: SceneArrays) -> Any:
        """Return what the engine answers; whatever it raises becomes a PluginError."""
        try:
            return self.engine.solve(scene)
        except (KeyboardInterrupt, ContractError):
            raise
        except BaseException as error:  # A code may raise anything, and its mistake is a row of the report.
            kinds = ((MemoryError, "memory"), (SystemExit, "exit"))
            cause = next((word for kind, word in kinds if isinstance(error, kind)), "exception")
            raise PluginError(f"solve: {describe_error(error)}{place_of_error(error)}", cause) from error


def _as_traits(traits: EngineTraits) -> Traits:
    """Return the statements of an engine as those of a formulation that is distributed over the current length."""
    promises = Promises(
        patch=PatchPromises(flat=traits.passes_flat_patch),
        converges=traits.converges,
        independent_multipliers=True if traits.enforcement == "multiplier" else None,
    )
    # A stiffness of its own is near to none that gives way.
    enforcement = "multiplier" if traits.enforcement == "own" else traits.enforcement
    return Traits(promises, Rules(enforcement, "distributed", "current"))
