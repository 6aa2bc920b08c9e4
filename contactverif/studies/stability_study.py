"""The stability sweeps: formulations on named states that get harder and harder, as a run like any other."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace

from contactverif.contract.result import NotLoaded, Run
from contactverif.contract.subject import Subject
from contactverif.plugins.provenance import collect_repeatable_facts
from contactverif.plugins.registry import load_properties
from contactverif.run.run import run
from contactverif.run.scheduler import Progress

PROPERTIES = ("stability.sweep", "stability.stiffness")  # Their cases are finite lists of named states.


def run_stability(
    subjects: Sequence[Subject | NotLoaded],
    *,
    progress: Callable[[Progress], None] | None = None,
    outputs: Sequence[str] = (),
) -> Run:
    """Judge formulations on all states of the sweeps."""
    result = run(subjects, load_properties(PROPERTIES), seed=0, progress=progress)
    names = [item.name if isinstance(item, Subject) else item.formulation for item in subjects]
    options = [word for output in outputs for word in ("--out", output)]
    command = shlex.join(["contactverif", "stability", *names, *options])
    return replace(result, provenance=collect_repeatable_facts() | {"command": command})
