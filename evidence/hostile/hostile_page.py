"""Write `reports/trust/hostile.md` from the tables that `tox -e hostile` keeps beside it."""

import sys
from collections import defaultdict
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "trust"))

from catalogue import PLUGINS
from containment import CHECKS
from tables import FOLDER, commits_of, markdown, read

PAGE, TABLE, KILLS = "hostile.md", "hostile.csv", "sigkills.csv"
CAMPAIGNS = {
    "command_lines.txt": "Command lines",
    "damaged_reports.txt": "Damaged reports",
    "damaged_meshes.txt": "Damaged meshes",
    "forged_journals.txt": "Forged journals, of which all outcomes are judged again",
    "forged_reports.txt": "Forged reports, as `contactverif audit` sees them",
    "forged_shards.txt": "Shards whose header asks for more than the user has typed",
    "ways.txt": "One seed in all ways",
}

INTRODUCTION = """# Hostile plugins

A plugin is a stranger's code. `tox -e hostile` runs plugins that were written to do harm, kills runs at random moments,
and damages files; it wrote this page from the tables beside it: {commits}. What the harness contains and what it does
not is on the page [What a plugin can do](../../docs/concepts/containment.md).

## Plugins against a run

Each line is `contactverif verify nts BAD vts-ppt` with one hostile plugin `BAD`. The answers are looked up outside of
the harness:

- *goes on*: the run ends by itself, with exit status 0 or 1 and without a traceback.
- *others unchanged*: `nts` and `vts-ppt` have the same numbers, bit by bit, as in a run without the plugin.
- *report complete*: the report has every row, and an outcome of every planned case.
- *exit status right*: 0 only if the plugin was judged and keeps its promises. A plugin whose answers are right although
  it misbehaves must get the same numbers as `nts`, whose answers it gives.
- *nothing left*: no process, temporary file or block of shared memory is there afterwards, and nothing is changed of
  the files, sockets and processes that lie beside the run as bait.
- *output clean*: what is printed has no control characters, and less than 100 kB.

"""
# The ways to run them apart from the harness, the strongest first.
PLACES = {"box": "in a box", "process": "in a process of their own"}
SUMMARY = """{plugins} plugins{rest} {place}: {whole} are contained in everything, and of
{answers} answers {yes} are yes.
"""
INLINE = """In the process of the harness (`--isolation inline`), {whole} of {plugins} are contained, {lost} lose the
results of everybody, and {zero} end with exit status 0 though the plugin was not judged.{rest}
"""
# {how they ran: {plugin: why it is not contained there}}, the short list of the page about containment.
NOT_CONTAINED = {
    "box": {
        "reaches-key": "Linux has the keyrings of a user once, and not for each box.",
        "reaches-device-times": "A plugin of the root user may change rights and times of `/dev/null` and its like.",
    },
    "process": {},
}
REACHES = "reaches-"  # The names of plugins that were written against the box begin so.
ONLY_A_BOX = "A process alone does not keep a plugin from this; a box does."
KILLED = """## Kills

Runs were killed by SIGKILL at random moments, half of them with all their processes, half the first process alone, and
then resumed. *Cases lost* counts cases that were asked again beyond the one that each job was judging. A report is
broken if it cannot be read after the kill, or if it differs from that of an unbroken run after it was resumed.

"""
RUN = """## {title}

{text}

"""
Row = dict[str, str]


def rows(mode: str) -> list[Row]:
    """Return the lines of a way to run the plugins."""
    return [row for row in read(TABLE) if row["mode/plugin"].partition("/")[0] == mode]


def name_of(row: Row) -> str:
    """Return the plugin of a line."""
    return row["mode/plugin"].partition("/")[2]


def is_whole(row: Row) -> bool:
    """Return whether a plugin is contained in everything."""
    return all(row[check] == "yes" for check in CHECKS)


def table(heads: list[str], lines: list[list[str]]) -> str:
    """Return a table in Markdown."""
    return markdown(heads, [[cell.replace("|", "/") for cell in line] for line in lines], ":-:")


