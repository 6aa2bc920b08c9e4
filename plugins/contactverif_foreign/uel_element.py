"""User elements of Abaqus (UEL) as formulations: the 36 arguments of the subroutine, for one static increment.

`COORDS` is the reference configuration and `U` the displacement from it; `RHS` is minus the residual and `AMATRX` its
derivative, column by column. Forces and matrix are zero before the call. The state variables `SVARS` are zero, too: a
formulation has no history.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif_foreign.element_pairs import Elements
from contactverif_foreign.guarded_slot import Argument, SlotRows
from contactverif_foreign.shared_library import find_file, find_function, fortran_names, load_library, parse_numbers
from contactverif_foreign.traits_file import traits_beside
from contactverif_foreign.user_element import Convention, Routine, UserElement, check_element_options

_ORDER = tuple(
    """RHS AMATRX SVARS ENERGY NDOFEL NRHS NSVARS PROPS NPROPS COORDS MCRD NNODE U DU V A JTYPE TIME DTIME KSTEP KINC
    JELEM PARAMS NDLOAD JDLTYP ADLMAG PREDEF NPREDF LFLAGS MLVARX DDLMAG MDLOAD PNEWDT JPROPS NJPROP PERIOD""".split()
)
_INTEGERS = (
    *("NDOFEL", "NRHS", "NSVARS", "NPROPS", "MCRD", "NNODE", "JTYPE", "KSTEP", "KINC", "JELEM", "NDLOAD", "NPREDF"),
    *("MLVARX", "MDLOAD", "NJPROP"),
)
_SMALL = {"RHS", "AMATRX", "SVARS", "ENERGY", "PNEWDT"}  # What a UEL may write.
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
        **{name: (size,) for name in ("U", "V", "A")},
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
        Argument(name, shapes.get(name, ()), "integer" if name in integers else "real", name not in _SMALL)
        for name in _ORDER
    ]


def _fill(elements: Elements, reference: FloatArray, u: FloatArray, properties: Any) -> dict[str, Any]:
    """Return the values of the arguments, for elements at reference positions and displacements (n, n_nodes, 2)."""
    n_elements, n_nodes = elements.nodes.shape
    displacements = u.reshape(n_elements, -1)
    return {
        "NDOFEL": 2 * n_nodes,
        "NRHS": 1,
        "PROPS": properties,
        "NPROPS": properties.shape[1],
        "COORDS": reference.reshape(n_elements, -1),
        "MCRD": 2,
        "NNODE": n_nodes,
        "U": displacements,
        "DU": displacements,
        "JTYPE": 1,
        "TIME": 1.0,
        "DTIME": 1.0,
        "KSTEP": 1,
        "KINC": 1,
        "JELEM": np.arange(1, n_elements + 1)[:, None],
        "NPREDF": 1,
        "LFLAGS": _FLAGS,
        "MLVARX": 2 * n_nodes,
        "MDLOAD": 1,
        "PNEWDT": 1.0,
        "JPROPS": elements.sides,
        "NJPROP": len(elements.sides),
        "PERIOD": 1.0,
    }


def _flaw(rows: SlotRows) -> tuple[int, str] | None:
    """Return the first element that asks for a shorter increment; there is none to shorten."""
    smaller = np.flatnonzero(rows["PNEWDT"][:, 0] < 1.0)
    if not len(smaller):
        return None
    return int(smaller[0]), f"set PNEWDT to {rows['PNEWDT'][smaller[0], 0]:g}; needed 1, there are no increments"


@lru_cache(maxsize=16)
def _routine(path: Path, n_state: int) -> Routine:
    def fill(elements: Elements, reference: FloatArray, u: FloatArray, properties: Sequence[float]) -> dict[str, Any]:
        return _fill(elements, reference, u, properties) | {"NSVARS": n_state}

    convention = Convention("uel", _arguments, _ORDER, fill, "RHS", "AMATRX", _flaw)
    function = find_function(load_library(path), path, *fortran_names("uel"))
    function.restype = None
    return Routine(convention, function, n_state)


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
    check_element_options(penalty, nodes, svars, tau)
    path = find_file(file)
    routine = _routine(path, svars)
    return UserElement(_traits(path, traits), float(penalty), routine, nodes, parse_numbers("option props", props), tau)


_traits = lru_cache(maxsize=16)(traits_beside)
