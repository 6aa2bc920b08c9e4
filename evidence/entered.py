"""Count the files and functions of ours that a small run enters in the harness' own process.

`python evidence/entered.py [-v]` judges one property of one formulation on 20 cases, inline and with one job.
"""

import os
import sys
import tempfile
from collections import Counter
from pathlib import Path
from types import FrameType
from typing import Any

COMMAND = ["verify", "vts-ppt", "-p", "patch.flat.transmission", "--examples", "20", "--seed", "1", "-j", "1"]
OURS = ("contactverif", "contactverif_nts", "contactverif_properties", "contactverif_reports")


def main() -> None:
    """Run the command and print the counts; with ``-v`` the files, and how many functions of each were entered."""
    verbose = "-v" in sys.argv[1:]
    entered: Counter[tuple[str, str]] = Counter()

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_name != "<module>" and any(f"/{name}/" in code.co_filename for name in OURS):
            entered[code.co_filename, code.co_qualname] += 1

    from contactverif.cli import main as run

    with tempfile.TemporaryDirectory() as folder:
        sys.argv = ["contactverif", *COMMAND, "--isolation", "inline", "--no-memory", "--out", f"{folder}/run.nc"]
        sys.setprofile(note)
        try:
            run()
        except SystemExit:
            pass
        finally:
            sys.setprofile(None)
    files = Counter(Path(name) for name, _ in entered)
    if verbose:
        common = os.path.commonpath(files)
        for path, number in sorted(files.items()):
            print(f"{number:5} {path.relative_to(common)}")
    print(f"{len(files)} files, {len(entered)} functions, {sum(entered.values())} calls")


if __name__ == "__main__":
    main()
