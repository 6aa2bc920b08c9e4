"""A user element of a solver as a formulation: the harness pairs, calls the element for each pair, and assembles.

A user element decides by itself whether it is in contact (`IF (G.GE.0) RETURN`). So what the harness pairs is only half
of the decisions, and it travels in a `Handle`: the harness pairs anew at each state.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.option_checks import check_count, check_penalty, check_tau
from contactverif.contract.pairing import Handle, Pairing
from contactverif.contract.traits import Traits
from contactverif_foreign.element_pairs import RULES, Elements
from contactverif_foreign.guarded_slot import Argument, GuardedSlot, SlotRows
from contactverif_foreign.shared_library import find_file, find_function, load_library, parse_numbers
from contactverif_foreign.traits_file import traits_beside


@dataclass(frozen=True, slots=True)
class Convention:
    """The arguments of the user elements of a solver.

    `arguments` and `constants` get the numbers of nodes, properties and state variables. `fill` gets elements,
    reference positions and displacements (n, n_nodes, 2), and properties (n, n_properties). `constants` and `fill`
    return the values of arguments by name.
    """

    name: str
    arguments: Callable[[int, int, int], list[Argument]]
    constants: Callable[[int, int, int], dict[str, Any]]
    order: tuple[str, ...]  # The names of the arguments in the order of the call.
    fill: Callable[[Elements, FloatArray, FloatArray, FloatArray], dict[str, Any]]
    forces: str  # The argument with minus the residual.
    matrix: str  # The argument with its derivative, column by column.
    flaw: Callable[[SlotRows], tuple[int, str] | None] = lambda rows: None  # An element that gave up, and its words.
    # Gets the library and the number of nodes before elements are called.
    announce: Callable[[ctypes.CDLL, int], None] = lambda library, n_nodes: None


@dataclass(frozen=True, slots=True, eq=False)
class Routine:
    """A loaded user element with its memory; it does not depend on the penalty."""

    convention: Convention
    library: ctypes.CDLL
    function: Any
    state_variables: int
    slots: dict[tuple[int, int], tuple[GuardedSlot, list[Any]]] = field(default_factory=dict)

    def slot(self, n_nodes: int, n_properties: int) -> tuple[GuardedSlot, list[Any]]:
        """Return the memory of a call for elements of so many nodes, and the arguments of the call."""
        key = n_nodes, n_properties
        if key not in self.slots:
            numbers = n_nodes, n_properties, self.state_variables
            slot = GuardedSlot(self.convention.arguments(*numbers), 2 * n_nodes)
            slot.preset(self.convention.constants(*numbers))
            values = [ctypes.c_void_p(slot.addresses[name]) for name in self.convention.order]
            self.slots[key] = slot, values
        return self.slots[key]


@dataclass(frozen=True, slots=True, eq=False)
class UserElement:
    """A formulation whose forces and tangents come from a user element."""

    traits: Traits
    penalty: float
    routine: Routine
    nodes: int | str  # 3, 4 or "n", as in `RULES`.
    properties: tuple[float, ...]
    tau: float

    def pair(self, interface: Interface, z: FloatArray, /) -> dict[str, Handle]:
        """Choose the nodes of each element, and keep them in a handle."""
        return {"elements": Handle(RULES[self.nodes](interface, z.reshape(-1, 2), self.tau))}

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the nodal forces (n_unknowns,), minus those of the element."""
        forces, _ = self.residual_and_tangent(interface, pairing, z)
        return forces

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> Any:
        """Return the derivative of the residual as the element computes it, sparse."""
        return self.residual_and_tangent(interface, pairing, z)[1]

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> tuple[FloatArray, Any]:
        """Return the residual and its derivative from one call of each element."""
        displacements, parts = z.reshape(-1, 2) - interface.nodes, []
        for elements in pairing.handle:
            if len(elements.nodes):
                vectors, matrices = self._sweep(elements, interface.nodes, displacements)
                parts.append((unknowns_of(elements.nodes), -vectors, matrices))
        return assemble(z.size, parts, by_columns=True)

    def _sweep(self, elements: Elements, reference: FloatArray, displacements: FloatArray) -> tuple[Array, Array]:
        """Call the element for each pair; return copies of its vectors (n, size) and matrices (n, size, size)."""
        convention, size = self.routine.convention, 2 * elements.nodes.shape[1]
        properties = np.empty((len(elements.nodes), 2 + len(self.properties)))
        properties[:, 0], properties[:, 1], properties[:, 2:] = self.penalty, elements.lengths, self.properties
        slot, values = self.routine.slot(elements.nodes.shape[1], properties.shape[1])
        rows = slot.rows(len(elements.nodes))
        rows.fill(convention.fill(elements, reference[elements.nodes], displacements[elements.nodes], properties))

        def describe_row(row: int) -> str:
            return f"{convention.name}: element {row + 1} (nodes {', '.join(map(str, elements.nodes[row]))})"

        convention.announce(self.routine.library, elements.nodes.shape[1])
        rows.call(self.routine.function, values, describe_row)
        if (flaw := convention.flaw(rows)) is not None:
            raise ContractError(f"{describe_row(flaw[0])}: {flaw[1]}")
        return rows[convention.forces][:, :size].copy(), rows[convention.matrix].reshape(-1, size, size).copy()


