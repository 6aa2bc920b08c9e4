"""User elements of a solver as formulations: the harness pairs, calls the element for each pair, and assembles.

A user element decides by itself whether it is in contact (`IF (G.GE.0) RETURN`). So what the harness pairs is only half
of the decisions, and it travels in a `Handle`: the harness pairs anew at each state.

- UEL of Abaqus has 36 arguments, for one static increment. `RHS` is minus the residual, `AMATRX` its derivative.
- FEAP calls `elmtNN(d, ul, xl, ix, tl, s, p, ndf, ndm, nst, isw)`. `p` is minus the residual, `s` its derivative.
"""

import ctypes
import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError
from contactverif.contract.formulation import Handle, Pairing, check_count, check_penalty, check_tau
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif.geometry.block_rows import TangentOfBoth
from contactverif_foreign import shared_library
from contactverif_foreign.element_pairs import RULES, Elements
from contactverif_foreign.shared_library import Argument, GuardedSlot, SlotRows


class Convention:
    """The arguments of the user elements of a solver, by name. What no method says is zero."""

    name: str
    order: tuple[str, ...]  # The names of the arguments in the order of the call.
    integers: tuple[str, ...]  # The arguments that are integers, and those that the element may write.
    outputs: tuple[str, ...]
    forces: str  # The argument with minus the residual.
    matrix: str  # The argument with its derivative, column by column.

    def shapes(self, n_nodes: int, n_properties: int, n_state: int) -> dict[str, tuple[int, ...]]:
        """Return the shapes of the arguments that are arrays."""
        raise NotImplementedError

    def constants(self, n_nodes: int, n_properties: int, n_state: int) -> dict[str, Any]:
        """Return the values that are the same for all elements."""
        raise NotImplementedError

    def fill(self, elements: Elements, reference: FloatArray, u: FloatArray, properties: FloatArray) -> dict[str, Any]:
        """Return the others from reference positions and displacements (n, n_nodes, 2), and properties (n, …)."""
        raise NotImplementedError

    def flaw(self, rows: SlotRows) -> tuple[int, str] | None:
        """Return the first element that gave up, and its words."""

    def announce(self, library: ctypes.CDLL, n_nodes: int) -> None:
        """Tell a library the number of nodes before its elements are called."""


@dataclass(frozen=True, slots=True, eq=False)
class Routine:
    """A loaded user element with its memory; it does not depend on the penalty."""

    convention: Convention
    library: ctypes.CDLL
    function: Any
    state_variables: int
    slots: dict[tuple[int, int], GuardedSlot] = field(default_factory=dict)

    def slot(self, n_nodes: int, n_properties: int) -> GuardedSlot:
        """Return the memory of a call for elements of so many nodes and properties."""
        if (key := (n_nodes, n_properties)) not in self.slots:
            convention, sizes, arguments = self.convention, (n_nodes, n_properties, self.state_variables), []
            shapes = convention.shapes(*sizes)
            for name in convention.order:
                kind: Literal["integer", "real"] = "integer" if name in convention.integers else "real"
                arguments.append(Argument(name, shapes.get(name, ()), kind, name not in convention.outputs))
            self.slots[key] = GuardedSlot(arguments, 2 * n_nodes)
            self.slots[key].preset(convention.constants(*sizes))
        return self.slots[key]


