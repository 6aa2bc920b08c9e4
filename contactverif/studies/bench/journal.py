"""The journal of a bench: what was measured so far, beside the output, so that a killed bench goes on.

One line of JSON each: the plan first, then one line for each cell when it is finished. Lines are only ever appended,
and each is on the disk before the next cell begins. The last line of a killed process may be torn; it is cut off, and
its cell is run again. A journal of another plan is refused, and never overwritten.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from contactverif.contract.errors import MisuseError
from contactverif.foreign_files.ordinary import check_ordinary

SUFFIX = ".journal"


def journal_of(output: Path) -> Path:
    """Return the file of the journal beside an output. Whoever has written the output removes it."""
    return output.with_name(output.name + SUFFIX)


class Journal:
    """The journal of one output file.

    Parameters
    ----------
    output : Path
        The file that the bench will write; the journal stands beside it.
    plan : dict[str, Any]
        The plan, as plain lists, numbers and words.

    Attributes
    ----------
    path : Path
        The file of the journal.
    finished : dict[int, dict[str, Any]]
        {number of the cell: its record} of the cells that are finished.

    Raises
    ------
    MisuseError
        If the journal that is there belongs to another plan.
    """

    def __init__(self, output: Path, plan: dict[str, Any]) -> None:
        self.path = journal_of(output)
        self.finished: dict[int, dict[str, Any]] = {}
        whole = self._cut_off_torn_line()
        if not whole:
            self._append(plan)
            return
        try:
            first, *rest = (json.loads(line) for line in whole)
            finished = {int(line["cell"]): dict(line["record"]) for line in rest}
        except (KeyError, RecursionError, TypeError, ValueError) as error:
            needed = "an undamaged journal, another name, or no such file"
            raise MisuseError("--out", f"{self.path}, which is damaged ({type(error).__name__})", needed) from error
        if first != json.loads(json.dumps(plan)):
            needed = "the same command and version, or another name, or no such file"
            raise MisuseError("--out", f"{self.path}, the journal of another bench", needed)
        self.finished = finished

    def add(self, number: int, record: dict[str, Any]) -> None:
        """Append the record of a cell that is finished."""
        self._append({"cell": number, "record": record})
        self.finished[number] = record

    def _cut_off_torn_line(self) -> list[str]:
        """Return the whole lines, after the file ends with the last of them."""
        if not self.path.exists():
            return []
        check_ordinary(self.path, "--out", "a journal of a bench, or no such file")
        text = self.path.read_bytes()
        end = text.rfind(b"\n") + 1
        if end < len(text):
            os.truncate(self.path, end)
        return text[:end].decode(errors="replace").splitlines()

    def _append(self, content: dict[str, Any]) -> None:
        with open(self.path, "a", encoding="utf-8") as file:
            file.write(json.dumps(content) + "\n")
            file.flush()
            os.fsync(file.fileno())
