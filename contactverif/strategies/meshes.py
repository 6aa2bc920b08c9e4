"""Interfaces and states for an author's own tests: the meshes on which the properties judge formulations."""

from collections.abc import Collection

from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE, QUADRILATERAL, SPACE, TRIANGLE, Interface
from contactverif.strategies.general import closed_cases, general_cases, smooth_cases
from contactverif.strategies.surfaces import smooth_surface_cases, surface_cases


def interfaces(*, closed: bool = False) -> SearchStrategy[Interface]:
    """Return 2-D interfaces: non-matching chains that are flat, tilted, bent, circular or overhanging.

    They shrink to one unit segment a side.

    Parameters
    ----------
    closed : bool
        True for closed rings alone.

    Examples
    --------
    >>> from hypothesis import find
    >>> from contactverif.strategies import interfaces
    >>> simplest = find(interfaces(), lambda interface: True)
    >>> simplest.n_nodes, simplest.dim
    (4, 2)
    """
    _check_flag("closed", closed)
    return (closed_cases() if closed else general_cases()).map(lambda case: case.interface)


def faces(*, corners: Collection[int] = (TRIANGLE,)) -> SearchStrategy[Interface]:
    """Return 3-D interfaces: a grid of faces over another one, larger and turned, or on the same square.

    They shrink to one square on one square, each cut in two.

    Parameters
    ----------
    corners : Collection[int]
        The numbers of corners that the faces of an interface may have: 3, 4 or both. All faces of a surface have as
        many.

    Examples
    --------
    >>> from hypothesis import find
    >>> from contactverif.strategies import faces
    >>> find(faces(corners=[4]), lambda interface: True).slave.faces.shape
    (1, 4)
    """
    return _surface_states(corners, smooth=False).map(lambda case: case.interface)


def states(
    *,
    interface: Interface | None = None,
    dim: int | None = None,
    corners: Collection[int] = (TRIANGLE,),
    smooth: bool = False,
) -> SearchStrategy[Case]:
    """Return states in contact: an interface, current positions, a penalty and a seed.

    Parameters
    ----------
    interface : Interface | None
        The interface that moves; None for a random one.
    dim : int | None
        2 or 3; by default the dimension of the interface, or 2.
    corners : Collection[int]
        The numbers of corners of random faces, as in `faces`.
    smooth : bool
        True for states that are not at a kink, for derivatives. Otherwise some states are.

    Examples
    --------
    >>> from hypothesis import find
    >>> from contactverif.strategies import states
    >>> find(states(dim=3), lambda case: True).positions.shape
    (8, 3)
    """
    _check_flag("smooth", smooth)
    dims = (PLANE, SPACE) if interface is None else (interface.dim,)
    if dim is not None and dim not in dims:
        raise MisuseError("dim", repr(dim), " or ".join(map(str, dims)))
    if (dim or dims[0]) == SPACE:
        return _surface_states(corners, smooth, interface)
    return smooth_cases(interface) if smooth else general_cases(interface)


def _surface_states(corners: Collection[int], smooth: bool, interface: Interface | None = None) -> SearchStrategy[Case]:
    numbers = tuple(sorted(set(corners)))
    if not numbers or not {TRIANGLE, QUADRILATERAL} >= set(numbers):
        raise MisuseError("corners", repr(corners), "3, 4 or both")
    cases = (smooth_surface_cases if smooth else surface_cases)(interface, numbers)
    assert cases is not None
    return cases


def _check_flag(name: str, value: object) -> None:
    if not isinstance(value, bool):
        raise MisuseError(name, repr(value), "True or False")
