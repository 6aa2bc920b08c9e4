"""The barriers of the library ipctk (Li et al., "Incremental Potential Contact", 2020) as formulations.

The library finds its collisions at each state, so a pairing is a `Handle`. Its activation distance d̂ is a share of the
shortest segment in the reference configuration.
"""

from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.formulation import Handle, Pairing, choose
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Promises, Rules, Traits

_SETS = {"ipc": "IPC", "improved": "IMPROVED_MAX_APPROX", "ogc": "OGC"}


class IpcBarrier:
    """A barrier of ipctk between the nodes of one surface and the segments of the other, both ways."""

    def __init__(self, penalty: float, activation: float, kind: str, areas: bool) -> None:
        import ipctk  # An optional dependency.

        self.penalty, self.activation, self.areas = penalty, activation, areas
        ipctk.set_num_threads(1)  # Sums whose order depends on threads would differ in their last bits.
        self._ipctk = ipctk
        self._kind = getattr(ipctk.NormalCollisions, kind)
        # The potential is κ w d̂ times a number. A weight w is a length where nodes have areas, and 1 elsewhere.
        traits = Traits(
            Promises(tangent="exact", symmetric=True, conserves_force=True, conserves_moment=True, unbiased=True),
            Rules(enforcement="barrier", activation=activation, penalty_power=0.0 if areas else 1.0),
        )
        # In the plane, ogc loses forces where a node passes from a segment to its end.
        self.traits = traits if kind == "OGC" else traits.revise(never_intersects=True)

    def pair(self, interface: Interface, z: FloatArray) -> dict[str, Handle]:
        """Return the collisions at a state."""
        mesh = self._ipctk.CollisionMesh(
            np.asfortranarray(interface.nodes),
            np.asfortranarray(np.vstack([interface.slave.segments, interface.master.segments]), dtype=np.int32),
        )
        n_slave = interface.n_slave_nodes
        mesh.can_collide = self._ipctk.CollisionFilter(lambda first, second: (first < n_slave) != (second < n_slave))
        collisions = self._ipctk.NormalCollisions()
        collisions.use_area_weighting = self.areas  # First, since one of the sets warns where there are no areas.
        collisions.collision_set_type = self._kind
        collisions.build(mesh, _vertices(z), self._range(interface))
        return {"collisions": Handle((mesh, collisions))}

    def residual(self, interface: Interface, pairing: Pairing, z: FloatArray) -> Array:
        """Return the gradient of the potential."""
        mesh, collisions = pairing.handle
        gradient: Array = self._potential(interface).gradient(collisions, mesh, _vertices(z))
        return gradient

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray) -> sparse.csc_array:
        """Return the Hessian of the potential."""
        mesh, collisions = pairing.handle
        return sparse.csc_array(self._potential(interface).hessian(collisions, mesh, _vertices(z)))

    def _potential(self, interface: Interface) -> Any:
        return self._ipctk.BarrierPotential(self._range(interface), self.penalty, True)

    def _range(self, interface: Interface) -> float:
        sides = interface.slave, interface.master
        return self.activation * min(float(side.lengths(interface.nodes).min()) for side in sides)


def ipctk(*, penalty: float, kind: str, activation: float = 0.5, areas: bool = True) -> IpcBarrier:
    """Return a barrier of the library ipctk.

    Parameters
    ----------
    penalty : float
        The stiffness κ of the barrier, which the library makes physical by d̂.
    kind : str
        The collision set: "ipc" (Li et al. 2020), "improved" (Li et al. 2023) or "ogc" (Chen et al. 2025).
    activation : float
        The activation distance d̂ over the shortest segment in the reference configuration.
    areas : bool
        Weight nodes by half of their segments, as Li et al. (2023) do.

    Raises
    ------
    MisuseError
        If there is no such collision set, or ipctk is not installed.
    """
    collision_set = choose("kind", kind, _SETS)
    if find_spec("ipctk") is None:
        raise MisuseError("ipctk", "no such package", "pip install 'contactverif[ipctk]'")
    return IpcBarrier(penalty, activation, collision_set, areas)


def _vertices(z: FloatArray) -> Any:
    return np.asfortranarray(z.reshape(-1, 2))
