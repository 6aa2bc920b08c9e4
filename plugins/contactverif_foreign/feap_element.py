"""User elements of FEAP as formulations: `elmtNN(d, ul, xl, ix, tl, s, p, ndf, ndm, nst, isw)`, called with isw = 3.

`xl` is the reference configuration and `ul(:,:,1)` the displacement from it; `p` is minus the residual and `s` its
derivative, column by column. Both are zero before the call. Common blocks of FEAP are those of the library itself: what
`eldata`, `cdata` and `eltran` say of an element is set before it is called, and all others are zero.
"""

from __future__ import annotations

import ctypes
import struct
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif_foreign.element_pairs import Elements
from contactverif_foreign.guarded_slot import Argument
from contactverif_foreign.shared_library import fortran_names
from contactverif_foreign.user_element import Convention, UserElement, load_element

_ORDER = ("d", "ul", "xl", "ix", "tl", "s", "p", "ndf", "ndm", "nst", "isw")
_TANGENT_AND_RESIDUAL = 3  # The value of isw.
_SETS = 6  # Columns of displacements in `ul`: the total, the increment, and velocities and the like, which are zero.
_MOST_ELEMENTS = 99


def _arguments(n_nodes: int, n_properties: int, n_state: int) -> list[Argument]:
    """Return the arguments of an element with so many nodes and properties."""
    size = 2 * n_nodes
    shapes = {
        "d": (n_properties,),
        "ul": (2, n_nodes, _SETS),
        "xl": (2, n_nodes),
        "ix": (n_nodes,),
        "tl": (n_nodes,),
        "s": (size, size),
        "p": (size,),
    }
    integers = {"ix", "ndf", "ndm", "nst", "isw"}
    return [
        Argument(name, shapes.get(name, ()), "integer" if name in integers else "real", name not in ("s", "p"))
        for name in _ORDER
    ]


def _constants(n_nodes: int, n_properties: int, n_state: int) -> dict[str, Any]:
    """Return the arguments that are the same for all elements; what is not there is zero."""
    return {"ndf": 2, "ndm": 2, "nst": 2 * n_nodes, "isw": _TANGENT_AND_RESIDUAL}


def _fill(elements: Elements, reference: FloatArray, u: FloatArray, properties: FloatArray) -> dict[str, Any]:
    """Return the other arguments, for elements at reference positions and displacements (n, n_nodes, 2)."""
    n_elements, n_nodes = elements.nodes.shape
    displacements = np.zeros((n_elements, _SETS, 2 * n_nodes))
    displacements[:, :2] = u.reshape(n_elements, 1, -1)  # The total and the increment.
    return {
        "d": properties,
        "ul": displacements.reshape(n_elements, -1),
        "xl": reference.reshape(n_elements, -1),
        "ix": elements.nodes + 1,
    }


def _set_common_blocks(library: ctypes.CDLL, n_nodes: int) -> None:
    """Say that one element of so many nodes is asked, in a static step, to the common blocks that a library has."""
    # Their first variables are the same in FEAP and FEAPpv; `ctan` has the factors of stiffness, damping and mass.
    blocks = {
        "eldata": ("=d5i", 1.0, 1, 1, 0, 0, n_nodes),  # dm, n, ma, mct, iel, nel
        "cdata": ("=6i", n_nodes, 1, 1, n_nodes, 2 * n_nodes, 1),  # numnp, numel, nummat, nen, neq, ipr
        "eltran": ("=6d", 0.0, 0.0, 0.0, 1.0, 0.0, 0.0),  # bpr(3), ctan(3)
    }
    for block, (kinds, *values) in blocks.items():
        for name in fortran_names(block):
            if hasattr(library, name):
                memory = (ctypes.c_char * struct.calcsize(kinds)).in_dll(library, name)
                struct.pack_into(kinds, memory, 0, *values)


_FEAP = Convention("feap", _arguments, _constants, _ORDER, _fill, "p", "s", announce=_set_common_blocks)


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
    return load_element(
        _FEAP,
        fortran_names(f"elmt{number:02d}"),
        penalty=penalty,
        file=file,
        nodes=nodes,
        svars=0,
        props=props,
        traits=traits,
        tau=tau,
    )
