"""The command `verify`: it checks every property of some formulations and shows a table, drawings and files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from contactverif.cli.output_files import PAGE, REPORT, OutputFiles, PictureFolder
from contactverif.cli.shared_options import (
    IsolationOptions,
    PlaceOptions,
    PropertyGlobs,
    SamplingOptions,
    WorkerOptions,
    complete_formulation,
)
from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.contract.counterexample import Counterexample
    from contactverif.contract.property import Property
    from contactverif.contract.result import NotLoaded, Run
    from contactverif.contract.subject import Subject
    from contactverif.isolation.limits import Limits

LINES_OF_A_PLUGIN = 5


def verify(
    *,
    names: Annotated[
        list[str] | None,
        typer.Argument(
            help="Formulations, with options: vts-ppt, vts-me:n=4, nts-ar:area=reference.",
            metavar="NAME",
            autocompletion=complete_formulation,
        ),
    ] = None,
    all_: Annotated[bool, typer.Option("--all", help="Check every installed formulation that wraps no other.")] = False,
    properties: PropertyGlobs = None,
    sampling: SamplingOptions,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            "--out", help="Write the results: FILE.nc a report, FILE.html a page. Repeatable.", metavar="FILE"
        ),
    ] = None,
    pictures: Annotated[
        Path | None, typer.Option(help="Draw each counterexample into this folder.", metavar="FOLDER")
    ] = None,
    known: Annotated[
        list[str] | None,
        typer.Option("--known", help="A known failure, with its reason. Repeatable.", metavar="ID=REASON"),
    ] = None,
    place: PlaceOptions,
    workers: WorkerOptions,
    isolation: IsolationOptions,
) -> None:
    """Check every property of a formulation: print a table, draw what fails.

    \bExit status
      0  every promise is kept, and every property was judged
      1  a promise is broken, a property could not be judged, or a plugin
         does not load
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif verify vts-ppt --out vts-ppt.nc --out vts-ppt.html
      contactverif verify nts -p 'patch.*' --seed 7
      contactverif verify mine --mesh punch.msh --slave punch --master base
      contactverif verify vts-me --scene c -p 'patch.*'
    """
    from contactverif.cli.console import show
    from contactverif.cli.counterexample_text import how_to_keep
    from contactverif.cli.progress import Bar
    from contactverif.cli.run_tables import RunTable, summary
    from contactverif.run.registry import load_formulation, load_properties, matching_ids
    from contactverif.run.runner import run
    from contactverif.run.workers import worker_pool

    limits = isolation.limits()
    names = select_names(names or [], all_, limits)
    files = OutputFiles.check(out, (REPORT, PAGE))
    folder = PictureFolder.make(pictures)
    scene = place.make_scene()
    interface = place.read_interface()
    reasons = _known_failures(known or [])
    jobs = workers.number(len(names), len(matching_ids(properties or ["*"])), sampling.planned_examples())
    with worker_pool(jobs) as executor, Bar() as bar:
        questions = load_properties(properties or ["*"])
        subjects = [load_formulation(name, limits) for name in names]
        result = run(
            subjects,
            questions,
            profile=sampling.profile or "dev",
            examples=sampling.examples,
            seed=sampling.seed,
            interface=interface,
            scene=scene,
            known=reasons,
            progress=bar.show_progress,
            executor=executor,
        )
    write_results(result, files)  # before anything is shown, so that nothing that was judged is lost
    show(RunTable(result))
    _show_counterexamples(result, subjects, questions, files, folder)
    _show_what_plugins_printed()
    files.announce()
    if REPORT not in files.names and (advice := how_to_keep(result)) is not None:
        show(advice)
    show(summary(result))
    raise typer.Exit(0 if result.promises_kept else 1)


def _show_what_plugins_printed() -> None:
    """End the processes of the plugins, and show the last lines that each of them printed."""
    from rich.text import Text

    from contactverif.cli.console import show_as_it_is
    from contactverif.isolation.host import end_all

    for name, printed in end_all().items():
        lines = printed.decode(errors="replace").splitlines()[-LINES_OF_A_PLUGIN:]
        show_as_it_is(Text("\n".join([f"the process of {name} printed, at last:", *(f"    {line}" for line in lines)])))


def write_results(result: Run, files: OutputFiles) -> None:
    """Write the report and the page that the user wants."""
    if REPORT in files.paths:
        from contactverif_reports.netcdf.write import write

        write(result, files.paths[REPORT])
    if PAGE in files.paths:
        from contactverif_reports.html.pages import write_page
        from contactverif_reports.html.report_page import report_page

        page = report_page(result, files.names.get(REPORT, Path("FILE.nc")))
        write_page(files.paths[PAGE], page, "--out")


def _show_counterexamples(
    result: Run,
    subjects: Sequence[Subject | NotLoaded],
    questions: Sequence[Property | NotLoaded],
    files: OutputFiles,
    folder: PictureFolder | None,
) -> None:
    """Print the smallest mesh of each failure, and draw it if the user named a folder."""
    from contactverif.cli.console import show_as_it_is
    from contactverif.cli.counterexample_text import counterexample_text, failing_examples

    for example in failing_examples(result):
        show_as_it_is(counterexample_text(example, files.names.get(REPORT)))
        if folder is not None:
            _draw_counterexample(example, subjects, questions, folder)


def _draw_counterexample(
    example: Counterexample,
    subjects: Sequence[Subject | NotLoaded],
    questions: Sequence[Property | NotLoaded],
    folder: PictureFolder,
) -> None:
    from contactverif.cli.case_pictures import draw_outcome
    from contactverif.cli.console import say
    from contactverif.contract.counterexample import case_id
    from contactverif.contract.property import Property
    from contactverif.contract.subject import Subject

    subject = next(item for item in subjects if isinstance(item, Subject) and item.name == example.formulation)
    question = next(item for item in questions if isinstance(item, Property) and item.id == example.property_id)
    name = f"{case_id(example.formulation, example.property_id)}.png"
    draw_outcome(subject, question, example.outcome, folder.path / name, argument="--pictures")
    say(f"    picture: {folder.name / name}")


def select_names(names: list[str], every: bool, limits: Limits | None = None) -> list[str]:
    """Return the formulations that the user named, or all of them."""
    from contactverif.run.registry import formulation_names, standalone_names

    if every and names:
        raise MisuseError("NAME", f"{', '.join(names)} and --all", "one of the two")
    if every:
        return list(standalone_names(limits))
    if not names:
        raise MisuseError("NAME", "nothing", f"--all, or some of {', '.join(formulation_names())}")
    return names


def _known_failures(texts: Sequence[str]) -> dict[str, str]:
    """Return {property: reason} of each ID=REASON."""
    reasons = {}
    for text in texts:
        property_id, _, reason = text.partition("=")
        if not (property_id and reason):
            raise MisuseError("--known", repr(text), "ID=REASON, the id of a property and why it is known to fail")
        reasons[property_id] = reason
    return reasons