def unknowns_of(nodes: IntArray) -> IntArray:
    """Return the numbers (n, 2 n_nodes) of the unknowns of elements with nodes (n, n_nodes)."""
    return (2 * nodes[..., None] + np.arange(2)).reshape(len(nodes), -1)


def assemble(
    size: int, parts: Iterable[tuple[IntArray, Array, Array]], *, by_columns: bool
) -> tuple[FloatArray, sparse.csr_array]:
    """Return the sum of all vectors (size,) and that of all matrices, sparse.

    A part is elements alike: their unknowns (n, m), vectors (n, m), and matrices of m² entries, row by row or column by
    column.
    """
    total, rows, columns, entries = np.zeros(size), [np.zeros(0, int)], [np.zeros(0, int)], [np.zeros(0)]
    for unknowns, vectors, matrices in parts:
        np.add.at(total, unknowns, vectors)
        shape = (*unknowns.shape, unknowns.shape[1])
        first, last = (np.broadcast_to(each, shape).ravel() for each in (unknowns[..., None], unknowns[:, None]))
        rows.append(last if by_columns else first)
        columns.append(first if by_columns else last)
        entries.append(matrices.ravel())
    places = np.concatenate(rows), np.concatenate(columns)
    return total, sparse.coo_array((np.concatenate(entries), places), shape=(size, size)).tocsr()


def load_element(
    convention: Convention,
    names: Sequence[str],
    *,
    penalty: float,
    file: str,
    nodes: int | str,
    svars: int,
    props: float | str,
    traits: str,
    tau: float,
) -> UserElement:
    """Return the formulation of a user element that a library has under one of these names, its options checked."""
    check_penalty(penalty)
    check_tau(tau)
    check_count(svars, "svars", 0)
    if isinstance(nodes, bool) or nodes not in RULES:
        raise MisuseError("option nodes", repr(nodes), f"one of {', '.join(map(str, RULES))}")
    path = find_file(file)
    routine = _load_routine(convention, path, tuple(names), svars)
    properties = parse_numbers("option props", props)
    return UserElement(_read_traits(path, traits), float(penalty), routine, nodes, properties, tau)


# A formulation is made anew for the penalty of each case.
_read_traits = lru_cache(maxsize=16)(traits_beside)


@lru_cache(maxsize=16)
def _load_routine(convention: Convention, path: Path, names: tuple[str, ...], state_variables: int) -> Routine:
    """Return the subroutine of a library, with its memory."""
    library = load_library(path)
    function = find_function(library, path, *names)
    function.restype = None
    return Routine(convention, library, function, state_variables)
