"""The command line. It knows everything and is imported by nobody; what takes long to import is imported when asked."""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from contactverif.contract.errors import ContactverifError, MisuseError

if TYPE_CHECKING:
    from contactverif.contract.case import Case
    from contactverif.contract.interface import Interface

app = typer.Typer(
    help="Tells whether a contact formulation is right: random interfaces, exact answers, shrunk failures.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

# What deeper modules call a thing, and how it is called on the command line.
_OPTIONS = {name: f"--{name}" for name in ("examples", "seed", "profile")} | {"known failure": "--known"}

PROFILE_HELP = "dev: 100 examples, a fresh seed. ci: 100 examples, seed 0. nightly: 2000 examples, a fresh seed."


@app.command("list")
def list_(
    traits: Annotated[bool, typer.Option("--traits", help="Show every promise, with its witness.")] = False,
) -> None:
    """List the installed formulations with what they promise, and the properties that ask for it."""
    from contactverif.cli.run_tables import formulations_table, properties_table, show
    from contactverif.run.registry import load_formulations, load_properties

    show(formulations_table(load_formulations(), every_trait=traits))
    show(properties_table(load_properties()))


@app.command()
def verify(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Formulations, with options: vts-ppt, vts-me:n=4, nts-ar:area=reference.", metavar="NAME"),
    ] = None,
    all_: Annotated[bool, typer.Option("--all", help="Every installed formulation that wraps no other.")] = False,
    properties: Annotated[
        list[str] | None,
        typer.Option("--property", "-p", help="Only properties whose id matches; repeatable.", metavar="GLOB"),
    ] = None,
    examples: Annotated[int | None, typer.Option(help="Random cases a property.")] = None,
    seed: Annotated[int | None, typer.Option(help="The same seed gives the same cases.")] = None,
    profile: Annotated[str, typer.Option(help=PROFILE_HELP)] = "dev",
    report: Annotated[Path | None, typer.Option(help="Write all that was found to this netCDF file.")] = None,
    pictures: Annotated[
        Path | None, typer.Option(help="Draw each counterexample into this folder.", metavar="FOLDER")
    ] = None,
    known: Annotated[
        list[str] | None,
        typer.Option("--known", help="A failure that is known, with its reason; repeatable.", metavar="ID=REASON"),
    ] = None,
    mesh: Annotated[
        Path | None, typer.Option(help="Ask on the interface of this mesh, with random states.", metavar="FILE")
    ] = None,
    slave: Annotated[
        str | None, typer.Option(help="Physical group of line elements that is the slave.", metavar="TAG")
    ] = None,
    master: Annotated[
        str | None, typer.Option(help="Physical group of line elements that is the master.", metavar="TAG")
    ] = None,
    flip: Annotated[bool, typer.Option("--flip", help="Exchange inside and outside of the mesh's surfaces.")] = False,
    scene: Annotated[
        str | None, typer.Option(help="Ask on this scene: c, c:refine=2,penalty=1e4.", metavar="NAME[:OPTIONS]")
    ] = None,
) -> None:
    """Ask every property of a formulation; print a table, draw what failed, write a report.

    \bExit status
      0  nothing failed that was promised, nothing passed that was said to
         fail, and every property was judged
      1  otherwise
      2  something was asked that cannot be

    \bExamples
      contactverif verify vts-ppt --report vts-ppt.nc
      contactverif verify nts -p 'patch.*' --seed 7
      contactverif verify mine --mesh punch.msh --slave punch --master base
      contactverif verify vts-me --scene c -p 'patch.*'
    """
    from contactverif.cli.drawing import draw_case
    from contactverif.cli.progress import Bar
    from contactverif.cli.run_tables import RunTable, counterexample, how_to_keep, show, show_as_it_is, summary
    from contactverif.contract.subject import Subject
    from contactverif.run.registry import load_formulation, load_properties
    from contactverif.run.runner import run
    from contactverif_reports.files import made_folder
    from contactverif_reports.netcdf.write import check_writable, write

    names = _chosen(names or [], all_)
    if report is not None:
        check_writable(report)
    if pictures is not None:
        made_folder(pictures, "--pictures")
    target, folder = (path and path.absolute() for path in (report, pictures))  # a plugin may change where we are
    chosen = _scene(scene, mesh)
    interface = _interface(mesh, slave, master, flip)
    questions = load_properties(properties or ["*"])
    subjects = [load_formulation(name) for name in names]
    reasons = dict(_reason(text) for text in known or [])
    with Bar() as bar:
        found = run(
            subjects,
            questions,
            profile=profile,
            examples=examples,
            seed=seed,
            interface=interface,
            scene=chosen,
            known=reasons,
            progress=bar.told,
        )
    if target is not None:  # before anything is shown, so that nothing that was judged is lost
        write(found, target)
    drawn = {subject.name: subject for subject in subjects if isinstance(subject, Subject)}
    show(RunTable(found))
    for row in found.rows:
        text = counterexample(row, report)
        if text:
            show_as_it_is(text)
            if pictures is not None and folder is not None:
                outcome = row.shrunk or row.witness
                assert outcome is not None
                name = f"{_file_name(row.formulation, row.question.id)}.png"
                draw_case(drawn[row.formulation], row.question, outcome, folder / name)
                typer.echo(f"    picture: {pictures / name}")
    if report is not None:
        typer.echo(f"report: {report}")
    elif (advice := how_to_keep(found)) is not None:
        show(advice)
    show(summary(found))
    raise typer.Exit(0 if found.passed else 1)


