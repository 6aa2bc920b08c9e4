"""Race the kernels against ipctk: search, residual and tangent as CSR, per slave segment, beside the memory bound.

    python evidence/bench/beside_ipctk.py                      # 1e3 to 1e6 segments and faces, in some minutes
    python evidence/bench/beside_ipctk.py --sizes 1e4 1e6 --only vts-ppt --out /tmp/race
    python evidence/bench/beside_ipctk.py --only vts-cell-3d   # on faces alone

`tox -e beside-ipctk` does the same with ipctk installed. ipctk is no requirement of the project.

Both get the same meshes: a wavy slave and a wavy master of 1.3 times as many segments. A penalty needs penetration and
a barrier a gap, so the slave is pressed in for the ones and lifted for the other, by so much that each slave node has a
partner. All run on one core, in turns, so that a slow moment of the machine hits all of them; the ratio belongs to one
turn. Seconds are those of the processor, since other programs may wait for the same core. The memory bound is the time
to write as many bytes as the tangent has, past the caches. The process keeps the memory that it has freed, as a long
one comes to do: in a new process ipctk's 1,000 faces would take 22 µs each instead of 13. Peak memory is that of a
process of its own, above what it needs for the mesh. Above 1e5 segments ours run alone.

In space both get a wavy square of triangles over a larger one, whose nodes are moved at random; a gap is a twentieth of
an edge, and ipctk's barrier acts from a tenth.

Two threads are raced against one by the wall clock, on all cores. `steps.csv` says where the time of vts-ppt goes: each
step of an evaluation in µs a segment, beside the memory bound.

Rule for the next editor: nobody is measured alone, and what is printed is the spread of ratios, not the best of them.
"""

import argparse
import csv
import ctypes
import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

