"""The errors that contactverif raises on purpose, told apart by who has to act: the caller or the author of the plugin.

An error of a caller is a `MisuseError`, whose message says what to change; an error of a plugin is a `ContractError`.
"""

from __future__ import annotations


class ContactverifError(Exception):
    """The base of all errors that contactverif raises on purpose."""


class MisuseError(ContactverifError, ValueError):
    """The caller gave something that cannot be used.

    The message reads ``argument: found …; needed …``.

    Parameters
    ----------
    argument : str
        The name of the argument, as the caller wrote it.
    found : str
        What was there.
    needed : str
        What would have been right.
    """

    def __init__(self, argument: str, found: str, needed: str) -> None:
        super().__init__(f"{argument}: found {found}; needed {needed}")
        self.argument, self.found, self.needed = argument, found, needed


class ContractError(ContactverifError):
    """The plugin broke the contract of a formulation: an answer of the wrong kind, shape or dtype.

    The contract is stated in `contactverif.contract.formulation`.
    """


class NonFiniteError(ContractError):
    """The plugin returned NaN or infinity."""


class PluginError(ContractError):
    """The plugin raised an exception, which is the `__cause__` of this error, or its process ended."""

    # Causes: "exception", "memory", "exit", "signal", "hang" (no answer in time), "channel" (no readable answer) and
    # "not asked": it has ended its process too often to be asked again. `ended`: its process has ended.
    def __init__(self, message: str, cause: str = "exception", *, ended: bool = False) -> None:
        super().__init__(message)
        self.cause, self.ended = cause, ended