@app.command()
def compare(
    names: Annotated[
        list[str] | None, typer.Argument(help="Formulations; or two reports, OLD.nc NEW.nc.", metavar="NAME")
    ] = None,
    against: Annotated[
        list[str] | None, typer.Option(help="The formulation to compare with, one.", metavar="NAME")
    ] = None,
    properties: Annotated[
        list[str] | None,
        typer.Option("--property", "-p", help="Only properties whose id matches; repeatable.", metavar="GLOB"),
    ] = None,
    examples: Annotated[int | None, typer.Option(help="Random cases a property.")] = None,
    seed: Annotated[int | None, typer.Option(help="The same seed gives the same cases.")] = None,
    profile: Annotated[str | None, typer.Option(help=f"{PROFILE_HELP} By default dev.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write all that was found to this netCDF file.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write one page with tables and pictures.", metavar="FILE")] = None,
    pictures: Annotated[
        Path | None, typer.Option(help="Draw the meshes on which they differ into this folder.", metavar="FOLDER")
    ] = None,
    mesh: Annotated[
        Path | None, typer.Option(help="Ask on the interface of this mesh, with random states.", metavar="FILE")
    ] = None,
    slave: Annotated[str | None, typer.Option(help="Its slave, as of verify.", metavar="TAG")] = None,
    master: Annotated[str | None, typer.Option(help="Its master.", metavar="TAG")] = None,
    flip: Annotated[bool, typer.Option("--flip", help="Exchange inside and outside of the mesh's surfaces.")] = False,
    scene: Annotated[
        str | None, typer.Option(help="Ask on this scene: c, c:refine=2,penalty=1e4.", metavar="NAME[:OPTIONS]")
    ] = None,
) -> None:
    """Compare formulations with a reference, on the same cases; or an old report with a new one.

    An argument that ends in .nc, or is a file, is a report.

    \bExit status, of formulations
      0  compared, and every candidate does what it promises
      1  a candidate breaks a promise, cannot be judged or does not load,
         as of verify; being worse than the reference is a result, no error,
         and the reference itself is not on trial
    \bExit status, of two reports
      0  nothing got worse; being slower is not worse
      1  something passed and does not any more, kept a promise and does not,
         its error beyond the tolerance more than doubled, or more cases are
         not judged or do not converge than roundoff can explain; what is only
         worth a look is told, and is no 1
    \bOf either
      2  something was asked that cannot be

    \bExamples
      contactverif compare mine --against vts-ppt
      contactverif compare mine nts-ar --against vts-ppt --seed 7 --html mine.html
      contactverif compare old.nc new.nc
    """
    from contactverif.cli.comparing import Asked, compare_formulations, compare_reports, reports_in

    paths = reports_in(names or [])
    asked = Asked(
        against=_only("--against", against or []),
        profile=profile,
        examples=examples,
        seed=seed,
        interface=_interface(mesh, slave, master, flip),
        scene=_scene(scene, mesh),
        report=report,
        pictures=pictures,
    )
    if paths:
        raise typer.Exit(0 if compare_reports(paths, properties or [], html, asked) else 1)
    raise typer.Exit(0 if compare_formulations(names or [], properties or [], html, asked) else 1)


@app.command()
def report(
    path: Annotated[Path, typer.Argument(help="A report that verify --report wrote.", metavar="REPORT")],
    html: Annotated[
        Path | None, typer.Option(help="Write one page with tables, distributions and pictures.", metavar="FILE")
    ] = None,
) -> None:
    """Show a stored report: its table here, or all of it as a page.

    The page needs nothing but itself, reads on a phone and prints. Nothing
    is judged or solved again.

    \bExit status
      0  shown, whatever the report says
      2  something was asked that cannot be

    \bExamples
      contactverif report vts-ppt.nc
      contactverif report vts-ppt.nc --html vts-ppt.html
    """
    from contactverif.cli.run_tables import StoredTable, show, stored_summary
    from contactverif_reports.netcdf.stored import read_report

    if html is None:
        stored = read_report(path)
        show(StoredTable(stored))
        show(stored_summary(stored))
        return
    from contactverif_reports.html.pages import check_page, write_page
    from contactverif_reports.html.report_page import report_page

    check_page(html)
    write_page(html, report_page(read_report(path)))
    typer.echo(f"page: {html}")


