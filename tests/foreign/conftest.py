"""Libraries that are built from sources here and from those of new projects; a test without a compiler is skipped."""

import hashlib
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import pytest

from foreign.comparison import TEMPLATES, Build

HERE = Path(__file__).parent
COMPILERS = {".f90": "gfortran", ".c": "gcc"}
# The sources of new projects, which are their own templates, and the traits beside them.
PROJECTS = {
    "nts_uel.f90": ("formulation.f90.jinja", "f90_traits.toml.jinja"),
    "springs.c": ("formulation.c.jinja", "c_traits.toml.jinja"),
}


@pytest.fixture(scope="session")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Return a function that builds a source file, in which the first text of each pair becomes the second."""
    folder = tmp_path_factory.mktemp("libraries")

    def build_library(name: str, *exchanges: tuple[str, str]) -> Path:
        source, traits = (TEMPLATES / file for file in PROJECTS[name]) if name in PROJECTS else (HERE / name, None)
        compiler = shutil.which(COMPILERS[Path(name).suffix])
        if compiler is None:
            pytest.skip(f"there is no {COMPILERS[Path(name).suffix]} on this machine")
        text = source.read_text(encoding="utf-8")
        for old, new in exchanges:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        place = folder / hashlib.sha256(text.encode()).hexdigest()[:8]
        library = place / f"{Path(name).stem}.so"
        if not library.exists():
            place.mkdir(exist_ok=True)
            (place / name).write_text(text, encoding="utf-8")
            header = f"-I{files('contactverif_foreign')}"
            command = [compiler, "-shared", "-fPIC", "-O2", "-Wall", header, name, "-o", library.name, "-lm"]
            subprocess.run(command, check=True, cwd=place)
            if traits is not None:
                shutil.copy(traits, library.with_suffix(".toml"))
        return library

    return build_library
