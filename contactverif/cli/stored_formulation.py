"""The formulation that a report names: running it runs installed code with options that a stranger may have chosen."""

from __future__ import annotations

import typer

from contactverif.contract.errors import MisuseError
from contactverif.contract.names import parse_name
from contactverif.run.registry import formulation_names


def announce_stored(name: str) -> str:
    """Say on standard error which formulation a report names, before it is loaded; return the name."""
    base, options = parse_name("REPORT", name)
    installed = formulation_names()
    for part in base.split("/"):
        if part not in installed:
            needed = "an installed one: install its plugin, or give --formulation NAME"
            raise MisuseError("REPORT", f"the formulation {part!r}, which is not installed", needed)
    listed = ", ".join(f"{option} = {value!r}" for option, value in options.items())
    typer.echo(f"the report names the formulation {base}, {listed or 'without options'}", err=True)
    return name
