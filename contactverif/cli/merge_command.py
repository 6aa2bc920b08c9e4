"""The command `merge`: it makes the report of a campaign from the journals of all its shards."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from contactverif.api.run_files import REPORT
from contactverif.cli.audit_command import SHARE, Share, audit_report, check_share
from contactverif.cli.campaign_command import CAMPAIGN
from contactverif.cli.shared_options import RESULT_FILES, SHRINK_HELP, ScreenOptions
from contactverif.cli.verify_command import run_job
from contactverif.cli.verify_job import new_job, options_of
from contactverif.contract.errors import MisuseError
from contactverif.run.profiles import Shrink

_FOLDER = "FOLDER"


def merge(
    folder: Annotated[Path, typer.Argument(help="The folder that campaign --out made.", metavar=_FOLDER)],
    out: Annotated[list[Path], RESULT_FILES],
    shrink: Annotated[Shrink | None, typer.Option(help=SHRINK_HELP)] = None,
    audit: Annotated[
        bool, typer.Option("--audit", help="Audit the report, as for shards that strangers computed.")
    ] = False,
    share: Share = SHARE,
    *,
    screen: ScreenOptions,
) -> None:
    """Make the report of a campaign: that of one verify with the same seed.

    A share of the outcomes is judged again; a row in which one differs is
    named, and all of it is judged again. What fails is shrunk here. The
    shards stay.

    \bExit status
      as that of verify; 1 also if the audit differs; 2 also if a shard is
      missing, not finished, damaged, or of another plan: one line names it

    \bExamples
      contactverif merge runs --out nts-ar.nc --out nts-ar.html
      contactverif merge runs --out nts-ar.nc --audit --share 0.1
    """
    from contactverif.run.campaign import read_shards

    check_share(share)
    plan, journals = read_shards(folder, _FOLDER)
    options = options_of(plan, CAMPAIGN, _FOLDER)
    sampling = replace(options.sampling, shrink=shrink or options.sampling.shrink)
    files = " ".join(f"--out {shlex.quote(str(path))}" for path in out)
    job = new_job(replace(options, sampling=sampling, out=tuple(out)))
    again = f"contactverif merge {shlex.quote(str(folder))} {files}{f' --shrink {shrink}' if shrink else ''}"
    if audit and REPORT not in job.files.names:
        raise MisuseError("--audit", "no report", f"--out FILE{REPORT} beside it")
    status = run_job(replace(job, sources=journals, again=again), screen)
    if audit and job.files.paths[REPORT].exists():
        differs = audit_report(job.files.paths[REPORT], share, options.place, options.isolation)
        status = status or differs
    raise typer.Exit(status)
