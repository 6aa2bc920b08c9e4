"""The files that a command writes: `--out FILE`, repeatable, where the suffix says what is written.

Rule: everything that can be wrong with a name is said here, before anything takes long.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from contactverif.api.run_files import JSON, JUNIT, PAGE, REPORT, either
from contactverif.contract.errors import MisuseError

PICTURES = (".png", ".svg")
SOLVED_SCENE = ".vtu"
MARKDOWN = ".md"
LABELS = {
    REPORT: "report",
    PAGE: "page",
    MARKDOWN: "page",
    JSON: "JSON",
    JUNIT: "JUnit",
    ".png": "picture",
    ".svg": "picture",
    SOLVED_SCENE: "for ParaView",
}


@dataclass(frozen=True, slots=True)
class OutputFiles:
    """The files of one command, at most one of each suffix."""

    names: Mapping[str, Path]  # {suffix: name as the user typed it}.
    paths: Mapping[str, Path]  # {suffix: absolute path}. A plugin may change the working folder while it runs.

    @classmethod
    def check(cls, names: Sequence[Path] | None, suffixes: Sequence[str]) -> OutputFiles:
        """Return the files, once it is sure that they can be written."""
        from contactverif_reports.files import check_writable

        by_suffix: dict[str, Path] = {}
        for name in names or ():
            suffix = name.suffix.lower()
            if suffix not in suffixes:
                raise MisuseError("--out", f"{str(name)!r}", f"a name that ends in {either(suffixes)}")
            if suffix in by_suffix:
                raise MisuseError("--out", f"{by_suffix[suffix]} and {name}", f"one file that ends in {suffix}")
            check_writable(name, "--out", f"FILE{suffix}")
            by_suffix[suffix] = name
        return cls(by_suffix, {suffix: name.absolute() for suffix, name in by_suffix.items()})

    def only(self, suffixes: Collection[str]) -> OutputFiles:
        """Return the files with these suffixes."""
        names, paths = (
            {key: path for key, path in files.items() if key in suffixes} for files in (self.names, self.paths)
        )
        return OutputFiles(names, paths)

    def pictures(self) -> Iterator[Path]:
        """Yield the absolute path of each picture."""
        yield from (path for suffix, path in self.paths.items() if suffix in PICTURES)

    def drawings(self) -> Iterator[Path]:
        """Yield the absolute path of each picture, and of a file for ParaView."""
        yield from (path for suffix, path in self.paths.items() if suffix in (*PICTURES, SOLVED_SCENE))

    def announce(self) -> None:
        """Print the name of each file that was written, a line each."""
        from contactverif.cli.console import say

        for suffix, label in LABELS.items():
            if suffix in self.names:
                say(f"{label}: {self.names[suffix]}")


@dataclass(frozen=True, slots=True)
class PictureFolder:
    """The folder that `--pictures` names, which exists."""

    name: Path  # The folder as the user typed it.
    path: Path  # The same as an absolute path.

    @classmethod
    def make(cls, name: Path | None) -> PictureFolder | None:
        """Make the folder if it is not there; return None without a name."""
        if name is None:
            return None
        from contactverif_reports.files import made_folder

        made_folder(name, "--pictures")
        return cls(name, name.absolute())
