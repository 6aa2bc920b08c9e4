"""Print the ratios of a run of the benchmarks, or compare those of two runs.

    python tests/benchmarks/compare_runs.py reports/bench/benchmarks.json
    python tests/benchmarks/compare_runs.py reports/bench/benchmarks.json new.json

A run knows the time of each call over that of a reference, measured in the same turns. So a machine that is slower or
busier changes both, and the quotient of two ratios says what became slower. The exit status is 1 if something did.
"""

import argparse
import json
from pathlib import Path
from typing import Any, NamedTuple

SLOWER = 1.25  # The quotient of two medians above which a change is reported, as in `contactverif bench --against`.

Benchmarks = dict[tuple[str, str], dict[str, Any]]  # {(group, name): what a run knows of it}


class Change(NamedTuple):
    """The least, median and greatest ratio of a benchmark in two runs."""

    group: str
    name: str
    old: dict[str, float]
    new: dict[str, float]

    @property
    def quotient(self) -> float:
        return self.new["median"] / self.old["median"]

    @property
    def word(self) -> str:
        """The change in one word, if the medians are apart and the turns of both runs do not overlap."""
        if self.quotient > SLOWER and self.new["least"] > self.old["greatest"]:
            return "slower"
        if self.quotient < 1 / SLOWER and self.new["greatest"] < self.old["least"]:
            return "faster"
        return ""


def compare(old: Benchmarks, new: Benchmarks) -> list[Change]:
    """Return the changes of all benchmarks that both runs have with the same reference, the largest first."""
    common = [key for key in new if key in old and old[key]["reference"] == new[key]["reference"]]
    changes = [Change(*key, old[key]["ratio"], new[key]["ratio"]) for key in common]
    return sorted(changes, key=lambda change: -change.quotient)


def lines_of_run(run: Benchmarks) -> list[str]:
    lines, group = [], ""
    for entry in run.values():
        if entry["group"] != group:
            group = entry["group"]
            lines += ["", f"{group}: time over that of a reference", f"{'':36}{'least':>9}{'median':>9}{'greatest':>9}"]
        spread = "".join(f"{entry['ratio'][name]:>9.3g}" for name in ("least", "median", "greatest"))
        lines.append(f"{entry['name']:36}{spread}  {1e3 * entry['seconds']:.3g} ms; {entry['reference']}")
    return lines


def lines_of_changes(changes: list[Change], n_left_out: int) -> list[str]:
    lines = [f"{'old':>9}{'new':>9}{'new/old':>9}          benchmark"]
    for change in changes:
        numbers = f"{change.old['median']:>9.3g}{change.new['median']:>9.3g}{change.quotient:>9.2f}"
        lines.append(f"{numbers}  {change.word:7} {change.group}: {change.name}")
    words = [change.word for change in changes]
    counts = f"{words.count('slower')} slower, {words.count('faster')} faster"
    return [*lines, f"{len(changes)} compared: {counts}; {n_left_out} in one file alone"]


def main() -> int:
    """Print a table; return 1 if something became slower."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.json", help="one run, or an old one and a new one")
    files = parser.parse_args().files
    if len(files) > 2:
        parser.error(f"{len(files)} files; one or two are needed")
    entries = [json.loads(path.read_text())["benchmarks"] for path in files]
    runs: list[Benchmarks] = [{(entry["group"], entry["name"]): entry for entry in each} for each in entries]
    if len(runs) == 1:
        print("\n".join(lines_of_run(*runs)))
        return 0
    changes = compare(*runs)
    print("\n".join(lines_of_changes(changes, len({*runs[0], *runs[1]}) - len(changes))))
    return int(any(change.word == "slower" for change in changes))


if __name__ == "__main__":
    raise SystemExit(main())
