"""The two ways in which things go wrong, told apart by whose fault it is: the caller's or the plugin's."""

from __future__ import annotations


class ContactverifError(Exception):
    """Base of all errors that contactverif raises on purpose."""


class MisuseError(ContactverifError, ValueError):
    """The caller gave something that cannot be used.

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
    """The plugin broke the contract of `contactverif.contract.formulation`: wrong shape, wrong dtype, wrong kind."""


class NonFiniteError(ContractError):
    """The plugin returned a NaN or an infinity."""


class PluginError(ContractError):
    """The plugin raised an exception; it is the `__cause__`."""
