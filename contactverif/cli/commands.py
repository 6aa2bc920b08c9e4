"""The commands: how each is typed, and what its help says. The function of the same name in a module does the work.

Rule: this file imports nothing that takes long, because every `--help` imports it. A module is imported when it works.
"""

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from contactverif.cli.options import (
    EARLIER,
    Screen,
    Takes,
    complete_property,
    done_in,
    formulation_option,
    output_option,
)
from contactverif.cli.signals import begin_work
from contactverif.run.run_options import ISOLATION, PLACE, SAMPLING, RunOptions

Isolated = Annotated[RunOptions, Takes([ISOLATION])]
_REPORT = typer.Argument(help="A report that verify --out FILE.nc wrote.", metavar="REPORT")
ReportPath = Annotated[Path, _REPORT]
Resumed = Annotated[
    Path | None,
    typer.Option(help="Go on with what was to write FILE and was stopped.", metavar="FILE", rich_help_panel=EARLIER),
]
CaseId = Annotated[str | None, typer.Option(help="Id of a counterexample in the report.", metavar="ID")]
Share = Annotated[float, typer.Option(help="Share of the cases of each row that is judged again.", metavar="SHARE")]
_MANY = 8  # Formulations of which the number is not known yet.
_TYPED = {"names": "Formulations that load a file and may do so, such as c:file=mine.so."}


@done_in("listing")
def list_installed(
    *,
    traits: Annotated[bool, typer.Option("--traits", help="Show every promise, with its witness.")] = False,
    options: Isolated,
) -> None:
    """List the installed formulations, properties, problems and engines.

    A promise is what a formulation says of itself; verify checks it. A
    witness is a named case on which a formulation says that it fails.

    \bExit status
      0  listed

    \bExamples
      contactverif list
      contactverif list --traits
    """


def verify(
    *,
    options: Annotated[
        RunOptions,
        Takes(
            [
                *("names", "engines", "every", "properties", SAMPLING, "out", "pictures", "known", "keep_going"),
                *("exit_first", "quick", "last_failed", "memory", PLACE, "jobs", ISOLATION),
            ]
        ),
    ],
    screen: Screen,
    resume: Resumed = None,
) -> int:
    """Check every property of a formulation, and draw what fails.

    What is wrong comes first, then what is kept, in few lines. Progress goes
    to standard error.

    With --out, every outcome goes to the folder FILE.journal as soon as it is
    there, and --resume FILE goes on with a run that was stopped or killed.
    The folder goes when FILE is complete.

    What fails is kept in `.contactverif` here, and is asked first in the next
    run; it goes once it passes.

    \bExit status
      0  every promise is kept, and each could be judged
      1  a promise is broken or could not be judged, nothing was judged, or
         a plugin does not load
      2  the command line is wrong, or a file cannot be written; one line
         says what is needed
      130  stopped by Ctrl-C, or 143 by SIGTERM, after the table

    \bExamples
      contactverif verify vts-ppt --out vts-ppt.nc --out vts-ppt.html
      contactverif verify nts -p 'patch.*' --seed 7
      contactverif verify mine --mesh punch.msh --slave punch --master base
      contactverif verify vts-me --scene c -p 'patch.*'
      contactverif verify --engine control -p patch.flat.solve
      contactverif verify --resume vts-ppt.nc
      contactverif verify mine --last-failed
    """
    _start_processes(options)
    from contactverif.cli.verify import verify

    begin_work()
    return verify(options, screen, resume)


def _start_processes(options: RunOptions) -> None:
    """Start what runs beside the imports of this process: a formulation that stands alone, or the server of workers."""
    from contactverif.contract.errors import ContactverifError
    from contactverif.plugins.registry import start_loading
    from contactverif.run.worker_pool import default_jobs, start_server

    with suppress(ContactverifError):  # What is wrong is told in its turn.
        settled = options.with_settings().settle()
        n_names = len(settled.names) or _MANY  # `--all`, `--engine` and `--resume` name theirs later.
        jobs = settled.jobs or default_jobs(n_names * len(settled.properties) * settled.size.examples)
        writes = options.out or options.mesh or options.scene_file  # A box hides files that are not there yet.
        limits = settled.limits() if settled.names and not writes else None
        if limits is not None and (jobs == 1 or len(settled.names) == 1):
            start_loading(settled.names[0], limits)
        elif jobs > 1:
            start_server()