@dataclass(frozen=True, slots=True, eq=False)
class UserElement(TangentOfBoth):
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
        return self.residual_and_tangent(interface, pairing, z)[0]

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> tuple[FloatArray, Any]:
        """Return the residual and its derivative from one call of each element."""
        displacements, parts = z.reshape(-1, 2) - interface.nodes, []
        for elements in pairing.handle:
            if len(elements.nodes):
                vectors, matrices = self._sweep(elements, interface.nodes, displacements)
                parts.append((unknowns_of(elements.nodes), -vectors, matrices))
        return assemble(z.size, parts, by_columns=True)

    def _sweep(self, elements: Elements, reference: FloatArray, displacements: FloatArray) -> tuple[Array, Array]:
        convention, size = self.routine.convention, 2 * elements.nodes.shape[1]
        properties = np.empty((len(elements.nodes), 2 + len(self.properties)))
        properties[:, 0], properties[:, 1], properties[:, 2:] = self.penalty, elements.lengths, self.properties
        slot = self.routine.slot(elements.nodes.shape[1], properties.shape[1])
        values = [ctypes.c_void_p(slot.addresses[name]) for name in convention.order]
        rows = slot.rows(len(elements.nodes))
        rows.fill(convention.fill(elements, reference[elements.nodes], displacements[elements.nodes], properties))

        def describe_row(row: int) -> str:
            return f"{convention.name}: element {row + 1} (nodes {', '.join(map(str, elements.nodes[row]))})"

        convention.announce(self.routine.library, elements.nodes.shape[1])
        rows.call(self.routine.function, values, describe_row)
        if (flaw := convention.flaw(rows)) is not None:
            raise ContractError(f"{describe_row(flaw[0])}: {flaw[1]}")
        if len(places := np.argwhere(~np.isfinite(rows[convention.forces]))):
            words = f"number {places[0, 1] + 1} of {convention.forces} is not finite; is an array read past its end?"
            raise NonFiniteError(f"{describe_row(places[0, 0])}: {words} What lies behind it is NaN")
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


def _load_element(
    convention: Convention,
    name: str,
    penalty: float,
    file: str,
    nodes: int | str,
    svars: int,
    props: float | str,
    traits: str,
    tau: float,
) -> UserElement:
    check_penalty(penalty)
    check_tau(tau)
    check_count(svars, "svars", 0)
    if isinstance(nodes, bool) or nodes not in RULES:
        raise MisuseError("option nodes", repr(nodes), f"one of {', '.join(map(str, RULES))}")
    path = shared_library.find_file(file)
    routine = _load_routine(convention, path, shared_library.fortran_names(name), svars)
    properties = shared_library.parse_props(props)
    return UserElement(_read_traits(path, traits), float(penalty), routine, nodes, properties, tau)


# A formulation is made anew for the penalty of each case.
_read_traits = lru_cache(maxsize=16)(shared_library.traits_beside)


@lru_cache(maxsize=16)
def _load_routine(convention: Convention, path: Path, names: tuple[str, ...], state_variables: int) -> Routine:
    library = shared_library.load_library(path)
    function = shared_library.find_function(library, path, *names)
    function.restype = None
    return Routine(convention, library, function, state_variables)


