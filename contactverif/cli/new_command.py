"""The command `new`: a plugin project with a formulation that passes its first run."""

from __future__ import annotations

from typing import Annotated

import typer


def new(
    name: Annotated[
        str, typer.Argument(help="The name of the formulation, of its project and of its folder.", metavar="NAME")
    ],
    *,
    jax: Annotated[
        bool, typer.Option("--jax", help="Formulations from functions of JAX, which differentiates them.")
    ] = False,
) -> None:
    """Make a project for a formulation of your own, in a folder NAME.

    The formulation in it is right: it passes its tests and keeps its
    promises. Change it step by step, and ask again. The project has a
    pyproject.toml that registers it, tests, settings of tox, and a workflow
    for GitHub.

    \bExit status
      0  made
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif new mine
      contactverif new mine --jax
    """
    from contactverif.cli.console import say
    from contactverif.cli.new_project import make_project

    files = make_project(name, jax=jax)
    say(f"{name}: {', '.join(files)}")
    say(f"next: cd {name} && pip install -e . && pytest && contactverif verify {name}")
