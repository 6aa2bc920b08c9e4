"""The command line: it registers the commands and turns every error of a user into one line."""

import errno
import io
import os
import re
import signal
import sys
from collections.abc import Callable
from glob import escape, iglob
from importlib.metadata import Distribution
from typing import Annotated

import typer

from contactverif import __version__
from contactverif.cli import commands
from contactverif.cli.options import spell_out
from contactverif.contract.errors import ContactverifError, MisuseError, describe_error, name_line, one_line
from contactverif.isolation.confine import ONE_THREAD, address_space

app = typer.Typer(
    help="Find out whether a contact formulation is right: random meshes, exact answers, small counterexamples.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_GROUPS: dict[str, dict[str, Callable[..., int | None]]] = {  # {title in the help: {name: command}}
    "Commands for every day": {
        "verify": commands.verify,
        "explain": commands.explain,
        "compare": commands.compare,
        "replay": commands.replay,
        "report": commands.report,
        "list": commands.list_installed,
        "new": commands.new,
    },
    "Commands for runs of many hours": {
        "campaign": commands.campaign,
        "merge": commands.merge,
        "audit": commands.audit,
        "bench": commands.bench,
    },
    "Commands for scenes and for the paper": {
        "scenes": commands.list_scenes,
        "draw": commands.draw,
        "paper": commands.paper,
    },
}
COMMANDS = {name: command for group in _GROUPS.values() for name, command in group.items()}
for title, group in _GROUPS.items():
    for name, command in group.items():
        app.command(name, rich_help_panel=title)(spell_out(command))

# The names that deeper modules have for an option.
_OPTIONS = {name: f"--{name}" for name in ("examples", "seed", "profile")} | {
    "known failure": "--known",
    "place": "--mesh",
}
_OLD_OPTIONS = ("--report", "--html", "--picture", "--vtu")  # Options of earlier versions, now all --out.
_STOPPED, _CLOSED_PIPE, _MISUSE = (130, 143), 128 + signal.SIGPIPE, 2  # Exit statuses, as shells and typer have them.
_MOST_COLUMNS = 10_000
_LEAST_MEMORY = 1 << 30  # Bytes of address space. The libraries of a plugin take about half of them.
# What typer says of a value, with pydantic or without: what it has found, unless it leaves that out, and what it needs.
_BAD_VALUE = re.compile(r"(?:Value error, )?(?:(.*) is not|Input should be) (one of .*|a valid \w+)")
_COMMAND = re.compile(r"((?:^|[\r\n])[^\S\r\n]*:(?=:)|#(?=#\[))")  # White space alone stands before the first colon.


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"contactverif {__version__}")
        raise typer.Exit


