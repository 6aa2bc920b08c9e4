"""Write the part of the page about formulations on faces, from the tables of `faces_campaign`."""

from collections import defaultdict

from tables import read

FILES = FACES, KILLS = "faces.csv", "face_kills.csv"
AT_LIMIT = "hard.touch"  # All springs of a slave that touches have together exactly the stiffness that is allowed.
COUNTS = ("cases", "accusations", "undecided", "idle")
TEXT = """## In space

Six formulations on faces were asked every property that has cases in space: {cases:,} cases, {accusations} of them
accusations, {undecided} undecided. *Nearest* is as above, but for `hard.touch`, whose number is its limit for whoever
is right. {mutants} formulations on faces are wrong on purpose. Each is caught by the property that is meant to: {first}
by its first case, and all by its case {last} at the latest. {alone} are caught by that property alone.

"""


def faces() -> str:
    """Return the part of the page, nothing before the campaign has run."""
    rows, kills = read(FACES), read(KILLS)
    if not (rows and kills):
        return ""
    groups = defaultdict[str, list[dict[str, str]]](list)
    for row in rows:
        groups[row["formulation/property"].partition("/")[0]].append(row)
    lines = []
    for name, members in groups.items():
        others = (row for row in members if not row["formulation/property"].endswith(f"/{AT_LIMIT}"))
        nearest = max(others, key=lambda row: float(row["nearest"]))
        question = nearest["formulation/property"].partition("/")[2]
        counts = [f"{sum(int(row[count]) for row in members):,}" for count in COUNTS]
        lines.append([f"`{name}`", *counts, nearest["nearest"], f"`{question}`"])
    cases = sorted(int(row["first case"]) for row in kills)
    text = TEXT.format(
        **{count: sum(int(row[count]) for row in rows) for count in COUNTS[:3]},
        mutants=len(kills),
        first=cases.count(1),
        last=cases[-1],
        alone=sum(not row["also"] for row in kills),
    )
    heads = ["formulation", "cases", "accused", "undecided", "idle", "nearest", "in"]
    table = [heads, ["---", *["--:"] * (len(heads) - 1)], *lines]
    return text + "".join(f"| {' | '.join(line)} |\n" for line in table)
