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
    in_space: Annotated[bool, typer.Option("--3d", help="A formulation on triangles in space.")] = False,
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
      contactverif new mine --3d
      contactverif new mine --fortran
    """
    from contactverif.cli.console import say
    from contactverif.cli.new_project import library_subject, make_project
    from contactverif.contract.errors import MisuseError

    options = {"--jax": ("jax", jax), "--3d": ("3d", in_space), "--c": ("c", c), "--fortran": ("f90", fortran)}
    kinds = {option: kind for option, (kind, typed) in options.items() if typed}
    if len(kinds) > 1:
        raise MisuseError("NAME", " and ".join(kinds), "one of them")
    kind = next(iter(kinds.values()), "")
    files = make_project(name, kind)
    say(f"{name}: {', '.join(files)}")
    if c or fortran:
        say(f"next: cd {name} && make && contactverif verify {library_subject(name, kind)}")
    else:
        say(f"next: cd {name} && pip install -e . && pytest && contactverif verify {name}")
