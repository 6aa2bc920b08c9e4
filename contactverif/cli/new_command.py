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
    c: Annotated[bool, typer.Option("--c", help="A formulation in C, a library that is built by make.")] = False,
    fortran: Annotated[
        bool, typer.Option("--fortran", help="A formulation in Fortran, a user element of Abaqus (UEL).")
    ] = False,
) -> None:
    """Make a project for a formulation of your own, in a folder NAME.

    The formulation in it is right: it passes its tests and keeps its
    promises. Change it step by step, and ask again. The project has a
    pyproject.toml that registers it, tests, settings of tox, and a workflow
    for GitHub. One of C or Fortran has a Makefile and tests.

    \bExit status
      0  made
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif new mine
      contactverif new mine --jax
      contactverif new mine --fortran
    """
    from contactverif.cli.console import say
    from contactverif.cli.new_project import library_subject, make_project
    from contactverif.contract.errors import MisuseError

    kinds = {"--jax": jax, "--c": c, "--fortran": fortran}
    if sum(kinds.values()) > 1:
        raise MisuseError("NAME", " and ".join(kind for kind, typed in kinds.items() if typed), "one of them")
    language = "c" if c else "f90" if fortran else ""
    files = make_project(name, jax=jax, language=language)
    say(f"{name}: {', '.join(files)}")
    if language:
        say(f"next: cd {name} && make && contactverif verify {library_subject(name, language)}")
    else:
        say(f"next: cd {name} && pip install -e . && pytest && contactverif verify {name}")