os.environ |= {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

sys.path.append(str(Path(__file__).parents[1]))

import numpy as np
from origin import keep_commit
from scipy import sparse

from contactverif import Interface, Subject, evaluate_both, load_formulation
from contactverif.contract.interface import split_state
from contactverif.geometry import block_rows
from contactverif.geometry.block_rows import NO_NODE, Couplings, zero_matrix
from contactverif.geometry.projection import search_tree
from contactverif.geometry.threads import share_couplings
from contactverif_nts.vts_ppt_tangent import add_forces_and_tangent, list_couplings

OURS = ("vts-ppt", "vts-ppt, same pairing", "vts-ppt-balanced", "nts-ar", "sts", "mortar")
ON_FACES = ("vts-cell-3d", "vts-cell-3d, same pairing")
PEER, PEER_ON_FACES = "ipctk", "ipctk on faces"
SAME_PAIRING = ", same pairing"  # Behind the name of a formulation whose latest pattern is kept, as in Newton's method.
PARTS = ("search", "residual and tangent", "CSR")
TURNS = 9
LIFT = 0.5  # This lift gives the pressed slave a gap of 0.2 to 0.35 segments.
BARRIER_REACH = 0.4  # The distance from which ipctk's barrier acts: each node feels one or two partners.
STREAM_BYTES = 2**27  # Larger than the caches.
LEAST_FOR_PEAK = 100_000  # Segments.
LEAST_FOR_THREADS = 10_000  # Segments.
MOST_FOR_PEER = 100_000  # Segments; ipctk needs 5 GB for 1e6.
THREADED = ("vts-ppt", "vts-ppt-balanced")
FACE_GAP = 0.05  # The penetration, or the gap, over the edge of a square of two triangles.
FACE_REACH = 0.1  # The distance from which ipctk's barrier acts on faces, over the same edge.
LARGEST_PIECE = 2**25  # Bytes: glibc keeps what it frees of pieces up to these at most; larger ones go back at once.
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # The numbers by which mallopt(3) knows them.
SHORTEST_TURN = 0.05  # Seconds: a call that is shorter is repeated within its turn.
KILO = 1024  # Linux states the peak of a process in these bytes.
STATUS, RESET_PEAK = Path("/proc/self/status"), Path("/proc/self/clear_refs")  # proc(5) says how to use them.
COLUMNS = (
    "formulation", "segments", "least / µs", "median / µs", "greatest / µs", *(f"{part} / µs" for part in PARTS),
    "faster than ipctk, least", "faster, median", "faster, greatest", "over memory bound", "peak / bytes",
)  # fmt: skip


@dataclass(frozen=True)
class Racer:
    """Somebody who is timed: a call that returns (its tangent, its seconds for each part)."""

    name: str
    call: Callable[[], tuple[Any, tuple[float, ...]]]


def wavy(n_slave: int, lift: float = 0.0) -> Interface:
    """Return a wavy slave above a wavy master of 1.3 times as many segments, pressed in by about 0.2 of a segment."""
    upper, lower = np.linspace(0, n_slave, n_slave + 1), np.linspace(-0.3, n_slave + 0.4, int(1.3 * n_slave) + 1)
    slave = np.column_stack([upper, lift - 0.2 - 0.05 * np.cos(upper) ** 2])
    return Interface.from_chains(slave, np.column_stack([lower, 0.05 * np.sin(lower)])[::-1])


def wavy_faces(n_slave: int, gap: float = -FACE_GAP) -> tuple[Interface, float]:
    """Return a wavy square of about n_slave triangles over a larger one, and the edge of a square of two triangles.

    The gap is in such edges.
    """
    random, count = np.random.default_rng(0), max(1, round((n_slave / 2) ** 0.5))
    edge, sides = 12 / count, []
    for n, size, lift in ((count, 12.0, gap * edge), (max(1, round(0.93 * count)), 12.4, 0.0)):
        place = np.stack(np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij"), axis=-1)
        place[1:-1, 1:-1] += random.uniform(-0.2, 0.2, (n - 1, n - 1, 2))
        x, y = ((place / n - 0.5) * size).reshape(-1, 2).T
        number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
        a, b, c, d = (part.reshape(-1) for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
        faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        sides.append((np.column_stack([x, y, lift + 0.05 * np.sin(x) * np.cos(y)]), faces))
    (slave, slave_faces), (master, master_faces) = sides
    return Interface.from_faces(slave, slave_faces[:, ::-1], master, master_faces), edge


def our_racer(name: str, n_slave: int) -> Racer:
    """Return a formulation of ours as its plugin answers, without the checks of the harness."""
    keeps, interface = name.endswith(SAME_PAIRING), wavy_faces(n_slave)[0] if name in ON_FACES else wavy(n_slave)
    subject = load_formulation(name.removesuffix(SAME_PAIRING))
    assert isinstance(subject, Subject), subject
    plugin, z = subject.with_penalty(10.0).plugin, interface.nodes.ravel()

    def call() -> tuple[Any, tuple[float, ...]]:
        if not keeps:
            block_rows._latest.clear()
        times = [process_time()]
        pairing = plugin.pair(interface, z)
        times.append(process_time())
        _, tangent = evaluate_both(plugin, interface, pairing, z)
        times.append(process_time())
        tangent = sparse.csr_array(tangent)
        times.append(process_time())
        return tangent, tuple(np.diff(times))

    return Racer(name, call)


def peer_racer(name: str, n_slave: int) -> Racer:
    """Return ipctk: collisions by a bounding volume hierarchy, gradient and Hessian of its barrier."""
    import ipctk

    ipctk.set_num_threads(1)
    interface, reach, faces = wavy(n_slave, LIFT), BARRIER_REACH, ()
    if name == PEER_ON_FACES:
        interface, edge = wavy_faces(n_slave, FACE_GAP)
        reach = FACE_REACH * edge
    cells = np.asfortranarray(np.vstack([interface.slave.faces, interface.master.faces]), dtype=np.int32)
    if name == PEER_ON_FACES:
        cells, faces = ipctk.edges(cells), (cells,)
    vertices = np.asfortranarray(interface.nodes)
    mesh, barrier = ipctk.CollisionMesh(vertices, cells, *faces), ipctk.BarrierPotential(reach, 10.0)

    def call() -> tuple[Any, tuple[float, ...]]:
        times = [process_time()]
        collisions = ipctk.NormalCollisions()
        collisions.build(mesh, vertices, reach, broad_phase=ipctk.LBVH())
        times.append(process_time())
        barrier.gradient(collisions, mesh, vertices)
        hessian = barrier.hessian(collisions, mesh, vertices)  # Compressed columns of a symmetric matrix: its CSR.
        times.append(process_time())
        return hessian, (*np.diff(times), 0.0)

    return Racer(name, call)


def make_racer(name: str, n_slave: int) -> Racer:
    """Return the racer of that name on that mesh."""
    return peer_racer(name, n_slave) if name in (PEER, PEER_ON_FACES) else our_racer(name, n_slave)


def time_writing(stream: Any) -> float:
    """Return the seconds that writing a byte takes, in an array that no cache holds."""
    start = process_time()
    stream.fill(1.0)
    return (process_time() - start) / float(stream.nbytes)


def race(names: list[str], n_slave: int, turns: int) -> list[dict[str, Any]]:
    """Return a row of the table for each name, measured in turns."""
    racers, stream = [make_racer(name, n_slave) for name in names], np.ones(STREAM_BYTES // 8)
    n_bytes, repeats = [], []
    for racer in racers:
        racer.call()  # It compiles.
        tangent, parts = racer.call()
        n_bytes.append(tangent.data.nbytes + tangent.indices.nbytes + tangent.indptr.nbytes)
        repeats.append(max(1, round(SHORTEST_TURN / sum(parts))))
        del tangent
    parts_of, bound_of = np.empty((turns, len(racers), len(PARTS))), np.empty((turns, len(racers)))
    for turn in range(turns):
        for number, racer in enumerate(racers):
            parts_of[turn, number] = np.mean([racer.call()[1] for _ in range(repeats[number])], axis=0)
            bound_of[turn, number] = time_writing(stream) * n_bytes[number]
    return _rows(names, n_slave, parts_of, bound_of)


def _rows(names: list[str], n_slave: int, parts_of: Any, bound_of: Any) -> list[dict[str, Any]]:
    """Return the rows of times (turns, racers, parts) and memory bounds (turns, racers), all in seconds."""
    totals = parts_of.sum(axis=2)  # (turns, racers)
    peers = [totals[:, names.index(name)] for name in (PEER, PEER_ON_FACES) if name in names]
    peer = peers[0] if peers else np.full(len(totals), np.nan)
    rows = []
    for number, name in enumerate(names):
        seconds, micro = totals[:, number], 1e6 / n_slave
        values = [
            *(micro * each for each in _spread(seconds)),
            *(micro * np.median(parts_of[:, number], axis=0)),
            *_spread(peer / seconds),
            np.median(seconds / bound_of[:, number]),
        ]
        rows.append(dict(zip(COLUMNS, [name, n_slave, *map(float, values)], strict=False)))
    return rows


def _spread(values: Any) -> tuple[float, float, float]:
    """Return the least, median and greatest value."""
    return float(values.min()), float(np.median(values)), float(values.max())


def peak_memory(name: str, n_slave: int) -> float:
    """Return the bytes that one evaluation needs at its peak, above the mesh, in a process of its own."""
    if n_slave < LEAST_FOR_PEAK:
        return float("nan")
    command = [sys.executable, __file__, "--peak", name, "--sizes", str(n_slave)]
    return float(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))


def _measure_peak(name: str, n_slave: int) -> int:
    make_racer(name, 10).call()  # It loads the compiled kernels.
    racer = make_racer(name, n_slave)
    if RESET_PEAK.exists():  # Or the peak of making the mesh, and of the process that started this one, would hide it.
        RESET_PEAK.write_text("5")
    before = _peak_so_far()
    racer.call()
    return _peak_so_far() - before


def _peak_so_far() -> int:
    """Return the largest number of bytes that this process has had in memory since the last reset."""
    if STATUS.exists():
        (line,) = (line for line in STATUS.read_text().splitlines() if line.startswith("VmHWM"))
        return KILO * int(line.split()[1])
    return KILO * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def exponents(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Return the exponent of time against segments between 1e4, or the least mesh above it, and the largest mesh."""
    slopes = {}
    for name in dict.fromkeys(row["formulation"] for row in rows):
        mine = sorted(
            (row["segments"], row["segments"] * row["median / µs"]) for row in rows if row["formulation"] == name
        )
        (n, t), (m, s) = next((each for each in mine if each[0] >= 10_000), mine[0]), mine[-1]
        if n != m:
            slopes[name] = float(np.log(s / t) / np.log(m / n))
    return slopes


def keep_freed_memory() -> None:
    """Let the process keep the memory that it frees, so that the time of a call does not depend on those before it."""
    if sys.platform == "linux":
        library = ctypes.CDLL(None)
        library.mallopt(MMAP_THRESHOLD, LARGEST_PIECE)
        library.mallopt(TRIM_THRESHOLD, 2**30)


def race_threads(name: str, n_slave: int, turns: int) -> tuple[float, float, float]:
    """Return least, median and greatest of the seconds with one thread over those with two, by the wall clock."""
    racers = [our_racer(name, n_slave), our_racer(f"{name}:threads=2", n_slave)]
    times = np.empty((turns, 2))
    for racer in racers:
        racer.call()
    for turn in range(turns):
        for number, racer in enumerate(racers):
            start = perf_counter()
            racer.call()
            times[turn, number] = perf_counter() - start
    return _spread(times[:, 0] / times[:, 1])


def time_steps(n_slave: int, turns: int) -> dict[str, float]:
    """Return the median µs a segment of each step of an evaluation of vts-ppt, and the memory bound."""
    interface, subject = wavy(n_slave), load_formulation("vts-ppt")
    assert isinstance(subject, Subject), subject
    plugin, z, stream = subject.with_penalty(10.0).plugin, interface.nodes.ravel(), np.ones(STREAM_BYTES // 8)
    n_nodes, table = interface.n_nodes, []
    for _ in range(turns + 1):  # The first turn compiles.
        state = split_state(interface, z)
        clock = [process_time()]
        search_tree(interface.master, state[0])
        clock.append(process_time())
        pairing = plugin.pair(interface, z)
        clock.append(process_time())
        arguments = plugin._arguments(interface, pairing, z)
        couplings = list_couplings(*arguments[:2], plugin.n, plugin.n, NO_NODE)
        clock.append(process_time())
        block_rows._latest.clear()
        tangent = zero_matrix(n_nodes, 0, Couplings(couplings[0], couplings[1], couplings[1][:-1]))
        clock.append(process_time())
        rows, csr = np.zeros(z.size), (tangent.indptr, tangent.indices, tangent.data)
        (share,) = share_couplings(n_nodes, couplings[0], couplings[1], [(0, len(couplings[2]))])
        sweep = rows, csr, state, arguments, couplings, tuple(share)
        add_forces_and_tangent(*sweep)
        clock.append(process_time())
        add_forces_and_tangent(*sweep)
        clock.append(process_time())
        bound = time_writing(stream) * sum(part.nbytes for part in csr)
        table.append([*np.diff(clock), bound])
    names = ("tree of the master", "search and walk, with a tree", "which nodes feel which", "pattern of the tangent")
    names += ("forces and tangent", "forces and tangent, into memory that is there", "memory bound")
    return dict(zip(names, map(float, 1e6 / n_slave * np.median(table[1:], axis=0)), strict=True))


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Draw the cost of a segment or face against their number, and the memory bound of the first formulation."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    axes = figure.add_subplot()
    names = list(dict.fromkeys(row["formulation"] for row in rows))
    for name in names:
        mine = sorted((row for row in rows if row["formulation"] == name), key=lambda row: row["segments"])
        n, (low, middle, high) = [row["segments"] for row in mine], ([row[key] for row in mine] for key in COLUMNS[2:5])
        style = {"color": "black", "linestyle": "--"} if name in (PEER, PEER_ON_FACES) else {}
        (line,) = axes.loglog(n, middle, marker="o", markersize=4, label=name, **style)
        axes.fill_between(n, low, high, color=line.get_color(), alpha=0.2, linewidth=0)
        if name == names[0]:
            bound = [row["median / µs"] / row["over memory bound"] for row in mine]
            axes.loglog(n, bound, color="gray", linestyle=":", label=f"writing the tangent of {name}")
    unit = "face" if names[0] in ON_FACES else "segment"
    axes.set_xlabel(f"slave {unit}s N")
    axes.set_ylabel(f"search + residual + tangent, µs a slave {unit}", fontsize=9)
    axes.set_title("Cost of one evaluation, one core (band: least to greatest)", fontsize=10)
    axes.grid(which="major", alpha=0.3)
    figure.legend(fontsize=8, ncols=3, loc="outside lower center")
    figure.savefig(path, metadata={"Date": None})


def write(rows: list[dict[str, Any]], folder: Path, name: str) -> None:
    """Write the table and the figure of that name."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f"{name}.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(
            {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()} for row in rows
        )
    keep_commit(folder / f"{name}.csv")
    draw(rows, folder / f"{name}.svg")


def run_course(names: list[str], peer: str, file: str, options: argparse.Namespace) -> None:
    """Race some formulations and their peer at all sizes, print the table, and write it."""
    if not names:
        return
    rows: list[dict[str, Any]] = []
    racing = {n: [*names, peer] if n <= MOST_FOR_PEER else names for n in options.sizes}
    peaks = {(name, n): peak_memory(name, n) / n for n in options.sizes for name in racing[n]}
    print("  ".join(COLUMNS))
    for n_slave in options.sizes:
        for measured in race(racing[n_slave], n_slave, options.turns):
            row = measured | {COLUMNS[-1]: peaks[measured["formulation"], n_slave]}
            rows.append(row)
            print("  ".join(f"{value:.3g}" if isinstance(value, float) else str(value) for value in row.values()))
        write(rows, options.out, file)  # After each size, so that a race that is stopped leaves what it measured.
    print("exponent of the cost:", {name: round(slope, 3) for name, slope in exponents(rows).items()})


def write_steps(steps: dict[int, dict[str, float]], folder: Path) -> None:
    """Write steps.csv: a row for each step, a column for each number of segments."""
    with (folder / "steps.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["step of vts-ppt, µs a segment", *steps])
        for name in next(iter(steps.values())):
            writer.writerow([name, *(f"{step[name]:.4g}" for step in steps.values())])
    keep_commit(folder / "steps.csv")


def main() -> None:
    """Measure, print the tables, and write kernels.csv, steps.csv, faces.csv and the figures."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--sizes", nargs="+", type=lambda text: int(float(text)), default=[1000, 10_000, 100_000, 1_000_000]
    )
    parser.add_argument("--only", nargs="+", default=[*OURS, *ON_FACES], help="formulations")
    parser.add_argument("--turns", type=int, default=TURNS)
    parser.add_argument("--out", type=Path, default=Path("reports/bench"))
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--peak", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.peak:
        print(json.dumps(_measure_peak(options.peak, options.sizes[0])))
        return
    keep_freed_memory()
    plane = [name for name in options.only if name not in ON_FACES]
    speedups = {}
    if plane and (os.cpu_count() or 1) > 1:
        sizes = [n for n in options.sizes if n >= LEAST_FOR_THREADS]
        speedups = {(name, n): race_threads(name, n, options.turns) for name in THREADED for n in sizes}
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[options.core % len(cores)]})
    run_course(plane, PEER, "kernels", options)
    run_course([name for name in options.only if name in ON_FACES], PEER_ON_FACES, "faces", options)
    if plane:
        steps = {n: time_steps(n, options.turns) for n in options.sizes}
        write_steps(steps, options.out)
        for n_slave, step in steps.items():
            print(n_slave, {name: float(f"{value:.3g}") for name, value in step.items()})
    for (name, n_slave), spread in speedups.items():
        print(
            f"{name}, {n_slave}: two threads are {' / '.join(f'{value:.2f}' for value in spread)} times as fast as one"
        )


if __name__ == "__main__":
    main()
