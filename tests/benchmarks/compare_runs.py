"""Print the ratios of a run of the benchmarks, or compare those of two runs.

    python tests/benchmarks/compare_runs.py reports/bench/benchmarks.json
    python tests/benchmarks/compare_runs.py reports/bench/benchmarks.json new.json

A run knows the time of each call over that of a reference, measured in the same turns. So a machine that is slower or
busier changes both, and the quotient of two ratios says what became slower. The exit status is 1 if something did.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SLOWER = 1.25  # The quotient of two medians above which a change is reported, as in `contactverif bench --against`.

Key = tuple[str, str]


@dataclass(frozen=True)
class Change:
    """The ratio of a benchmark in two runs.

    Attributes
    ----------
    group, name : str
        The benchmark.
    old, new : dict[str, float]
        The least, median and greatest ratio.
    """

    group: str
    name: str
    old: dict[str, float]
    new: dict[str, float]

    @property
    def quotient(self) -> float:
        """The new median over the old one."""
        return self.new["median"] / self.old["median"]

    @property
    def word(self) -> str:
        """The change in one word, if the medians are apart and the turns of both runs do not overlap."""
        if self.quotient > SLOWER and self.new["least"] > self.old["greatest"]:
            return "slower"
        if self.quotient < 1 / SLOWER and self.new["greatest"] < self.old["least"]:
            return "faster"
        return ""


def read(path: Path) -> dict[Key, dict[str, Any]]:
    """Return the benchmarks of a file by group and name."""
    return {(entry["group"], entry["name"]): entry for entry in json.loads(path.read_text())["benchmarks"]}


def compare(old: dict[Key, dict[str, Any]], new: dict[Key, dict[str, Any]]) -> list[Change]:
    """Return the changes of all benchmarks that both runs have, the largest first.

    A ratio belongs to its reference, so a benchmark with another reference is left out.
    """
    common = [key for key in new if key in old and old[key]["reference"] == new[key]["reference"]]
    changes = [Change(*key, old[key]["ratio"], new[key]["ratio"]) for key in common]
    return sorted(changes, key=lambda change: -change.quotient)


def lines_of_run(run: dict[Key, dict[str, Any]]) -> list[str]:
    """Return the table of one run."""
    lines, group = [], ""
    for entry in run.values():
        if entry["group"] != group:
            group = entry["group"]
            lines += ["", f"{group}: time over that of a reference", f"{'':36}{'least':>9}{'median':>9}{'greatest':>9}"]
        spread = "".join(f"{entry['ratio'][name]:>9.3g}" for name in ("least", "median", "greatest"))
        lines.append(f"{entry['name']:36}{spread}  {1e3 * entry['seconds']:.3g} ms; {entry['reference']}")
    return lines


def lines_of_changes(changes: list[Change], n_left_out: int) -> list[str]:
    """Return the table of two runs."""
    lines = [f"{'old':>9}{'new':>9}{'new/old':>9}          benchmark"]
    for change in changes:
        numbers = f"{change.old['median']:>9.3g}{change.new['median']:>9.3g}{change.quotient:>9.2f}"
        lines.append(f"{numbers}  {change.word:7} {change.group}: {change.name}")
    n_slower = sum(change.word == "slower" for change in changes)
    n_faster = sum(change.word == "faster" for change in changes)
    lines.append(f"{len(changes)} compared: {n_slower} slower, {n_faster} faster; {n_left_out} in one file alone")
    return lines


def main() -> int:
    """Print a table; return 1 if something became slower."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.json", help="one run, or an old one and a new one")
    files = parser.parse_args().files
    if len(files) > 2:
        parser.error(f"{len(files)} files; one or two are needed")
    runs = [read(path) for path in files]
    if len(runs) == 1:
        print("\n".join(lines_of_run(runs[0])))
        return 0
    changes = compare(*runs)
    print("\n".join(lines_of_changes(changes, len({*runs[0], *runs[1]}) - len(changes))))
    return int(any(change.word == "slower" for change in changes))


if __name__ == "__main__":
    raise SystemExit(main())
