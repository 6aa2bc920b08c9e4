"""The memory of failures: cases that failed in earlier runs of a folder, which the next run asks first.

Each failure is a file of arrays, without anything that reading could run. It belongs to a formulation and to the code
of a property. A failure goes once its property passes, or has other code.
"""

import os
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.counterexample import counterexample_of, typeable
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import FAILED, Verdict
from contactverif.contract.result import Result, Row
from contactverif.plugins.provenance import code_digests

FOLDER = Path(".contactverif")
_OWNER = "owner"  # The array that says whose failure a file holds.
_LARGEST = 1 << 24  # Bytes of all arrays. A case that a person may draw has a thousandth of it.
_SETTLED = Verdict.PASS, Verdict.NOT_APPLICABLE, Verdict.NOT_PROVIDED  # Nothing fails any more, or nothing is asked.
Failures = Mapping[tuple[str, str], Case]  # {(formulation, property id): case}


class FailureMemory:
    """The failures that a folder remembers."""

    def __init__(self, folder: Path = FOLDER) -> None:
        self._folder = folder

    def recall(self, formulations: Sequence[str], property_ids: Sequence[str]) -> Failures:
        """Return the case that each formulation failed last of each property, where one is remembered."""
        if not self._folder.is_dir():
            return {}
        cases = {key: self._read(*key) for key in product(formulations, property_ids)}
        return {key: case for key, case in cases.items() if case is not None}

    def update(self, rows: Iterable[Row]) -> None:
        """Remember what failed, and forget what passes; what was not judged stays as it is."""
        with suppress(OSError):  # A folder in which nothing can be written remembers nothing.
            for row in rows:
                path = self._path(row.formulation, row.property_id)
                if row.result is Result.FAILS_AS_STATED or row.verdict in _SETTLED:
                    path.unlink(missing_ok=True)
                    continue
                remembered = row.promise is not False and row.witness is not None  # Its case fails again.
                example = counterexample_of(row) if row.verdict in FAILED and not remembered else None
                if example is not None:
                    self._write(path, example.case, _owner(row.formulation, row.property_id))

    def _path(self, formulation: str, property_id: str) -> Path:
        return self._folder / "failures" / f"{typeable(f'{formulation}.{property_id}')}.npz"

    def _read(self, formulation: str, property_id: str) -> Case | None:
        path = self._path(formulation, property_id)
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                if sum(member.file_size for member in file.zip.infolist()) > _LARGEST:
                    return None
                arrays = dict(file)
            return Case.from_arrays(arrays) if str(arrays[_OWNER]) == _owner(formulation, property_id) else None
        except (OSError, ValueError, LookupError, TypeError, EOFError, zipfile.BadZipFile, MisuseError):
            return None

    def _write(self, path: Path, case: Case, owner: str) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        ignore = self._folder / ".gitignore"
        if not ignore.exists():
            ignore.write_text("*\n", encoding="utf-8")
        temporary = path.with_name(f"{os.getpid()}.tmp")
        try:
            with temporary.open("wb") as file:
                arrays: dict[str, Any] = {**case.to_arrays(), _OWNER: np.asarray(owner)}
                np.savez(file, **arrays)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


@cache
def _owner(formulation: str, property_id: str) -> str:
    """Return whose failure a file holds, with the version of the property: that of all code that it may run."""
    digests = code_digests((), (property_id,)).values()
    return " ".join([formulation, property_id, *digests])
