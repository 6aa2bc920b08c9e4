"""Quotations in the pages: outputs of commands, code of files, pictures. `python tests/docs/quotes.py` renews them.

A page marks a quotation by a comment before the block:

    <!-- output: PATTERN | PATTERN -->     output of the last command in the shell block before it
    <!-- output of PAGE.md: PATTERN -->    the same, of the first quoted command of another page
    <!-- source: FILE -->                  a whole file of the repository
    <!-- source: FILE CLASS -->            a class of it

An output is cut into pieces, each of which begins with a line that is not indented. A piece is kept if its first line
matches one of the patterns; `all` keeps everything. Behind the patterns, `rows FAMILY ID …` names properties: of the
rows of a table those of other properties are left out. One line with "…" stands for what is left out.

Rules for the next editor: nobody writes a quotation by hand, and a page runs its commands in order, in one folder.
"""

import ast
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from contactverif.plugins.registry import property_ids

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PICTURES = DOCS / "pictures"
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
MINE = ROOT / "tests" / "external" / "contactverif-mine"
README = ROOT / "README.md"
ROWS = "rows "  # Begins the list of properties whose rows are kept.

# The classes of mine.py that exist at each step of the tutorial.
STEPS = {
    "residual.md": ("NodeToSegment",),
    "patch-test.md": ("NodeToSegment", "SegmentToSegment"),
    "tangent.md": ("NodeToSegment", "SegmentToSegment", "Exact"),
}
PROGRAMS = {
    "contactverif": [sys.executable, "-c", "from contactverif.cli import main; main()"],
    "pytest": [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir=."],
    "python": [sys.executable],
}
WIDTH = "100"  # Columns of a quoted output.
# The report that examples/read_report.py reads.
REPORT = ("vts-me", "vts-ppt", "-p", "patch.flat.transmission", "--seed", "1", "--out", "report.nc")

# What a number on a screen may differ by: seconds are left out, and what is rounding has other last bits where a
# library of linear algebra, or a processor, adds in another order. All tolerances are exact.
SECONDS = re.compile(r"\d[\d.]*(?:e[+-]?\d+)? ?(?:µs|ms|s|min|h)\b")
UNSOLVED, FEW_CASES = 1e3, 2  # An error that no solution has; cases in which roundings may decide.
_ERROR = re.compile(r"error (\d[\d.]*(?:e[+-]?\d+)?), at most")
ROUNDING, SLACK = 1e-6, 2.0  # Below the one, and beside "pass", an error may be this many times the other.
_NUMBER = re.compile(r"((?:at most|at least|≤|≥|pass)? *)(?<![\w./])(\d+(?:\.\d+)?(?:e[+-]?\d+)?)(?![\w/])")
_QUOTE = re.compile(
    r"^<!-- (output|source)(?: of (\S+?))?: *(.*?) *-->\n```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL
)


@dataclass(frozen=True)
class Quote:
    """A block that quotes something, and where it stands."""

    kind: str  # "output" or "source".
    argument: str  # The patterns, or the file and the class.
    block: str  # The text in the page today.
    command: str  # The quoted command; empty if a file is quoted.
    foreign: bool  # The command stands on another page.


def pages() -> list[Path]:
    """Return README.md and all Markdown files of the site."""
    return [README, *sorted(DOCS.rglob("*.md"))]


def blocks(language: str, text: str) -> list[str]:
    """Return the code blocks of a language, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def commands(text: str) -> list[str]:
    """Return the lines of all shell blocks."""
    return [line for block in blocks("sh", text) for line in block.splitlines() if line.strip()]


def quotes(page: Path) -> Iterator[Quote]:
    """Iterate over the quotations of a page."""
    text = page.read_text(encoding="utf-8")
    for match in _QUOTE.finditer(text):
        kind, other, argument, _, block = match.groups()
        if kind == "source":
            command = ""
        elif other:
            command = next(quote.command for quote in quotes(page.parent / other) if quote.command)
        else:
            command = commands(text[: match.start()])[-1]
        yield Quote(kind, argument, block, command, bool(other))


def classes(source: str) -> dict[str, str]:
    """Return {name: text} of the classes of a file; the lines before the first class belong to it."""
    lines = source.splitlines(keepends=True)
    nodes = [node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)]
    starts = [0, *(node.lineno - 1 for node in nodes[1:])]
    return {node.name: "".join(lines[start : node.end_lineno]) for start, node in zip(starts, nodes, strict=True)}


MINE_SOURCE = (MINE / "mine.py").read_text(encoding="utf-8")
MINE_CLASSES = classes(MINE_SOURCE)


def install_project(folder: Path, settings: str) -> None:
    """Write what `pip install` leaves in a folder of the project with this pyproject.toml, besides its modules."""
    project = tomllib.loads(settings)["project"]
    info = folder / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    info.mkdir(parents=True, exist_ok=True)
    metadata = f"Metadata-Version: 2.4\nName: {project['name']}\nVersion: {project['version']}\n"
    (info / "METADATA").write_text(metadata, encoding="utf-8")
    lines = []
    for group, points in project["entry-points"].items():
        lines += [f"[{group}]", *(f"{point} = {target}" for point, target in points.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


def install_mine(folder: Path, source: str = MINE_SOURCE) -> None:
    """Write what `pip install` leaves in a folder of a project whose mine.py has this source."""
    install_project(folder, (MINE / "pyproject.toml").read_text(encoding="utf-8"))
    (folder / "mine.py").write_text(source, encoding="utf-8")


def call(program: str, *arguments: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a program in a process of its own that sees what is installed in `folder/site`."""
    style = folder / "style"
    style.mkdir(exist_ok=True)
    (style / "matplotlibrc").write_text("svg.hashsalt: contactverif\n", encoding="utf-8")
    environment = {key: value for key, value in os.environ.items() if key != "FORCE_COLOR"}
    environment |= {
        "PYTHONPATH": os.pathsep.join(filter(None, [str(folder / "site"), os.environ.get("PYTHONPATH")])),
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONIOENCODING": "utf-8",
        "COLUMNS": WIDTH,
        "MPLBACKEND": "Agg",
        "MATPLOTLIBRC": str(style),
        "SOURCE_DATE_EPOCH": "0",
    }
    return subprocess.run(
        [*PROGRAMS[program], *map(str, arguments)],
        cwd=folder,
        env=environment,
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )


def prepare(page: Path, folder: Path) -> None:
    """Put the files that a page speaks of into the folder in which its commands run."""
    if not (folder / "tests").exists():
        (folder / "tests").symlink_to(ROOT / "tests")
    if page.parent.name == "tutorial":
        install_mine(folder / "site", "\n\n\n".join(MINE_CLASSES[name] for name in STEPS.get(page.name, MINE_CLASSES)))
        return
    settings = "".join(blocks("toml", page.read_text(encoding="utf-8")))  # The page may register an example.
    points = tomllib.loads(settings).get("project", {}).get("entry-points", {}).get("contactverif.formulations", {})
    sources = {target.partition(":")[0] for target in points.values()}
    for source in (path for path in EXAMPLES if path.stem in sources):
        install_project(folder / "site", settings)
        shutil.copy(source, folder / "site")


def outputs(page: Path, folder: Path) -> dict[str, subprocess.CompletedProcess[str]]:
    """Run the commands of a page whose output or picture is shown, and those that write what they read.

    A project that a command makes is installed.
    """
    prepare(page, folder)
    quoted = {quote.command for quote in quotes(page) if not quote.foreign}
    needed: list[str] = []
    for line in reversed(commands(page.read_text(encoding="utf-8"))):
        files = re.findall(r"--out (\S+)", line)
        files += re.findall(r"^contactverif new (\S+)", line)
        is_read = any(file in later.split() for file in files for later in needed)
        is_shown = line in quoted or re.search(r"--out \S+\.svg", line)
        if line.startswith("contactverif ") and (is_shown or is_read):
            needed.insert(0, line)
    results = {}
    for line in needed:
        results[line] = call(*shlex.split(line), folder=folder)
        if line.startswith("contactverif new "):
            project = folder / line.split()[2]
            install_project(folder / "site", (project / "pyproject.toml").read_text(encoding="utf-8"))
            shutil.copy(project / f"{project.name.replace('-', '_')}.py", folder / "site")
    return results


def excerpt(output: str, patterns: str) -> str:
    """Return the pieces of an output whose first line matches one of the patterns; "…" stands for the others."""
    lines = [line.rstrip() for line in output.splitlines()]
    if patterns == "all":
        return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip("\n") + "\n"
    words = [pattern.strip() for pattern in patterns.split(" | ")]
    tests = [re.compile(word) for word in words if not word.startswith(ROWS)]
    families = [family for word in words if word.startswith(ROWS) for family in word.removeprefix(ROWS).split()]
    excerpt_lines: list[str] = []
    for piece in _pieces(lines):
        if any(test.search(piece[0]) for test in tests):
            excerpt_lines += _with_rows_of(piece, families) if families else piece
        elif excerpt_lines and excerpt_lines[-1] != "…":
            excerpt_lines.append("…")
    return re.sub(r"\n{3,}", "\n\n", "\n".join(excerpt_lines)).strip("\n…") + "\n"


def _with_rows_of(piece: list[str], families: Sequence[str]) -> list[str]:
    """Return a piece without the rows of other properties, and the remarks below them; "…" stands for them."""
    others = {name for name in property_ids() if not any(f"{name}.".startswith(f"{family}.") for family in families)}
    left: list[str] = []
    dropped = False
    for line in piece:
        is_remark = line.startswith(" " * 6)
        dropped = dropped if is_remark else line.strip().partition(" ")[0] in others
        if not dropped:
            left.append(line)
        elif left[-1] != "  …":
            left.append("  …")
    return left


def _pieces(lines: Sequence[str]) -> list[list[str]]:
    pieces: list[list[str]] = []
    for line in lines:
        if not pieces or (line and not line.startswith(" ")):
            pieces.append([])
        pieces[-1].append(line)
    return pieces


def unlike(quoted: str, printed: str) -> list[str]:
    """Return the lines of a quotation that say something else than those that a command printed."""
    pairs = zip_longest(*(SECONDS.sub("s", text).splitlines() for text in (quoted, printed)), fillvalue="")
    return [f"{old} -> {new}" for old, new in pairs if old != new and not _alike(old, new)]


def _alike(quoted: str, printed: str) -> bool:
    """Return whether two lines differ in nothing but roundings."""
    lines = [re.sub(r" +", " ", line) for line in (quoted, printed)]
    if len({_NUMBER.sub("0", line) for line in lines}) == 2:
        return False
    if all(any(float(error) > UNSOLVED for error in _ERROR.findall(line)) for line in lines):
        return True  # Of cases that are not solved, roundings of the processor decide which is the worst.
    few = FEW_CASES if lines[0].startswith("Newton iterations") else 0
    for (before, old), (_, new) in zip(*map(_NUMBER.findall, lines), strict=True):
        if abs(float(old) - float(new)) <= few:
            continue
        is_error = before.strip() == "pass" or (not before.strip() and float(old) < ROUNDING)
        if old != new and not (is_error and float(old) <= SLACK * float(new) <= SLACK**2 * float(old)):
            return False
    return True


def source_block(argument: str) -> str:
    """Return the text of a file, or of one of its classes."""
    name, _, wanted = argument.partition(" ")
    text = (ROOT / name).read_text(encoding="utf-8")
    if not wanted:
        return text
    if name.endswith("mine.py"):
        return MINE_CLASSES[wanted]
    node = next(item for item in ast.parse(text).body if isinstance(item, ast.ClassDef) and item.name == wanted)
    return "".join(text.splitlines(keepends=True)[node.lineno - 1 : node.end_lineno])


def renew_text(page: Path, results: dict[str, str]) -> str:
    """Return the text of a page with its quotations anew, from {command: its output}."""
    fresh = (
        source_block(quote.argument) if quote.kind == "source" else excerpt(results[quote.command], quote.argument)
        for quote in quotes(page)
    )

    def replace(match: re.Match[str]) -> str:
        return f"{match[0].splitlines()[0]}\n```{match[4]}\n{next(fresh)}```"

    return _QUOTE.sub(replace, page.read_text(encoding="utf-8"))


def keep_pictures(folder: Path) -> None:
    """Copy the pictures in a folder, and in folders of it, that some page shows to those of the site."""
    texts = "".join(page.read_text(encoding="utf-8") for page in pages())
    for path in sorted([*folder.glob("*.svg"), *folder.glob("*/*.svg")]):
        name = "_".join(path.relative_to(folder).parts)
        if f"pictures/{name}" in texts:
            shutil.copyfile(path, PICTURES / name)
            print(f"    {name}")


def main(names: Sequence[str]) -> None:
    """Run every quoted command and every example, and write pages and pictures anew."""
    paths = [Path(name).resolve() for name in names] or [*pages(), *EXAMPLES]
    selection, scripts = ([path for path in paths if path.suffix == suffix] for suffix in (".md", ".py"))
    results: dict[str, str] = {}
    for page in selection:
        with tempfile.TemporaryDirectory() as folder:
            for command, finished in outputs(page, Path(folder)).items():
                results[command] = finished.stdout
                print(f"{page.relative_to(ROOT)}: {command}\n{finished.stderr}", end="")
            keep_pictures(Path(folder))
    for page in selection:
        page.write_text(renew_text(page, results), encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        if scripts:
            call("contactverif", "verify", *REPORT, folder=Path(folder))
        for script in scripts:
            finished = call("python", script, folder=Path(folder))
            print(f"{script.relative_to(ROOT)}\n{finished.stderr}", end="")
        keep_pictures(Path(folder))


if __name__ == "__main__":
    main(sys.argv[1:])