@app.command()
def replay(
    report: Annotated[Path, typer.Argument(help="A report that verify --report wrote.", metavar="REPORT")],
    case: Annotated[
        str | None, typer.Option(help="Id of a counterexample; without it the ids are listed.", metavar="ID")
    ] = None,
    formulation: Annotated[
        str | None,
        typer.Option(help="Judge this formulation on the case instead of the one that failed.", metavar="NAME"),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the case to this file, .png or .svg.", metavar="FILE")
    ] = None,
) -> None:
    """Judge one stored counterexample again, with a picture.

    \bExit status
      0  it does not fail any more
      1  it fails again
      2  something was asked that cannot be

    \bExamples
      contactverif replay ppt.nc
      contactverif replay ppt.nc --case vts-ppt.balance.force
      contactverif replay ppt.nc --case vts-ppt.balance.force --picture it.svg
      contactverif replay ppt.nc --case vts-ppt.balance.force --formulation mine
    """
    from contactverif.cli.drawing import draw_case
    from contactverif.cli.run_tables import replayed, show
    from contactverif.contract.property import Verdict
    from contactverif.run.one_case import judged, the_formulation, the_property
    from contactverif_reports.draw import as_text
    from contactverif_reports.netcdf.read import case_ids, read_case

    if case is None:
        ids = case_ids(report)
        typer.echo("\n".join(ids) if ids else "no counterexamples: nothing failed")
        return
    stored = read_case(report, case)
    subject = the_formulation(formulation or stored.formulation)
    question = the_property(stored.property_id)
    outcome = judged(question, stored.case, subject)
    if picture is not None:  # before anything is printed, in case it cannot be written
        draw_case(subject, question, outcome, picture)
    typer.echo(as_text(stored.case))
    show(replayed(stored, subject.name, outcome))
    if picture is not None:
        typer.echo(f"picture: {picture}")
    raise typer.Exit(1 if outcome.verdict in (Verdict.FAIL, Verdict.CRASHED) else 0)


