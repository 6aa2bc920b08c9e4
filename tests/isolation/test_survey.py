"""A survey of what is installed: no plugin hides, changes or ends another one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from contactverif.isolation.box import why_no_box

PLUGINS = {
    # A name that sorts first is loaded first.
    "a-patches": """
import importlib.metadata
import contactverif.plugins.registry as registry

importlib.metadata.entry_points = lambda **group: ()
registry._entries_by_name = registry.entry_points = lambda *group, **more: {}
""",
    "b-ends": "import os\nos._exit(3)",
    "c-kills": "import os, signal\nos.kill(os.getppid(), signal.SIGKILL)",
    "d-changes": """
import os

with open(f"/proc/{os.getppid()}/mem", "r+b", buffering=0) as memory:
    memory.read(1)
""",
    "e-answers": """
import os

for number in range(3, 64):
    try:
        os.write(number, b"forged" * 1000)
    except OSError:
        pass
""",
    "f-limits": """
import os, resource

resource.prlimit(os.getppid(), resource.RLIMIT_NOFILE, (4, 4))
""",
    # The box is that of all names, which may find in it what another one left.
    "g-plants": """
import pathlib, tempfile

folder = pathlib.Path(tempfile.gettempdir(), "kernels", "forged")
folder.mkdir(parents=True, exist_ok=True)
(folder / "file").write_text("forged")
folder.chmod(0o500)
""",
    "h-looks": """
import pathlib, tempfile

if pathlib.Path(tempfile.gettempdir(), "kernels", "forged").exists():
    raise RuntimeError("the one before has left something")
""",
    "i-blames-the-user": """
import os, struct, msgspec

frame = msgspec.msgpack.encode([["failure", 0, "misuse", "exception", ["--seed", "nothing", "a number"]]])
for number in range(3, 64):
    try:
        os.write(number, struct.pack("<Q", len(frame)) + frame)
    except OSError:
        pass
os._exit(0)
""",
}
PROGRAM = """
import sys
from contactverif.isolation.host import end_all
from contactverif.plugins.registry import load_formulations, standalone_names
from contactverif.run.run_options import Isolation, RunOptions

limits = RunOptions(isolation=Isolation(sys.argv[1])).limits()
for item in load_formulations(limits, engines=True):
    print(getattr(item, "name", None) or f"{item.formulation}: {item.reason}")
print(*standalone_names(limits))
end_all()
"""


@pytest.mark.parametrize(
    "place", ["process", pytest.param("box", marks=pytest.mark.skipif(bool(why_no_box()), reason="no boxes here"))]
)
def test_every_name_is_there_whatever_the_others_do(tmp_path: Path, place: str) -> None:
    about = tmp_path / "odd-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: odd\nVersion: 1.0\n")
    modules = {name: f"odd_{name.replace('-', '_')}" for name in PLUGINS}
    for name, source in PLUGINS.items():
        (tmp_path / f"{modules[name]}.py").write_text(f"{source}\nfrom contactverif_nts import nts\n")
    lines = [f"{name} = {module}:nts" for name, module in modules.items()]
    engine = "b-ends = odd_b_ends:nts"
    text = "\n".join(["[contactverif.formulations]", *lines, "[contactverif.engines]", engine, ""])
    (about / "entry_points.txt").write_text(text)
    (tmp_path / "survey.py").write_text(PROGRAM)
    path = os.pathsep.join(filter(None, [str(tmp_path), os.environ.get("PYTHONPATH")]))
    answer = subprocess.run(
        [sys.executable, str(tmp_path / "survey.py"), place],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    *items, standalone = answer.stdout.splitlines()
    assert set(PLUGINS) <= set(standalone.split())
    assert {"vts-ppt", "mortar", "two-pass"} <= set(items)
    for name in ("b-ends", "engine/b-ends"):
        assert f"{name}: import: its process ended with status 3" in items
    assert "engine/control" in items
    # It killed the process whose copy it was in, and the survey went on with a new one.
    assert any(item.startswith("c-kills: ") for item in items)
    assert any(item.startswith("e-answers: import: ") for item in items)
    if place == "box":
        assert any(item.startswith(("d-changes: PermissionError", "d-changes: OSError")) for item in items)
        assert "h-looks" in items
    assert "i-blames-the-user: --seed: found nothing; needed a number" in items
    # It has limited the process whose copy it was in.
    assert any(item.startswith("f-limits: exit: import: its process ended") for item in items)