class _Uel(Convention):
    """Elements of Abaqus. `COORDS` is the reference configuration and `U` the displacement from it.

    Forces and matrix are zero before the call, and so are the state variables: a formulation has no history.
    """

    name, forces, matrix = "uel", "RHS", "AMATRX"
    order = (
        *("RHS", "AMATRX", "SVARS", "ENERGY", "NDOFEL", "NRHS", "NSVARS", "PROPS", "NPROPS", "COORDS", "MCRD", "NNODE"),
        *("U", "DU", "V", "A", "JTYPE", "TIME", "DTIME", "KSTEP", "KINC", "JELEM", "PARAMS", "NDLOAD", "JDLTYP"),
        *("ADLMAG", "PREDEF", "NPREDF", "LFLAGS", "MLVARX", "DDLMAG", "MDLOAD", "PNEWDT", "JPROPS", "NJPROP", "PERIOD"),
    )
    integers = (
        *("NDOFEL", "NRHS", "NSVARS", "NPROPS", "MCRD", "NNODE", "JTYPE", "KSTEP", "KINC", "JELEM", "NDLOAD", "NPREDF"),
        *("MLVARX", "MDLOAD", "NJPROP", "JDLTYP", "LFLAGS", "JPROPS"),
    )
    outputs = ("RHS", "AMATRX", "SVARS", "ENERGY", "PNEWDT")
    flags = (1, 1, 1, 0, 0)  # Static analysis, large displacements, forces and matrix, a general step.

    def shapes(self, n_nodes: int, n_properties: int, n_state: int) -> dict[str, tuple[int, ...]]:
        size = 2 * n_nodes
        vectors = dict.fromkeys(("U", "V", "A"), (size,)) | dict.fromkeys(("RHS", "DU"), (size, 1))
        matrices = {"AMATRX": (size, size), "COORDS": (2, n_nodes), "PREDEF": (2, 1, n_nodes)}
        loads = dict.fromkeys(("JDLTYP", "ADLMAG", "DDLMAG"), (1, 1))
        sizes = {"SVARS": n_state, "ENERGY": 8, "PROPS": n_properties, "TIME": 2, "PARAMS": 3, "JPROPS": 4, "LFLAGS": 5}
        return vectors | matrices | loads | {name: (n,) for name, n in sizes.items()}

    def constants(self, n_nodes: int, n_properties: int, n_state: int) -> dict[str, Any]:
        sizes = dict.fromkeys(("NDOFEL", "MLVARX"), 2 * n_nodes) | {"NNODE": n_nodes}
        ones = ("NRHS", "JTYPE", "TIME", "DTIME", "KSTEP", "KINC", "NPREDF", "MDLOAD", "PNEWDT", "PERIOD")
        others = {"NPROPS": n_properties, "NSVARS": n_state, "MCRD": 2, "LFLAGS": self.flags, "NJPROP": 4}
        return sizes | dict.fromkeys(ones, 1) | others

    def fill(self, elements: Elements, reference: FloatArray, u: FloatArray, properties: FloatArray) -> dict[str, Any]:
        n_elements = len(elements.nodes)
        moves, numbers = u.reshape(n_elements, -1), np.arange(1, n_elements + 1)[:, None]
        values = {"PROPS": properties, "COORDS": reference.reshape(n_elements, -1), "U": moves, "DU": moves}
        return values | {"JELEM": numbers, "JPROPS": elements.sides}

    def flaw(self, rows: SlotRows) -> tuple[int, str] | None:
        """Return the first element that asks for a shorter increment; there is none to shorten."""
        smaller = np.flatnonzero(rows["PNEWDT"][:, 0] < 1.0)
        if not len(smaller):
            return None
        return int(smaller[0]), f"set PNEWDT to {rows['PNEWDT'][smaller[0], 0]:g}; needed 1, there are no increments"


_UEL = _Uel()


def uel(
    *,
    penalty: float,
    file: str,
    nodes: int | str = 3,
    svars: int = 0,
    props: float | str = "",
    traits: str = "",
    tau: float = 1e-2,
) -> UserElement:
    """Load a user element of Abaqus (UEL) from a shared library.

    Parameters
    ----------
    penalty : float
        The stiffness, in PROPS(1): nodal or distributed, as the trait `penalty` says.
    file : str
        The shared library, absolute or relative to the working folder.
    nodes : int | str
        3: a slave node and its nearest master segment. 4: a slave and a master segment that overlap. "n": a slave and a
        master chain; JPROPS holds the numbers of their nodes, and 1 for each that is closed.
    svars : int
        The number of state variables, zero before each call.
    props : float | str
        The properties from PROPS(3) on, with ":" between them. PROPS(2) is the reference length of the slave part: half
        of the segments at a slave node, the slave segment, or the slave chain.
    traits : str
        A TOML file with the traits. Without it the file counts that lies beside the library, see `traits_beside`.
    tau : float
        The part of a master segment by which a foot may lie past its free end and still count.
    """
    return _load_element(_UEL, "uel", penalty, file, nodes, svars, props, traits, tau)


