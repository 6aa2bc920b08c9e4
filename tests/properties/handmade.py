"""Formulations of a few lines and meshes to draw by hand: the judge is tested without any code of a plugin."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from subjects import load_subject

from contactverif import Case, ContactPoints, Interface, Subject, Traits


class Handmade:
    """No force at all; what is tested is overridden."""

    def __init__(self, **traits: Any) -> None:
        self.traits = Traits().revise(**traits)
        self.penalty = 1.0

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return 0 * z

    def points(self, *, c: float, half_area: float = np.nan) -> ContactPoints:
        """One point, on the first slave segment."""
        nan, place = np.array([np.nan]), np.full((1, 2), np.nan)
        segments, area = (np.array([0]), np.array([-1])), (np.array([c - half_area]), np.array([c + half_area]))
        return ContactPoints(
            segments[0], np.array([c]), segments[1], nan, place, place, nan, nan, nan, np.array([True]), *area
        )


class OneForce(Handmade):
    """A force on y of the first node, `force(z, pairing)`, and its derivative by that y, `stiffness(z, pairing)`."""

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = 0 * z
        forces[..., 1] = self.force(z, pairing)
        return forces

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        k = np.zeros((z.size, z.size))
        k[1, 1] = self.stiffness(z, pairing)
        return k


class Springs(Handmade):
    """A spring between the ends of the slave segment; its stiffness is of the kind that the traits promise."""

    def stretch(self, z: Any) -> Any:
        return z[2:4] - z[0:2]

    def area(self, z: Any) -> float:
        along = self.stretch(z)
        return float(np.sqrt(along @ along)) if self.traits.rules.penalty == "distributed" else 1.0

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = 0 * z
        force = self.penalty * self.area(z) * self.stretch(z)
        forces[0:2], forces[2:4] = -force, force
        return forces

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        along, area = self.stretch(z), self.area(z)
        k = self.penalty * area * np.eye(2)
        if self.traits.rules.penalty == "distributed":
            k = k + self.penalty * np.outer(along, along) / area
        tangent = np.zeros((z.size, z.size))
        tangent[:4, :4] = np.kron([[1, -1], [-1, 1]], k)
        return tangent


class Plain:
    """A formulation in doubles alone, with an error in its tangent if asked for; without a pairing if asked for."""

    def __init__(self, inner: Any, change: Any = None, *, paired: bool = True) -> None:
        self._inner, self._change = inner, change
        self.traits = inner.traits.revise(takes_complex=False, takes_longdouble=False, batched=False)
        if hasattr(inner, "n_multipliers"):
            self.n_multipliers = inner.n_multipliers
        if paired:
            self.pair = inner.pair

    def _ask(self, verb: str, interface: Any, pairing: Any, z: Any) -> Any:
        if not hasattr(self, "pair"):
            pairing = self._inner.pair(interface, z)
        return getattr(self._inner, verb)(interface, pairing, z)

    def residual(self, *state: Any) -> Any:
        return self._ask("residual", *state)

    def tangent(self, *state: Any) -> Any:
        matrix = self._ask("tangent", *state)
        if self._change is None:
            return matrix
        matrix = matrix.toarray()
        self._change(state[0], matrix)
        return matrix


def plain(name: str, change: Any = None, *, paired: bool = True) -> Subject:
    inner = load_subject(name)
    return Subject(name, lambda *, penalty: Plain(inner.with_penalty(penalty).plugin, change, paired=paired))


def subject(plugin: Callable[..., Any], **options: Any) -> Subject:
    """Return a formulation on trial: `plugin(**options)` with the penalty as an attribute."""

    def make(*, penalty: float) -> Any:
        formulation = plugin(**options)
        formulation.penalty = penalty
        return formulation

    return Subject("handmade", make)


def over_a_node(offset: float, *, gap: float = -1 / 8) -> Case:
    """One slave segment of length 1 over two master segments of length 2; its middle `offset` right of their node."""
    slave = np.array([[-0.5, gap], [0.5, gap]]) + [offset, 0]
    master = np.array([[2.0, 0], [0, 0], [-2, 0]])
    interface = Interface.from_chains(slave - [0, gap], master)
    return Case(interface, np.vstack([slave, master]).reshape(-1), 4.0)


def case(**other: Any) -> Case:
    """One slave segment in the middle of one of two master segments: nothing is near a kink."""
    return replace(over_a_node(6 / 7), **other)
