"""The command `list`: what is installed."""

from __future__ import annotations

from typing import Annotated

import typer

from contactverif.cli.shared_options import IsolationOptions


def list_installed(
    *,
    traits: Annotated[bool, typer.Option("--traits", help="Show every promise, with its witness.")] = False,
    isolation: IsolationOptions,
) -> None:
    """List the installed formulations with their promises, and the properties.

    A promise is what a formulation says of itself; verify checks it. A
    witness is a named case on which a formulation says that it fails.

    \bExit status
      0  listed

    \bExamples
      contactverif list
      contactverif list --traits
    """
    from contactverif.cli.console import show
    from contactverif.cli.listing_tables import formulations_table, properties_table
    from contactverif.run.registry import load_formulations, load_properties

    show(formulations_table(load_formulations(isolation.limits()), every_trait=traits))
    show(properties_table(load_properties()))
