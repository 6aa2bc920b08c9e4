"""Libraries that are built from the sources of this folder; a test without a compiler is skipped."""

import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import pytest

from foreign.comparison import Build

HERE = Path(__file__).parent
COMPILERS = {".f90": "gfortran", ".c": "gcc"}


@pytest.fixture(scope="session")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Return a function that builds a source file of this folder, with a TOML file beside the library if it has one."""
    folder = tmp_path_factory.mktemp("libraries")

    def build_library(source: str, *flags: str) -> Path:
        path = HERE / source
        compiler = shutil.which(COMPILERS[path.suffix])
        if compiler is None:
            pytest.skip(f"there is no {COMPILERS[path.suffix]} on this machine")
        library = folder / f"{path.stem}{''.join(flags)}.so"
        if not library.exists():
            header = files("contactverif_foreign")
            command = [compiler, "-shared", "-fPIC", "-O2", f"-I{header}", *flags, str(path), "-o", str(library), "-lm"]
            subprocess.run(command, check=True, cwd=folder)
            if path.with_suffix(".toml").exists():
                shutil.copy(path.with_suffix(".toml"), library.with_suffix(".toml"))
        return library

    return build_library