@app.command()
def draw(
    report: Annotated[
        Path | None, typer.Argument(help="A report that verify --report wrote.", metavar="REPORT")
    ] = None,
    case: Annotated[str | None, typer.Option(help="Id of a counterexample of the report.", metavar="ID")] = None,
    scene: Annotated[
        str | None, typer.Option(help="A scene instead; `contactverif scenes` lists them.", metavar="NAME[:OPTIONS]")
    ] = None,
    formulation: Annotated[
        list[str] | None,
        typer.Option(
            "--formulation", "-f", help="Who solves it, repeatable; of a case: who failed it.", metavar="NAME"
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Draw to this file, .png or .svg.", metavar="FILE")] = None,
    vtu: Annotated[Path | None, typer.Option(help="Write the solved scene for ParaView, .vtu.", metavar="FILE")] = None,
) -> None:
    """Solve a scene and draw it: deformed bodies, contact pressure, residuals.

    Displacements and penetration are magnified; the figure says how much.
    Several formulations come side by side, those that did not converge too.
    A counterexample without bodies is drawn with its forces, as it stands.

    \bExit status
      0  drawn
      1  a formulation could not be asked; the others are drawn
      2  something was asked that cannot be

    \bExamples
      contactverif draw --scene c -f vts-ppt --out c.png --vtu c.vtu
      contactverif draw --scene c:degrees=30 -f nts -f vts-ppt --out both.svg
      contactverif draw ppt.nc --case vts-ppt.balance.force --out it.png
    """
    from contactverif.cli import drawing

    targets = drawing.Targets(out, vtu)
    raise typer.Exit(0 if drawing.draw(report, case, scene, formulation or [], targets) else 1)


@app.command()
def paper(
    out: Annotated[str, typer.Option(help="Folder to write to, made if it is not there.", metavar="FOLDER")] = "paper",
) -> None:
    """Compute the reference paper's tables and figures again, beside what it says.

    Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416.
    Writes paper.html, one page with all of it; paper.nc, the numbers; and
    each figure as SVG. Takes a minute or two.

    \bExit status
      0  written; whether it agrees is what the page says
      2  something was asked that cannot be

    \bExamples
      contactverif paper
      contactverif paper --out reports/paper
    """
    from contactverif_paper.paper_page import N_FIGURES, check_folder, summary, write

    if not out:  # as of a variable of the shell that is not set
        raise MisuseError("--out", "''", "the name of a folder")
    folder = Path(out).absolute()  # a plugin may change where we are
    check_folder(folder)  # before what computes is imported, which takes its time
    from contactverif.cli.progress import Bar
    from contactverif_paper import compute, steps

    done, planned = 0, steps() + N_FIGURES
    with Bar() as bar:

        def told(what: str) -> None:
            nonlocal done
            bar.at(what, done, max(planned, done))
            done += 1

        found = compute(told)
        written = write(found, folder, told)
    typer.echo(summary(found))
    typer.echo(f"{len(written)} files in {out}, to begin with: {Path(out) / written[-1].name}")


@app.command()
def scenes() -> None:
    """List the scenes that have a name, with drawings, and their options.

    A scene with options is written NAME:OPTION=VALUE,OPTION=VALUE.

    \bExit status
      0  listed

    \bExamples
      contactverif scenes
      contactverif draw --scene b -f vts-me -f vts-ppt --out b.png
      contactverif verify vts-ppt --scene c-prime:refine=4 -p 'patch.*'
    """
    from contactverif.cli.gallery import Gallery
    from contactverif.cli.run_tables import show

    show(Gallery())


def _chosen(names: list[str], every: bool) -> list[str]:
    from contactverif.run.registry import formulation_names, standalone_names

    if every and names:
        raise MisuseError("NAME", f"{', '.join(names)} and --all", "one of the two")
    if every:
        return list(standalone_names())
    if not names:
        raise MisuseError("NAME", "nothing", f"--all, or some of {', '.join(formulation_names())}")
    return names


def _interface(mesh: Path | None, slave: str | None, master: str | None, flip: bool) -> Interface | None:
    from contactverif.meshes.mesh_file import read_interface

    if mesh is None:
        for option, value in (("--slave", slave), ("--master", master), ("--flip", flip or None)):
            if value is not None:
                raise MisuseError("--mesh", f"none, but {option}", "--mesh FILE, which the tags belong to")
        return None
    if slave is None or master is None:
        missing = "--slave" if slave is None else "--master"
        raise MisuseError(missing, "nothing", f"{missing} TAG, a physical group of line elements of {mesh}")
    return read_interface(mesh, slave=slave, master=master, flip=flip)


def _scene(scene: str | None, mesh: Path | None) -> Case | None:
    if scene is None:
        return None
    from contactverif.scenes.catalogue import load_scene

    if mesh is not None:
        raise MisuseError("--scene", f"{scene} and --mesh {mesh}", "one of the two")
    return load_scene(scene).case()


def _reason(text: str) -> tuple[str, str]:
    property_id, equals, reason = text.partition("=")
    if not (property_id and equals and reason):
        raise MisuseError("--known", repr(text), "ID=REASON, the id of a property and why it is known to fail")
    return property_id, reason


def _only(option: str, given: list[str]) -> str | None:
    if len(given) > 1:
        raise MisuseError(option, f"{len(given)}: {', '.join(given)}", "one")
    return given[0] if given else None


def _file_name(formulation: str, property_id: str) -> str:
    from contactverif_reports.netcdf.schema import case_id

    return case_id(formulation, property_id)


def main() -> None:
    """The command `contactverif`: a user's mistake is one line and exit status 2, never a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal that has no ≤ is shown a question mark
            stream.reconfigure(errors="replace")
    try:
        status = app(standalone_mode=False)
        sys.stdout.flush()
    except BrokenPipeError:  # `| head` has seen enough
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115, since nothing can be said at the end of the process
        sys.exit(128 + signal.SIGPIPE)
    except MisuseError as error:
        argument = _OPTIONS.get(error.argument, error.argument)
        _refuse(str(MisuseError(argument, error.found, error.needed)))
    except ContactverifError as error:
        _refuse(str(error))
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EIO, errno.EDQUOT):
            raise
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115
        _refuse(f"what was found cannot be written: {error.strerror}")
    except typer.Abort:
        status = 130
    except Exception as error:
        said = getattr(error, "format_message", None)  # an error of usage, of which typer hides the class
        if said is None:
            raise
        command = getattr(getattr(error, "ctx", None), "command_path", "contactverif")
        _refuse(f"{said()} (see {command} --help)" if said() else "")  # without arguments there was help already
    if status == 130:  # typer's word for Ctrl-C
        typer.echo("contactverif: stopped", err=True)
    sys.exit(status or 0)


def _refuse(why: str) -> NoReturn:
    if why:
        typer.echo(f"contactverif: {' '.join(why.split())}", err=True)
    sys.exit(2)
