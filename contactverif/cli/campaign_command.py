"""The command `campaign`: it judges one shard of a run, and keeps its outcomes for `merge`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from contactverif.api.settings import read_settings
from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.run_endings import show_what_plugins_printed
from contactverif.cli.shared_options import (
    EngineNames,
    PropertyGlobs,
    SamplingOptions,
    formulation_argument,
    with_engines,
)
from contactverif.cli.verify_command import select_names
from contactverif.cli.verify_job import VerifyJob, VerifyOptions, new_job, say_what_was_doubted

if TYPE_CHECKING:
    from contactverif.run.campaign import Shard
    from contactverif.run.store import Plan

CAMPAIGN = "campaign"
_SEED = 0  # The seed if there is none: all shards must have the same.


def campaign(
    *,
    names: Annotated[list[str] | None, formulation_argument("Formulations, as in verify.")] = None,
    engines: EngineNames = None,
    properties: PropertyGlobs = None,
    sampling: SamplingOptions,
    shard: Annotated[str, typer.Option(help="The shard: its number from 1, and the number of all.", metavar="I/N")],
    out: Annotated[Path, typer.Option(help="The folder of all shards.", metavar="FOLDER")],
    isolation: IsolationOptions,
) -> None:
    """Judge one shard of a run, for many processes or machines.

    Each shard is a process by itself, and merge makes the report of all. A
    shard that was stopped or killed goes on where it was, and one that is
    done is skipped. Without --seed the seed is 0.

    \bExit status
      0  the shard is done, whatever merge will say of its outcomes
      1  a plugin does not load
      2  the command line is wrong, or the folder cannot be written
      130  stopped by Ctrl-C; the same command goes on

    \bExample
      contactverif campaign nts-ar --examples 100000 --shard 1/50 --out runs
      contactverif merge runs --out nts-ar.nc
    """
    from contactverif.run.campaign import Shard, open_shard
    from contactverif_reports.files import made_folder

    piece = Shard.parse(shard)
    options = VerifyOptions(
        tuple(select_names(with_engines(names, engines), False, isolation.limits())),
        tuple(properties or ()),
        sampling,
        keep_going=True,
        isolation=isolation,
    )
    job = new_job(options.with_settings(read_settings()), fresh_seed=_SEED, command=CAMPAIGN)
    plan = piece.plan(job.plan())
    made_folder(out, "--out")
    folder = out.absolute() / piece.folder
    with open_shard(folder, plan) as is_done:
        if is_done:
            typer.echo(f"shard {piece.text} is done already")
            return
        n_outcomes = _judge(piece, replace(job, hidden=(out.absolute(),)), folder, plan)
    typer.echo(f"shard {piece.text} is done: {n_outcomes} outcomes")


def _judge(shard: Shard, job: VerifyJob, folder: Path, plan: Plan) -> int:
    """Load what the job names, and judge the shard; return how many outcomes it has."""
    from contactverif.cli.progress import Bar
    from contactverif.contract.foreign_text import name_line, one_line
    from contactverif.contract.property import Property
    from contactverif.contract.result import NotLoaded
    from contactverif.contract.subject import Subject
    from contactverif.run.campaign import mark_done
    from contactverif.run.run import run_share
    from contactverif.run.store import Store

    plugins = job.load()
    items = [*plugins.subjects, *plugins.questions]
    for item in items:
        if isinstance(item, NotLoaded):
            typer.echo(f"contactverif: {name_line(item.formulation)} does not load: {one_line(item.reason)}", err=True)
            raise typer.Exit(1)
    subjects = [item for item in items if isinstance(item, Subject)]
    questions = [item for item in items if isinstance(item, Property)]
    with Bar() as bar:
        store = Store(plan, folder, [folder])
        run_share(subjects, questions, job.sampling, bar.show_progress, store, share=shard.share)
    show_what_plugins_printed()
    say_what_was_doubted(store)
    return mark_done(folder, plan)
