"""Formulations, axes and bodies that the tests of mechanics have in common."""

from dataclasses import replace
from math import cos, inf, radians, sin
from typing import Any

import pytest
from subjects import load_subject

from contactverif import Body, CheckedFormulation, Scene, Trace, solve
from contactverif.mechanics import bulk

ALL = ("nts", "nts-ar", "vts-g", "vts-me", "vts-ppt", "vts-ppt-basic", "vts-ppt-balanced")
LEANING = (cos(radians(17.3)), sin(radians(17.3)))


def on(name: str, scene: Scene) -> CheckedFormulation:
    return load_subject(name).for_case(scene.case())


def solve_named(name: str, scene: Scene, **options: Any) -> Trace:
    return solve(scene, on(name, scene), **options)


def in_triangles(body: Body) -> Body:
    """Cut each quadrilateral of a body in two."""
    return replace(body, cells=[row[ends] for ends in ([0, 1, 2], [0, 2, 3]) for row in body.cells])


def make_sparse(monkeypatch: pytest.MonkeyPatch, full: float = inf) -> None:
    """Make small scenes sparse as large ones are; from the share `full` of entries on, the stiffness stays dense."""
    monkeypatch.setattr(bulk, "DENSE_LIMIT", 0)
    monkeypatch.setattr(bulk, "DENSE_SHARE", full)
