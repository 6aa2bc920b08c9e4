"""Ask every file of `writers.py` for its sides: `python ask.py FOLDER TABLE.csv` writes what came, and counts."""

import csv
import json
import sys
from collections import Counter
from pathlib import Path

from scenes import rounded

from contactverif import MisuseError, read_interface


def ask(folder: Path, file: str, asked: list[str], truth: list) -> str:
    """Return how reading a file ends: right, WRONG, or the line of the refusal."""
    slave, master = [name or None for name in asked] if file else [str(folder / name) for name in asked]
    try:
        interface = read_interface(folder / file if file else None, slave=slave, master=master)
    except MisuseError as error:
        return " ".join(str(error).replace(f"{folder}/", "").split())
    sides = interface.slave, interface.master
    corners = [interface.nodes[side.segments if interface.dim == 2 else side.faces] for side in sides]
    return "right" if [rounded(each) for each in corners] == truth else "WRONG"


if __name__ == "__main__":
    directory = Path(sys.argv[1]).absolute()
    rows = []
    for each in json.loads((directory / "asked.json").read_text()):
        end = ask(directory, each["file"], each["asked"], each["truth"])
        rows.append([each["writer"], each["file"] or "two files", " ".join(each["asked"]), end])
    with Path(sys.argv[2]).open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream, lineterminator="\n").writerows([["writer", "file", "asked", "came"], *rows])
    print(Counter(end if end in ("right", "WRONG") else "refused" for *_, end in rows))