def by_kind(mode: str) -> str:
    """Return a table with a line for each kind of plugin: in how many plugins of it each answer is yes."""
    groups: dict[str, list[Row]] = defaultdict(list)
    for row in rows(mode):
        groups[PLUGINS[name_of(row)].kind].append(row)
    lines = [
        [kind, str(len(group)), *(f"{sum(row[check] == 'yes' for row in group)}" for check in CHECKS)]
        for kind, group in groups.items()
    ]
    return table(["kind", "plugins", *CHECKS], lines)


def summary(mode: str) -> str:
    """Return the numbers of a way to run the plugins."""
    lines = rows(mode)
    answers = [row[check] == "yes" for row in lines for check in CHECKS]
    missing = len(PLUGINS) - len(lines)
    rest = f" ({missing} more have not run yet)" if missing else ""
    numbers = {"plugins": len(lines), "rest": rest, "whole": sum(map(is_whole, lines)), "answers": len(answers)}
    return SUMMARY.format(**numbers, place=PLACES[mode], yes=sum(answers))


def inline() -> str:
    """Return the numbers of the plugins in the process of the harness; empty if there are none."""
    lines = rows("inline")
    if not lines:
        return ""
    return INLINE.format(
        whole=sum(map(is_whole, lines)),
        plugins=len(lines),
        lost=sum(row["report complete"] == "no" for row in lines),
        zero=sum(row["status"] == "0" and row["exit status right"] == "no" for row in lines),
        rest=f" {missing} more did not run there." if (missing := len(PLUGINS) - len(lines)) else "",
    )


def exceptions(mode: str) -> str:
    """Return a table of the plugins that are not contained in everything, with the reason where it is known."""
    heads = ["plugin", "what it does", "not contained", "why", "remarks"]
    lines = [
        [
            f"`{name_of(row)}`",
            PLUGINS[name_of(row)].summary,
            ", ".join(check for check in CHECKS if row[check] != "yes"),
            reason(mode, name_of(row)),
            row["remarks"],
        ]
        for row in rows(mode)
        if not is_whole(row)
    ]
    return f"Those {PLACES[mode]} that are not contained in everything:\n\n" + table(heads, lines) if lines else ""


def reason(mode: str, name: str) -> str:
    """Return why a plugin is not contained somewhere, where that is known."""
    if mode != "box" and name.startswith(REACHES):
        return ONLY_A_BOX
    return NOT_CONTAINED.get(mode, {}).get(name, "")


def all_plugins(mode: str) -> str:
    """Return the long table."""
    heads = ["plugin", "what it does", *CHECKS, "seconds", "verdict"]
    lines = []
    for row in rows(mode):
        name = name_of(row)
        verdict = row["result"].partition(":")[0]
        answers = [row[check] for check in CHECKS]
        lines.append([f"`{name}`", PLUGINS[name].summary, *answers, row["seconds"], verdict])
    return '<div class="wide" markdown>\n\n' + table(heads, lines) + "\n</div>\n"


def kills() -> str:
    """Return the part about kills; empty if there is no table."""
    lines = [list(row.values()) for row in read(KILLS)]
    return KILLED + table(list(read(KILLS)[0]), lines) if lines else ""


def campaigns() -> str:
    """Return what the other campaigns printed."""
    parts = []
    for name, title in CAMPAIGNS.items():
        if (FOLDER / name).exists():
            text = (FOLDER / name).read_text(encoding="utf-8").rstrip()  # What is no table stands as it was printed.
            parts.append(RUN.format(title=title, text=text if text.startswith("|") else f"```text\n{text}\n```"))
    return "".join(parts)


def page() -> str:
    """Return the whole page."""
    parts = [INTRODUCTION.format(commits=commits_of((TABLE, KILLS, *CAMPAIGNS))).rstrip() + "\n"]
    places = [mode for mode in PLACES if rows(mode)]
    for mode in places:
        parts += [summary(mode), by_kind(mode), exceptions(mode)]
    parts += [
        inline(),
        kills(),
        campaigns().rstrip() + "\n" if campaigns() else "",
        f"## All plugins {PLACES[places[0]]}\n\n" + all_plugins(places[0]),
    ]
    return "\n".join(part for part in parts if part)


if __name__ == "__main__":
    (FOLDER / PAGE).write_text(page(), encoding="utf-8")
