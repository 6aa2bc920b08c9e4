"""The command `merge`: it makes the report of a campaign from the journals of all its shards."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from contactverif.cli.campaign_command import CAMPAIGN
from contactverif.cli.shared_options import RESULT_FILES, SHRINK_HELP
from contactverif.cli.verify_command import run_job
from contactverif.cli.verify_job import new_job, options_of
from contactverif.run.profiles import Shrink

_FOLDER = "FOLDER"


def merge(
    folder: Annotated[Path, typer.Argument(help="The folder that campaign --out made.", metavar=_FOLDER)],
    out: Annotated[list[Path], RESULT_FILES],
    shrink: Annotated[Shrink | None, typer.Option(help=SHRINK_HELP)] = None,
) -> None:
    """Make the report of a campaign: that of one verify with the same seed.

    No case is judged again. What fails is shrunk here. The shards stay.

    \bExit status
      as that of verify; 2 also if a shard is missing, not finished, damaged,
      or of another plan: one line names it

    \bExample
      contactverif merge runs --out nts-ar.nc --out nts-ar.html
    """
    from contactverif.run.campaign import read_shards

    plan, journals = read_shards(folder, _FOLDER)
    options = options_of(plan, CAMPAIGN, _FOLDER)
    sampling = replace(options.sampling, shrink=shrink or options.sampling.shrink)
    files = " ".join(f"--out {shlex.quote(str(path))}" for path in out)
    job = new_job(replace(options, sampling=sampling, out=tuple(out)))
    again = f"contactverif merge {shlex.quote(str(folder))} {files}{f' --shrink {shrink}' if shrink else ''}"
    raise typer.Exit(run_job(replace(job, sources=journals, again=again)))