@app.callback()
def _options_of_all_commands(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and exit.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Take the options that stand before a command."""


def main() -> None:
    """Run the command `contactverif`; a user's mistake is one line and exit status 2, never a traceback."""
    if "numpy" not in sys.modules:  # Later no library would read it.
        os.environ.update(ONE_THREAD)
    _open_closed_streams()
    columns = os.environ.get("COLUMNS", "")  # The lines of a help page fill a terminal, however wide it says it is.
    if columns.isdecimal() and (len(columns) > len(str(_MOST_COLUMNS)) or int(columns) > _MOST_COLUMNS):
        os.environ["COLUMNS"] = str(_MOST_COLUMNS)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # A terminal that has no ≤ shows a question mark.
            stream.reconfigure(errors="replace")
            if os.environ.get("GITHUB_ACTIONS") == "true":
                obey_nothing(stream)
    try:
        if sys.flags.optimize > 1:
            raise MisuseError("python", "-OO, which drops the docstrings", "it without -OO: pages are made of them")
        if address_space() < _LEAST_MEMORY:
            needed = f"at least {_LEAST_MEMORY >> 10} kB: with less, OpenBLAS may wait for memory for ever"
            raise MisuseError("ulimit -v", f"{address_space() / 1024:.0f} kB", needed)
        _check_entry_points()
        status = app(prog_name="contactverif", standalone_mode=False)
        sys.stdout.flush()
    except Exception as error:
        status = _exit_status(error)
    if status in _STOPPED:
        typer.echo("contactverif: stopped", err=True)
    sys.exit(status or 0)


def _check_entry_points() -> None:
    """Check that the entry points of all distributions can be read: numba and hypothesis read those of everybody."""
    for folder in sys.path:
        for name in iglob(f"{escape(folder or '.')}/*.*-info/entry_points.txt"):
            try:
                if not os.path.isfile(name):  # Python would wait for what somebody writes into a pipe.
                    raise OSError("no ordinary file")
                _ = Distribution.at(os.path.dirname(name)).entry_points
            except Exception as error:  # Python raises what it likes, such as a TypeError.
                needed = "a file of entry points, which Python can read; remove this distribution or install it anew"
                raise MisuseError(name, describe_error(error), needed) from None


def obey_nothing(stream: io.TextIOWrapper) -> None:
    """Write to a stream nothing that a workflow of GitHub obeys: a line that begins with ::, or that has ##[ in it."""
    write = stream.write
    stream.reconfigure(encoding="utf-8")  # Typer writes past a stream that has ASCII alone.
    stream.write = lambda text: write(_COMMAND.sub(r"\1 ", text))  # type: ignore[method-assign]


def _open_closed_streams() -> None:
    """Replace a stream that the caller has closed (`>&-`); else the next file that is opened would get its number."""
    null = os.open(os.devnull, os.O_RDWR)
    while null <= 2:
        null = os.dup(null)
    os.close(null)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115, since it stays open to the end


def _exit_status(error: Exception) -> int:
    """Return the exit status for an error, after one line about it; raise again what is a mistake of the harness."""
    match error:
        case BrokenPipeError():  # The reader, such as `head`, has closed the pipe.
            _discard_output()
            return _CLOSED_PIPE
        case typer.Abort():
            if isinstance(error.__cause__, EOFError):  # Typer takes it for the end of what a user types.
                raise error.__cause__
            return 128 + next(iter(getattr(error.__cause__, "args", ())), signal.SIGINT)  # `Bar` tells the signal.
        case MisuseError():
            reason = str(MisuseError(_OPTIONS.get(error.argument, error.argument), error.found, error.needed))
        case ContactverifError():
            reason = str(error)
        case OSError(strerror=str()) | MemoryError() | UnicodeEncodeError():
            reason = _words_of_machine(error)
        case RuntimeError() if "start new thread" in str(error):
            reason = "the system lets this user start no further thread (ulimit -u, ulimit -v)"
        case _:
            reason = _words_of_usage_error(error)
    if reason:
        typer.echo(f"contactverif: {one_line(' '.join(reason.split()))}", err=True)
    return _MISUSE


def _words_of_machine(error: OSError | MemoryError | UnicodeEncodeError) -> str:
    """Return what the machine cannot do: a disk is full, a folder may not be entered, a name is too long."""
    if isinstance(error, UnicodeEncodeError):
        return f"{name_line(error.object)!a}: its characters do not exist in this locale's {error.encoding}"
    if isinstance(error, MemoryError):
        return f"there is not enough memory for this command ({one_line(str(error)) or 'no number is known'})"
    if error.errno in (errno.ENOSPC, errno.EIO, errno.EDQUOT) and error.filename is None:
        _discard_output()
        return f"the output cannot be written: {error.strerror}"
    if isinstance(error, FileNotFoundError) and error.filename is None:
        return "the working folder does not exist any more"
    name = f"{name_line(os.fsdecode(error.filename))}: " if isinstance(error.filename, str | bytes) else ""
    return f"{name}{error.strerror}"


def _words_of_usage_error(error: Exception) -> str:
    """Return what typer says of a wrong command line; raise any other error again. Typer hides their classes."""
    format_message = getattr(error, "format_message", None)
    if format_message is None:
        raise error
    option = getattr(error, "option_name", "")
    if option in _OLD_OPTIONS:
        return f"{option}: found an option of an earlier version; needed --out FILE, whose ending says what is written"
    words = format_message()
    if match := _BAD_VALUE.match(getattr(error, "message", "")):
        value = match[1] or repr(getattr(error.__cause__, "errors", list)()[0]["input"])
        name = error.param.opts[0]  # type: ignore[attr-defined]  # A value that is wrong has a parameter.
        return str(MisuseError(name, value, match[2].replace("'", "").rstrip(".")))
    command_path = getattr(getattr(error, "ctx", None), "command_path", "contactverif")
    return f"{words} (see {command_path} --help)" if words else ""  # Without arguments typer has shown the help.


def _discard_output() -> None:
    """Replace standard output, so that Python does not fail to flush it at the end of the process."""
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115, since the process ends with it