@done_in("explain")
def explain(
    *,
    name: Annotated[
        str | None,
        typer.Argument(
            help="A property, a term, a symbol or a trait.", metavar="NAME", autocompletion=complete_property
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="A report, whose numbers are put into the tolerances.", metavar="REPORT")
    ] = None,
    case: CaseId = None,
    options: Isolated,
) -> None:
    """Explain a property, a term or a trait; or list the terms.

    Of a property it says what is asked and why, the tolerance with its
    reasons, and who is known to fail. With --report come the numbers of the
    counterexamples that the report has of this property, or of one --case.

    \bExit status
      0  explained
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif explain patch.flat.nodal
      contactverif explain witness
      contactverif explain balance.force --report ppt.nc
      contactverif explain --report ppt.nc --case vts-ppt.balance.force
    """


@done_in("verify")
def campaign(
    *,
    options: Annotated[
        RunOptions,
        Takes(
            ["names", "engines", "properties", SAMPLING, "shard", "folder", ISOLATION],
            {"names": "Formulations, as in verify."},
        ),
    ],
    shard: Annotated[str, typer.Option(help="The shard: its number from 1, and the number of all.", metavar="I/N")],
    folder: Annotated[Path, typer.Option("--out", help="The folder of all shards.", metavar="FOLDER")],
) -> None:
    """Judge one shard of a run, for many processes or machines.

    Each shard is a process by itself, and merge makes the report of all. A
    shard that was stopped or killed goes on where it was, and one that is
    done is skipped. Without --seed the seed is 0.

    \bExit status
      0  the shard is done, whatever merge will say of its outcomes
      1  a plugin does not load
      2  the command line is wrong, or the folder cannot be written
      130  stopped by Ctrl-C, or 143 by SIGTERM; the same command goes on

    \bExample
      contactverif campaign nts-ar --examples 100000 --shard 1/50 --out runs
      contactverif merge runs --out nts-ar.nc
    """


