"""The contact elements of OpenSees that pair nodes with segments by themselves, as formulations (package OpenSeesPy).

Such an element has the nodes of a slave and of a master chain. It puts a spring of the stiffness Kn at each slave node
against the master segments, and one at each master node against the slave segments. Without tangential stiffness and
friction it has no history.
"""

from importlib.util import find_spec
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.formulation import Pairing, choose
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.traits import Abilities, Evidence, Promises, Rules, Traits
from contactverif_foreign.element_pairs import walk_chains

_ELEMENTS = {"nts": "zeroLengthContactNTS2D", "interface": "zeroLengthInterface2D"}
_NO_FRICTION = (0.0, 0.0)  # Tangential stiffness, and angle of friction.


class OpenSeesContact:
    """Elements of one kind, one for each slave and master chain.

    OpenSees has one model in a process. It is built anew at each call, with its nodes at the current positions and
    without displacements, since springs without friction do not ask where a node was.
    """

    traits = Traits(
        Promises(unbiased=True),
        Rules(penalty="nodal"),
        abilities=Abilities(chains="open"),
        evidence=Evidence(source="Geraili Mikola and Sitar, elements of OpenSees, 2009 and 2010"),
    )

    def __init__(self, penalty: float, element: str) -> None:
        import openseespy.opensees as ops  # An optional dependency.

        self.penalty, self.element = penalty, element
        self._ops = ops

    def residual(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> FloatArray:
        """Return the forces of all elements; those of OpenSees are internal ones, too."""
        residual = np.zeros(interface.n_unknowns)
        for tag, unknowns in self._build(interface, z):
            residual[unknowns] += self._ops.eleResponse(tag, "force")
        return residual

    def tangent(self, interface: Interface, pairing: Pairing | None, z: FloatArray) -> FloatArray:
        """Return the stiffness of all elements."""
        tangent = np.zeros((interface.n_unknowns,) * 2)
        for tag, unknowns in self._build(interface, z):
            stiffness = np.reshape(self._ops.eleResponse(tag, "stiff"), (len(unknowns),) * 2)
            tangent[np.ix_(unknowns, unknowns)] += stiffness
        return tangent

    def _build(self, interface: Interface, z: FloatArray) -> list[tuple[int, IntArray]]:
        self._ops.wipe()
        self._ops.model("basic", "-ndm", 2, "-ndf", 2)
        for number, place in enumerate(z.reshape(-1, 2).tolist()):
            self._ops.node(number, *place)
        elements: list[tuple[int, IntArray]] = []
        masters = _open_chains(interface.master)
        for slave in _open_chains(interface.slave):
            for master in masters:
                nodes = np.concatenate([slave, master])
                tag = len(elements) + 1
                self._ops.element(self.element, tag, *self._arguments(len(slave), nodes.tolist()))
                elements.append((tag, (2 * nodes[:, None] + [0, 1]).ravel()))
        return elements

    def _arguments(self, n_slave: int, nodes: list[int]) -> list[Any]:
        counts = ["-sNdNum", n_slave, "-mNdNum", len(nodes) - n_slave]
        unknowns_of_a_node = ["-dof", 2, 2] if self.element == _ELEMENTS["interface"] else []
        return [*counts, *unknowns_of_a_node, "-Nodes", *nodes, self.penalty, *_NO_FRICTION]


def opensees(*, penalty: float, kind: str) -> OpenSeesContact:
    """Return a contact element of OpenSees, without friction.

    Parameters
    ----------
    penalty : float
        The normal stiffness Kn of a spring, a force per length.
    kind : str
        The element: "nts" (zeroLengthContactNTS2D) or "interface" (zeroLengthInterface2D).

    Raises
    ------
    MisuseError
        If there is no such element, or OpenSeesPy is not installed.
    """
    element = choose("kind", kind, _ELEMENTS)
    if find_spec("openseespy") is None:
        raise MisuseError("openseespy", "no such package", "pip install 'contactverif[opensees]'")
    return OpenSeesContact(penalty, element)


def _open_chains(surface: Surface) -> list[IntArray]:
    """Return the nodes of each chain in the order of a walk with the body on the left, which is counterclockwise."""
    chains = walk_chains(surface)
    if any(is_closed for _, _, is_closed in chains):
        raise MisuseError("chains", "a closed chain", "open chains: an element of OpenSees has a first and a last node")
    return [nodes for _, nodes, _ in chains]
