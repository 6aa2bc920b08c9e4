"""Comparison of a formulation from a library with one of ours."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import contactverif.cli
from contactverif import Interface, Subject, Surface, load_formulation
from contactverif.contract.case import Case
from contactverif.isolation.limits import Limits

Build = Callable[..., Path]
TEMPLATES = Path(contactverif.cli.__file__).parent / "templates"
CASES = ("a1", "b", "c-prime", "offset-c", "tilted", "sliding", "moved")


def subject_of(text: str, limits: Limits | None = None) -> Subject:
    subject = load_formulation(text, limits)
    assert isinstance(subject, Subject), subject
    return subject


def agree(mine: Any, ours: Any, factor: float = 64) -> None:
    """Compare forces or tangents to roundoff of their largest entry."""
    assert np.abs(mine - ours).max() <= factor * np.finfo(float).eps * np.abs(ours).max()


def compare(text: str, reference: str, case: Case) -> None:
    """Compare forces and tangents of two formulations with the same penalty."""
    penalty = subject_of(reference).penalty(case)
    mine, ours = (subject_of(name).with_penalty(penalty) for name in (text, reference))
    agree(mine.residual(case.interface, None, case.z), ours.residual(case.interface, None, case.z))
    agree(mine.tangent(case.interface, None, case.z), ours.tangent(case.interface, None, case.z))


def ring_case() -> Case:
    """Return three slave nodes in contact with a closed master, an octagon."""
    angle = np.arange(8) * np.pi / 4
    ring = np.column_stack([np.cos(angle), np.sin(angle)])  # The body is on the left, inside.
    slave = np.array([[-0.7, 0.6], [-0.1, 0.9], [0.4, 0.86]])
    segments = 3 + np.column_stack([np.arange(8), (np.arange(8) + 1) % 8])
    interface = Interface(np.vstack([slave, ring]), Surface([[0, 1], [1, 2]]), Surface(segments))
    return Case(interface=interface, z=interface.nodes.ravel(), penalty=3.0)
