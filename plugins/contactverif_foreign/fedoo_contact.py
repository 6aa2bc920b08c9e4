"""The node-to-surface contact of the library fedoo as formulations, one for each of its searches.

The search gives a list of pairs of a slave node and a master element, which fedoo keeps during the iterations of an
increment. This list is the pairing. Forces and stiffness are then those of the class `Contact`.
"""

import warnings
from importlib.util import find_spec
from math import inf
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.formulation import Pairing, choose
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Evidence, Rules, Traits
from contactverif.geometry.block_rows import TangentOfBoth

# {word of the option `kind`: the packages that the search needs}
_SEARCHES = {"bucket": ("fedoo",), "search_nearest": ("fedoo",), "ipctk": ("fedoo", "ipctk")}


class FedooContact(TangentOfBoth):
    """Springs at the slave nodes, each on the master element that a search of fedoo chooses.

    fedoo numbers all x before all y. Its normals are on the left of an element, so that master segments are turned
    around. Its vector holds the forces on nodes, which are minus the residual.
    """

    traits = Traits(rules=Rules(penalty="nodal"), evidence=Evidence(source="fedoo, class Contact"))

    def __init__(self, penalty: float, kind: str, reach: float, tol: float) -> None:
        with warnings.catch_warnings():  # It warns that its own solver of linear systems is slow.
            warnings.simplefilter("ignore")
            import fedoo  # An optional dependency.

        self.penalty, self.kind, self.reach, self.tol = penalty, kind, reach, tol
        self._fedoo = fedoo
        self._space = fedoo.ModelingSpace("2D")
        for axis in ("DispX", "DispY"):
            self._space.new_variable(axis)
        self._space.new_vector("Disp", ("DispX", "DispY"))

    def pair(self, interface: Interface, z: FloatArray) -> dict[str, IntArray]:
        """Return the master segment of each slave node; −1 without contact."""
        pairs = self._contact(interface, z).contact_search({}, True)
        segments = np.full(interface.n_slave_nodes, -1)
        for node, segment in pairs.items():
            segments[node] = segment
        return {"master_segment": segments}

    def residual(self, interface: Interface, pairing: Pairing, z: FloatArray) -> FloatArray:
        """Return minus the forces on the nodes."""
        return self.residual_and_tangent(interface, pairing, z)[0]

    def residual_and_tangent(
        self, interface: Interface, pairing: Pairing, z: FloatArray
    ) -> tuple[FloatArray, sparse.csr_array]:
        """Return both, which fedoo makes together."""
        contact = self._contact(interface, z)
        segments = pairing["master_segment"]
        contact.contact_search({node: int(segments[node]) for node in np.flatnonzero(segments >= 0)}, False)
        order = np.arange(interface.n_unknowns).reshape(2, -1).T.ravel()
        forces = np.zeros(interface.n_unknowns) + contact.global_vector  # The vector is the number 0 without contact.
        return -forces[order], sparse.csr_array(contact.global_matrix)[order][:, order]

    def _contact(self, interface: Interface, z: FloatArray) -> Any:
        """Return the contact of fedoo at a state; sizes of its search are those of the reference configuration."""
        segments = interface.master.segments[:, ::-1]
        mesh = self._fedoo.Mesh(np.array(interface.nodes), np.array(segments), "lin2", name="")
        slave = np.arange(interface.n_slave_nodes)
        contact = self._fedoo.constraint.Contact(slave, mesh, search_algorithm=self.kind, name="", space=self._space)
        contact.eps_n, contact.tol = self.penalty, self.tol
        contact.max_dist = self.reach * float(interface.master.lengths(interface.nodes).max())
        contact.set_disp(np.zeros_like(interface.nodes).T)
        contact.current.mesh.nodes = z.reshape(-1, 2).copy()  # Displacements would round the positions.
        return contact.current


def fedoo(*, penalty: float, kind: str, reach: float = inf, tol: float = 0.1) -> FedooContact:
    """Return the node-to-surface contact of the library fedoo with its linear law.

    Parameters
    ----------
    penalty : float
        The stiffness eps_n at a slave node, a force per length.
    kind : str
        The search: "bucket", which is the default of fedoo, "search_nearest", or "ipctk", which needs that library.
    reach : float
        The distance max_dist over the longest master segment in the reference configuration. A slave node that is
        farther from all master nodes is not in contact. The default of fedoo is 0.5 in the unit of the mesh, which is
        no choice for meshes of all sizes.
    tol : float
        The part of an element by which a foot may lie past its end; the default is that of fedoo.

    Raises
    ------
    MisuseError
        If there is no such search, or a library is not installed.
    """
    for package in choose("kind", kind, _SEARCHES):
        if find_spec(package) is None:
            raise MisuseError(package, "no such package", "pip install 'contactverif[fedoo]'")
    return FedooContact(penalty, kind, reach, tol)