class _Feap(Convention):
    """Elements of FEAP. `xl` is the reference configuration and `ul(:,:,1)` the displacement from it.

    Forces and matrix are zero before the call. Common blocks are those of the library itself: what `eldata`, `cdata`
    and `eltran` say of an element is set before it is called, and all others are zero.
    """

    name, forces, matrix = "feap", "p", "s"
    order = ("d", "ul", "xl", "ix", "tl", "s", "p", "ndf", "ndm", "nst", "isw")
    integers = ("ix", "ndf", "ndm", "nst", "isw")
    outputs = ("s", "p")
    sets = 6  # Columns of displacements in `ul`: the total, the increment, and velocities and the like, which are zero.

    def shapes(self, n_nodes: int, n_properties: int, n_state: int) -> dict[str, tuple[int, ...]]:
        size = 2 * n_nodes
        nodal = {"ul": (2, n_nodes, self.sets), "xl": (2, n_nodes), "ix": (n_nodes,), "tl": (n_nodes,)}
        return {"d": (n_properties,), **nodal, "s": (size, size), "p": (size,)}

    def constants(self, n_nodes: int, n_properties: int, n_state: int) -> dict[str, Any]:
        return {"ndf": 2, "ndm": 2, "nst": 2 * n_nodes, "isw": 3}  # 3 asks for the tangent and the residual.

    def fill(self, elements: Elements, reference: FloatArray, u: FloatArray, properties: FloatArray) -> dict[str, Any]:
        n_elements, n_nodes = elements.nodes.shape
        moves = np.zeros((n_elements, self.sets, 2 * n_nodes))
        moves[:, :2] = u.reshape(n_elements, 1, -1)  # The total and the increment.
        places = {"ul": moves.reshape(n_elements, -1), "xl": reference.reshape(n_elements, -1)}
        return {"d": properties, **places, "ix": elements.nodes + 1}

    def announce(self, library: ctypes.CDLL, n_nodes: int) -> None:
        """Say that one element of so many nodes is asked, in a static step, to the common blocks that a library has."""
        # Their first variables are the same in FEAP and FEAPpv; `ctan` has the factors of stiffness, damping and mass.
        blocks = {
            "eldata": ("=d5i", 1.0, 1, 1, 0, 0, n_nodes),  # dm, n, ma, mct, iel, nel
            "cdata": ("=6i", n_nodes, 1, 1, n_nodes, 2 * n_nodes, 1),  # numnp, numel, nummat, nen, neq, ipr
            "eltran": ("=6d", 0.0, 0.0, 0.0, 1.0, 0.0, 0.0),  # bpr(3), ctan(3)
        }
        for block, (kinds, *values) in blocks.items():
            for name in shared_library.fortran_names(block):
                if hasattr(library, name):
                    memory = (ctypes.c_char * struct.calcsize(kinds)).in_dll(library, name)
                    struct.pack_into(kinds, memory, 0, *values)


_FEAP, _MOST_ELEMENTS = _Feap(), 99


def feap(
    *,
    penalty: float,
    file: str,
    number: int = 1,
    nodes: int | str = 3,
    props: float | str = "",
    traits: str = "",
    tau: float = 1e-2,
) -> UserElement:
    """Load a user element of FEAP (elmtNN) from a shared library.

    Parameters
    ----------
    penalty : float
        The stiffness, in d(1): nodal or distributed, as the trait `penalty` says.
    file : str
        The shared library, as for `uel`.
    number : int
        The number NN of the subroutine `elmtNN`.
    nodes : int | str
        3, 4 or "n", as for `uel`.
    props : float | str
        The properties from d(3) on, with ":" between them. d(2) is the reference length, as for `uel`.
    traits, tau : str | float
        As for `uel`.
    """
    if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= _MOST_ELEMENTS:
        raise MisuseError("option number", repr(number), f"a whole number from 1 to {_MOST_ELEMENTS}")
    return _load_element(_FEAP, f"elmt{number:02d}", penalty, file, nodes, 0, props, traits, tau)
