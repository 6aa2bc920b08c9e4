"""The work of `bench`: speed against error, on scenes whose exact solution is known."""

import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from contactverif.api.run_files import PAGE, REPORT
from contactverif.cli.console import echo, print_plugin_output, show
from contactverif.cli.options import MARKDOWN, OutputFiles, picture_folder, select_names
from contactverif.cli.progress import Bar
from contactverif.contract.errors import MisuseError
from contactverif.isolation.confine import ONE_THREAD
from contactverif.plugins.registry import load_formulation
from contactverif.run.journal import journal_folder, remove_journal
from contactverif.run.run_options import RunOptions
from contactverif.studies.bench_cells import run_bench
from contactverif.studies.bench_plan import OTHER_DIMENSION, BenchPlan, make_plan
from contactverif_reports import bench_costs
from contactverif_reports.bench_results import BenchResults, Outcome
from contactverif_reports.files import whole
from contactverif_reports.html.bench_page import bench_markdown, bench_page
from contactverif_reports.html.pages import write_page
from contactverif_reports.netcdf.bench_file import read_bench, write_bench

_LONG_CALLS = 10  # A state of a large mesh, or all states of differences, may take so many times the limit of a call.


def bench(
    options: RunOptions,
    scene: Sequence[str],
    quick: bool,
    instances: int | None,
    processes: int | None,
    against: Path | None,
    out: Sequence[Path],
) -> int:
    """Measure formulations, or show a file of a bench again; return 1 if something became worse, else 0."""
    files, pictures = OutputFiles.check(out, (REPORT, PAGE, MARKDOWN)), picture_folder(options.pictures)
    old = read_bench(against) if against else None
    file = options.names[0] if options.names and options.names[0].lower().endswith(REPORT) else ""
    if file and (len(options.names) > 1 or options.every):
        raise MisuseError("NAME", f"{file} and more", "formulations alone, or one file of a bench")
    if file:
        results = read_bench(file)
    else:
        plan = make_plan(scene, quick=quick, instances=instances, processes=processes)
        results = _run(options, plan, files)
    since = () if old is None else bench_costs.compare_benches(results, old)
    # The files are written before anything is shown.
    if REPORT in files.paths:
        write_bench(results, files.paths[REPORT])
        remove_journal(journal_folder(files.paths[REPORT]))
    if pictures is not None:
        from contactverif_reports.plot.bench_figures import plot_bench  # It imports matplotlib, which is slow.

        plot_bench(results, pictures)
    if PAGE in files.paths:
        write_page(files.paths[PAGE], bench_page(results, since))
    if MARKDOWN in files.paths:
        name_of_report = (files.names.get(REPORT) or Path(file)).name
        with whole(files.paths[MARKDOWN]) as part:
            part.write_text(bench_markdown(results, name_of_report, pictures is not None), encoding="utf-8")
    for name in results.scenes:
        show(bench_costs.overview_table(results, name).terminal(dense=True))
    if any(results.uses_differences(name, each) for name in results.formulations for each in results.scenes):
        show("* with differences of forces where there is no tangent, or it did not help")
    for name in results.scenes:
        show("\n".join(bench_costs.cost_sentences(results, name, results.targets[name][0])))
    for name, reason in results.not_loaded.items():
        show(f"{name} is not measured: {reason}")
    if old is not None:
        sentences = [change.sentence for change in since]
        show("\n".join(sentences) or "The earlier bench has none of these formulations and cells.")
    files.announce()
    if pictures is not None:
        echo(f"pictures: {options.pictures}")
    crashed = bool((results.outcomes == Outcome.CRASHED).any())
    failed = any(not reason.startswith(OTHER_DIMENSION) for reason in results.not_loaded.values())
    return int(crashed or failed or any(change.worse for change in since))


def _run(options: RunOptions, plan: BenchPlan, files: OutputFiles) -> BenchResults:
    names, limits = select_names(options), options.limits()
    of_solution = None if limits is None else replace(limits, seconds=_LONG_CALLS * limits.seconds)
    subjects = [load_formulation(name, of_solution) for name in names]
    with Bar() as bar:
        results = run_bench(subjects, plan, output=files.paths.get(REPORT), progress=bar.update)
    print_plugin_output()
    one_thread = all(os.environ.get(name) == "1" for name in ONE_THREAD)
    facts = {"command": shlex.join(["contactverif", *sys.argv[1:]]), "threads": "1" if one_thread else "not set"}
    return replace(results, provenance={**results.provenance, **facts})
