"""A comparison of candidates with a reference: one run over the same cases, and the cost of an evaluation.

A run checks one formulation after the other, so its seconds depend on who came first and on what was shrunk. For the
cost all formulations take turns on the same states. The first turn is not timed: kernels compile and answers are
checked in it. Of many turns the fastest counts, because whatever disturbs a machine only adds time. The plugin itself
is timed, without the checks of the harness, which would make fast and slow ones alike.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import nan
from time import perf_counter
from typing import Any

import numpy as np

from contactverif.contract.arrays import freeze
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.property import Property
from contactverif.contract.result import NotLoaded, Run
from contactverif.contract.subject import Subject
from contactverif.isolation.remote import RemoteFormulation
from contactverif.run.run import run
from contactverif.sampling.draw import Sampling, with_case
from contactverif_reports.comparisons import PARTS, Comparison, Cost, Differing

TURNS = 3  # The least number of turns that are timed.
MOST_TURNS = 60
ENOUGH_SECONDS = 3.0  # More turns than `TURNS` are taken as long as all of them took less than this.
SEGMENTS = (16, 256)  # Slave segments: few show what a call costs, many show what a segment costs.


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """A comparison with all that it rests on."""

    run: Run  # The run of reference and candidates, as `verify` makes it.
    comparison: Comparison  # Its numbers side by side.
    # The case of each property on which they differ most, the largest difference first.
    differing: tuple[Differing, ...]
    apart: tuple[str, ...] = ()  # The candidates with other cases: of another dimension, or on other faces.


def run_comparison(
    reference: Subject,
    candidates: Sequence[Subject | NotLoaded],
    properties: Sequence[Property | NotLoaded],
    *,
    place: Interface | Case | None = None,
    **options: Any,
) -> Study:
    """Check every property of the reference and of the candidates, on the same cases; options are those of `run`."""
    if not candidates:
        raise MisuseError("NAME", "nothing", f"a formulation to compare with {reference.name}")
    loaded = [candidate for candidate in candidates if isinstance(candidate, Subject)]
    names = [item.formulation if isinstance(item, NotLoaded) else item.name for item in candidates]
    if reference.name in names:
        raise MisuseError("--against", f"{reference.name}, which is compared too", "another formulation than those")
    result = run([reference, *candidates], properties, place=place, **options)
    comparison = Comparison.from_run(result, reference.name)
    abilities = [subject.traits.abilities for subject in (reference, *loaded)]
    faces, *others = (() if each.in_plane else each.faces for each in abilities)
    apart = tuple(subject.name for subject, there in zip(loaded, others, strict=True) if there != faces)
    variants = [item.for_traits(reference.traits) for item in properties if isinstance(item, Property)]
    question_of = {question.id: question for question in variants}
    sampling = Sampling.at(place, int(result.provenance["examples"]), int(result.provenance["seed"]))
    differing = []
    for each in comparison.differing:
        outcome = each.pair.new.row.outcomes[each.number]
        case = with_case(sampling, question_of[each.info.id], each.number, outcome).case
        differing.append(replace(each, case=case))
    return Study(result, comparison, tuple(differing), apart)


def measure_costs(
    subjects: Sequence[Subject],
    cases: Sequence[Case] | None = None,
    turns: int = TURNS,
    progress: Callable[[str, int, int], None] = lambda words, n_finished, n_planned: None,
) -> tuple[Cost, ...]:
    """Time each formulation on each state, in turns, and return the fastest times."""
    costs: list[Cost] = []
    for case in cases if cases is not None else [make_state(n) for n in SEGMENTS]:
        fastest, failed = [dict.fromkeys(PARTS, nan) for _ in subjects], [""] * len(subjects)
        start, turn = perf_counter(), 0
        while turn <= turns or (turn <= MOST_TURNS and perf_counter() - start < ENOUGH_SECONDS):
            for place in range(len(subjects)):
                number = (place + turn) % len(subjects)
                if failed[number]:
                    continue
                name, n_segments = subjects[number].name, len(case.interface.slave)
                progress(f"timing an evaluation of {name} on {n_segments} segments", min(turn, turns), turns + 1)
                try:
                    times = _take_turn(subjects[number], case, checked=turn == 0)
                except Exception as error:  # A plugin without the harness' guard may raise anything.
                    failed[number], fastest[number] = f"{error}", dict.fromkeys(PARTS, nan)
                    continue
                for part in times if turn else ():
                    fastest[number][part] = float(np.fmin(fastest[number][part], times[part]))
            turn += 1
        for subject, seconds, reason in zip(subjects, fastest, failed, strict=True):
            costs.append(Cost(subject.name, len(case.interface.slave), seconds, reason))
    return tuple(costs)


def make_state(n_segments: int, ratio: float = 0.75, before: float = 0.5) -> Case:
    """Return a flat interface of that many unit slave segments, on `ratio` times as many, all of it in contact.

    The master is longer by 1, and begins by the length `before` the slave.
    """
    n_master = max(1, int(ratio * n_segments))
    slave_x = np.arange(n_segments + 1.0)
    master_x = np.linspace(-before, n_segments + (1 - before), n_master + 1)[::-1]
    depth = (1 + slave_x % 3) / 64  # 1/64 to 3/64, so that no force is a repetition of its neighbour's.
    upper, lower = (np.column_stack([x, np.zeros_like(x)]) for x in (slave_x, master_x))
    interface = Interface.from_chains(upper, lower)
    upper[:, 1] = -depth
    return Case(interface, np.vstack([upper, lower]).reshape(-1), penalty=16.0)


def _take_turn(subject: Subject, case: Case, *, checked: bool) -> dict[str, float]:
    """Return the seconds of each part of one evaluation, by the plugin or with the checks of the harness."""
    formulation = subject.for_case(case)
    plugin: Any = formulation if checked else formulation.plugin
    interface = case.interface
    z = freeze(np.concatenate([case.z, np.zeros(formulation.n_multipliers(interface))]), np.float64)
    pairing = formulation.own_pairing(interface, z)
    if isinstance(plugin, RemoteFormulation):
        plugin.timed = True
    times = {}
    if "pair" in subject.provides:
        times["pair"] = _seconds(plugin, lambda: plugin.pair(interface, z))
    times["residual"] = _seconds(plugin, lambda: plugin.residual(interface, pairing, z))
    if "tangent" in subject.provides:
        times["tangent"] = _seconds(plugin, lambda: plugin.tangent(interface, pairing, z))
    return times


def _seconds(plugin: Any, call: Callable[[], Any]) -> float:
    """Return the seconds of a call; where the plugin has a process of its own, those that it took there."""
    start = perf_counter()
    call()
    there = plugin.seconds() if isinstance(plugin, RemoteFormulation) else nan
    here = perf_counter() - start
    return there if 0 <= there <= here else here  # A plugin's process may say what it likes.
