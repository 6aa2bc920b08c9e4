"""Run the campaigns of this folder and keep what they print in `reports/trust`, for the page.

`python evidence/hostile/run_campaigns.py [COUNT ...]` takes a number of attempts for each, in the
order of `CAMPAIGNS`.
"""

import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "trust"))

from tables import FOLDER, keep_commit

# {script: (file that keeps its output, number of attempts)}
CAMPAIGNS = {
    "sigkills.py": ("sigkills.csv", 100),
    "command_lines.py": ("command_lines.txt", 5000),
    "damaged_reports.py": ("damaged_reports.txt", 2000),
    "damaged_meshes.py": ("damaged_meshes.txt", 2000),
    "forged_journals.py": ("forged_journals.txt", 1000),
    "forged_reports.py": ("forged_reports.txt", 200),
    "forged_shards.py": ("forged_shards.txt", 110),
    "ways.py": ("ways.txt", 40),
}


def main(counts: list[int]) -> int:
    """Run all campaigns; return 1 if one of them found harm."""
    harm = False
    for number, (script, (name, usual)) in enumerate(CAMPAIGNS.items()):
        count = counts[number] if number < len(counts) else usual
        command = [sys.executable, str(Path(__file__).parent / script), str(count)]
        finished = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
        (FOLDER / name).write_text(finished.stdout, encoding="utf-8")
        keep_commit(FOLDER / name)
        print(f"{script}: exit status {finished.returncode}\n{finished.stdout}", flush=True)
        harm = harm or finished.returncode != 0
    return int(harm)


if __name__ == "__main__":
    sys.exit(main([int(word) for word in sys.argv[1:]]))