@done_in("verify")
def merge(
    folder: Annotated[Path, typer.Argument(help="The folder that campaign --out made.", metavar="FOLDER")],
    out: Annotated[
        list[Path],
        output_option(
            "Write the results: FILE.nc a report, FILE.html a page, FILE.json or FILE.xml (JUnit) for other programs. "
            "Repeatable."
        ),
    ],
    *,
    options: Annotated[RunOptions, Takes(["names", "shrink", "pictures", "known", "jobs", ISOLATION], _TYPED)],
    audit: Annotated[
        bool, typer.Option("--audit", help="Audit the report, as for shards that strangers computed.")
    ] = False,
    share: Share = 0.01,
    screen: Screen,
) -> None:
    """Make the report of a campaign, as one verify would make it.

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


@done_in("compare")
def compare(
    *,
    options: Annotated[
        RunOptions,
        Takes(
            ["names", "engines", "against", "properties", SAMPLING, "out", "pictures", PLACE, "jobs", ISOLATION],
            {
                "names": "Formulations; or two reports, OLD.nc NEW.nc.",
                "pictures": "Draw the meshes on which they differ into this folder.",
            },
        ),
    ],
    against: Annotated[list[str] | None, formulation_option("The one formulation to compare with.")] = None,
    screen: Screen,
    resume: Resumed = None,
) -> None:
    """Compare formulations on the same cases, or two reports.

    Few lines say which verdicts differ, the errors and the time; -v shows all
    tables and the meshes on which they differ most.

    With --out, every outcome goes to the folder FILE.journal as soon as it is
    there, and --resume FILE goes on with a comparison that was stopped.

    A name that ends in .nc is a report. So is the name of any other file,
    unless an installed formulation has the same name.

    \bExit status, for formulations
      0  compared, and every candidate keeps its promises
      1  a candidate breaks a promise, cannot be judged or does not load.
         A candidate that is worse than the reference is a result and no
         error; promises of the reference do not count
    \bExit status, for two reports
      0  nothing got worse; being slower does not count as worse
      1  a property passed and fails now; a promise was kept and is broken
         now; an error beyond the tolerance has more than doubled; or more
         cases are undecided, or do not converge, than roundoff explains.
         Smaller changes are printed and do not count
    \bFor both
      2  the command line is wrong, or a file cannot be written; one line
         says what is needed
      130  stopped by Ctrl-C, or 143 by SIGTERM, after the table

    \bExamples
      contactverif compare mine --against vts-ppt
      contactverif compare mine nts-ar --against vts-ppt --seed 7 --out mine.html
      contactverif compare --engine calculix --against engine/control
      contactverif compare --resume mine.nc
      contactverif compare old.nc new.nc
    """


@done_in("run_screen")
def report(
    path: ReportPath,
    out: Annotated[list[Path] | None, output_option("Write FILE.html, a page; or FILE.json, FILE.xml (JUnit).")] = None,
    *,
    screen: Screen,
) -> None:
    """Show a stored report: its results here, or all of it as a page.

    The page is one file without links to other files. It can be read on a
    phone and printed. Other programs read JSON and JUnit's XML.
    Nothing is judged or solved again.

    \bExit status
      0  shown, whatever the report says
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif report vts-ppt.nc
      contactverif report vts-ppt.nc --out vts-ppt.html --out vts-ppt.xml
    """


@done_in("replay")
def replay(
    *,
    report: ReportPath,
    case: CaseId = None,
    formulation: Annotated[
        str | None, formulation_option("Judge this formulation instead of the one that failed.")
    ] = None,
    engine: Annotated[
        str | None, typer.Option(help="Judge this engine instead of the one that failed.", metavar="NAME[:OPTIONS]")
    ] = None,
    out: Annotated[
        list[Path] | None,
        output_option(
            "Draw the case to FILE.png or FILE.svg, or write one in space for ParaView to FILE.vtu. Repeatable."
        ),
    ] = None,
    options: Isolated,
) -> None:
    """Judge a stored counterexample again, or list all of them.

    A report names the formulation that failed, and this runs it. It says which
    one, with which options, before it does.

    \bExit status
      0  the case does not fail any more
      1  the case fails again
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif replay ppt.nc
      contactverif replay ppt.nc --case vts-ppt.balance.force
      contactverif replay ppt.nc --case vts-ppt.balance.force --out case.svg
      contactverif replay ppt.nc --case vts-ppt.balance.force --formulation mine
    """


@done_in("replay")
def audit(
    *,
    report: ReportPath,
    share: Share = 0.01,
    options: Annotated[RunOptions, Takes(["names", PLACE, ISOLATION], _TYPED)],
) -> None:
    """Derive all verdicts of a report again, and judge a sample again.

    All verdicts, counts and sums are derived again from the stored numbers. A
    random share of the cases of each row, at least one, all witnesses and all
    counterexamples are judged again by the formulations that are installed.
    On the same machine, with the same versions and code, numbers agree bit for
    bit. Else a value agrees within its tolerance, or to a millionth of itself.

    A report on a mesh or a scene needs the options that the run had.

    \bExit status
      0  nothing differs
      1  something differs; it is listed
      2  the command line is wrong, or the file is no report

    \bExamples
      contactverif audit vts-ppt.nc
      contactverif audit vts-ppt.nc --share 0.1
    """


@done_in("replay")
def draw(
    *,
    report: Annotated[Path | None, _REPORT] = None,
    case: CaseId = None,
    scene: Annotated[
        str | None,
        typer.Option(help="A scene instead of a report; contactverif scenes lists them.", metavar="NAME[:OPTIONS]"),
    ] = None,
    formulation: Annotated[
        list[str] | None,
        formulation_option(
            "Solve with this formulation. Repeatable. For a counterexample, by default the one that failed.",
            "--formulation",
            "-f",
        ),
    ] = None,
    out: Annotated[
        list[Path] | None,
        output_option("Draw to FILE.png or FILE.svg, or write the solved scene for ParaView to FILE.vtu. Repeatable."),
    ] = None,
    options: Isolated,
) -> None:
    """Solve a scene; draw bodies, contact pressure and residuals.

    Displacements and penetration are magnified; the figure says how much.
    Several formulations are drawn side by side, also those for which
    Newton's method did not converge. A counterexample without bodies is not
    solved: its forces are drawn.

    \bExit status
      0  drawn
      1  a formulation does not load or breaks its contract; the others are
         drawn
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif draw --scene c -f vts-ppt --out c.png --out c.vtu
      contactverif draw --scene c:degrees=30 -f nts -f vts-ppt --out both.svg
      contactverif draw ppt.nc --case vts-ppt.balance.force --out case.png
    """


@done_in("bench")
def bench(
    *,
    options: Annotated[
        RunOptions,
        Takes(
            [
                *("names", "every", "scene", "quick", "instances", "processes", "against", "out", "pictures"),
                *("jobs", ISOLATION),
            ],
            {
                "names": "Formulations, with options; or one file of a bench, FILE.nc, to show it again.",
                "every": "Take every installed formulation that wraps no other.",
                "pictures": "Draw the figures into this folder.",
            },
        ),
    ],
    scene: Annotated[
        list[str] | None, typer.Option(help="Only this scene, a problem such as wavy. Repeatable.", metavar="NAME")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Take the two coarsest meshes, five instances, two processes.")
    ] = False,
    instances: Annotated[
        int | None, typer.Option(help="Instances of each mesh, 15 by default.", metavar="N", show_default=False)
    ] = None,
    processes: Annotated[
        int | None, typer.Option(help="Processes of each formulation, 5 by default.", metavar="N", show_default=False)
    ] = None,
    against: Annotated[
        Path | None, typer.Option(help="Say what changed since this file of a bench.", metavar="OLD.nc")
    ] = None,
    out: Annotated[
        list[Path] | None,
        output_option("Write the results: FILE.nc all instances, FILE.html or FILE.md a page. Repeatable."),
    ] = None,
) -> None:
    """Measure speed against error, where the exact solution is known.

    All formulations solve the same instances of each mesh, from the same
    start. What an error costs is three numbers: the seconds of one
    evaluation in the plugin's process, linear systems, and the seconds of
    one factorisation. Runs without a solution never get there. A plugin
    may take ten times --time-limit for a call. While it runs,
    FILE.nc.journal keeps what is finished: the same command goes on where
    it was stopped.

    \bExit status
      0  measured; with --against, no count grew and nothing is slower
      1  a count grew, an evaluation is slower by its interval, or a plugin
         crashes, does not load, or poses a problem wrongly
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif bench mine vts-ppt --out mine.html
      contactverif bench --all --out bench.nc --pictures figures
      contactverif bench vts-ppt --quick --against bench.nc
      contactverif bench bench.nc --out bench.html
    """


@done_in("paper")
def paper(
    out: Annotated[str, typer.Option(help="Write to this folder; it is made if needed.", metavar="FOLDER")] = "paper",
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            "-j",
            help="Number of processes that share the work; the results are the same. (default: at most 2)",
            metavar="N",
        ),
    ] = None,
) -> None:
    """Compute the reference paper's tables and figures again.

    The paper is Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009)
    379–416. The command writes paper.html, one page with all results beside
    what the paper says; paper.nc, the numbers; and each figure as SVG. It
    takes a minute or two; one item takes half of it, so that more than two
    processes gain nothing.

    \bExit status
      0  written; the page says where the results agree with the paper
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif paper
      contactverif paper --out reports/paper
    """


@done_in("listing")
def list_scenes(
    path: Annotated[Path | None, typer.Argument(help="A mesh file instead.", metavar="FILE")] = None,
) -> None:
    """List the named scenes and their options; or what is in a mesh file.

    A scene with options is written NAME:OPTION=VALUE,OPTION=VALUE. Of a mesh
    file it lists the groups, for --slave and --master, and contact pairs.

    \bExit status
      0  listed
      2  the file cannot be read; one line says why

    \bExamples
      contactverif scenes
      contactverif scenes deck.inp
      contactverif draw --scene b -f vts-me -f vts-ppt --out b.png
      contactverif verify vts-ppt --scene c-prime:refine=4 -p 'patch.*'
    """


@done_in("new")
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
