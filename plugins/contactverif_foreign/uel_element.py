"""User elements of Abaqus (UEL) as formulations: the 36 arguments of the subroutine, for one static increment.

`COORDS` is the reference configuration and `U` the displacement from it; `RHS` is minus the residual and `AMATRX` its
derivative, column by column. Forces and matrix are zero before the call. The state variables `SVARS` are zero, too: a
formulation has no history.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif_foreign.element_pairs import Elements
from contactverif_foreign.guarded_slot import Argument, SlotRows
from contactverif_foreign.shared_library import fortran_names
from contactverif_foreign.user_element import Convention, UserElement, load_element

_ORDER = (
    *("RHS", "AMATRX", "SVARS", "ENERGY", "NDOFEL", "NRHS", "NSVARS", "PROPS", "NPROPS", "COORDS", "MCRD", "NNODE"),
    *("U", "DU", "V", "A", "JTYPE", "TIME", "DTIME", "KSTEP", "KINC", "JELEM", "PARAMS", "NDLOAD", "JDLTYP", "ADLMAG"),
    *("PREDEF", "NPREDF", "LFLAGS", "MLVARX", "DDLMAG", "MDLOAD", "PNEWDT", "JPROPS", "NJPROP", "PERIOD"),
)
_INTEGERS = (
    *("NDOFEL", "NRHS", "NSVARS", "NPROPS", "MCRD", "NNODE", "JTYPE", "KSTEP", "KINC", "JELEM", "NDLOAD", "NPREDF"),
    *("MLVARX", "MDLOAD", "NJPROP"),
)
_OUTPUTS = {"RHS", "AMATRX", "SVARS", "ENERGY", "PNEWDT"}
# Static analysis, large displacements, forces and matrix, a general step.
_FLAGS = (1, 1, 1, 0, 0)


def _arguments(n_nodes: int, n_properties: int, n_state: int) -> list[Argument]:
    """Return the arguments of a UEL with so many nodes, properties and state variables."""
    size = 2 * n_nodes
    shapes: dict[str, tuple[int, ...]] = {
        "RHS": (size, 1),
        "AMATRX": (size, size),
        "SVARS": (n_state,),
        "ENERGY": (8,),
        "PROPS": (n_properties,),
        "COORDS": (2, n_nodes),
        **dict.fromkeys(("U", "V", "A"), (size,)),
        "DU": (size, 1),
        "TIME": (2,),
        "PARAMS": (3,),
        "JDLTYP": (1, 1),
        "ADLMAG": (1, 1),
        "DDLMAG": (1, 1),
        "PREDEF": (2, 1, n_nodes),
        "LFLAGS": (len(_FLAGS),),
        "JPROPS": (4,),
    }
    integers = {*_INTEGERS, "JDLTYP", "LFLAGS", "JPROPS"}
    return [
        Argument(name, shapes.get(name, ()), "integer" if name in integers else "real", name not in _OUTPUTS)
        for name in _ORDER
    ]


def _constants(n_nodes: int, n_properties: int, n_state: int) -> dict[str, Any]:
    """Return the arguments that are the same for all elements; what is not there is zero."""
    sizes = {"NDOFEL": 2 * n_nodes, "NNODE": n_nodes, "MLVARX": 2 * n_nodes, "NPROPS": n_properties, "NSVARS": n_state}
    ones = ("NRHS", "JTYPE", "TIME", "DTIME", "KSTEP", "KINC", "NPREDF", "MDLOAD", "PNEWDT", "PERIOD")
    return sizes | dict.fromkeys(ones, 1) | {"MCRD": 2, "LFLAGS": _FLAGS, "NJPROP": 4}


def _fill(elements: Elements, reference: FloatArray, u: FloatArray, properties: FloatArray) -> dict[str, Any]:
    """Return the other arguments, for elements at reference positions and displacements (n, n_nodes, 2)."""
    n_elements = len(elements.nodes)
    displacements = u.reshape(n_elements, -1)
    return {
        "PROPS": properties,
        "COORDS": reference.reshape(n_elements, -1),
        "U": displacements,
        "DU": displacements,
        "JELEM": np.arange(1, n_elements + 1)[:, None],
        "JPROPS": elements.sides,
    }


def _flaw(rows: SlotRows) -> tuple[int, str] | None:
    """Return the first element that asks for a shorter increment; there is none to shorten."""
    smaller = np.flatnonzero(rows["PNEWDT"][:, 0] < 1.0)
    if not len(smaller):
        return None
    return int(smaller[0]), f"set PNEWDT to {rows['PNEWDT'][smaller[0], 0]:g}; needed 1, there are no increments"


_UEL = Convention("uel", _arguments, _constants, _ORDER, _fill, "RHS", "AMATRX", _flaw)


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
    return load_element(
        _UEL,
        fortran_names("uel"),
        penalty=penalty,
        file=file,
        nodes=nodes,
        svars=svars,
        props=props,
        traits=traits,
        tau=tau,
    )
