"""Write the least that a contact formulation is, and look at its nodal forces.

A formulation is a class that is made with a penalty and has a method `residual`. It gets the current positions of all
nodes, slave nodes first, and returns the nodal forces, internal minus external.
"""

import numpy as np

from contactverif import Interface, Subject, verify


class NodeToSegment:
    def __init__(self, *, penalty):
        self.penalty = penalty

    def residual(self, interface, pairing, z):
        x, forces = z.reshape(-1, 2), np.zeros((z.size // 2, 2))
        first, second = interface.master.segments.T
        along, to_slave = x[second] - x[first], x[: interface.n_slave_nodes, None] - x[first]
        xi = (to_slave * along).sum(-1) / (along**2).sum(-1)  # 0 to 1 on each master segment
        normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
        gap = (to_slave * normal).sum(-1)  # (slave nodes, master segments), negative in penetration
        force = np.where((gap < 0) & (xi >= 0) & (xi <= 1), self.penalty * gap, 0)
        forces[: interface.n_slave_nodes] = force @ normal
        np.add.at(forces, first, -((1 - xi) * force).sum(0)[:, None] * normal)
        np.add.at(forces, second, -(xi * force).sum(0)[:, None] * normal)
        return forces.reshape(z.shape)


# One slave segment of length 1 above one master segment of length 2, pressed 1/4 into it. The body is on the left of
# each chain of nodes, so the two chains run in opposite directions.
interface = Interface.from_chains(slave=[[0.5, -0.25], [1.5, -0.25]], master=[[2, 0], [0, 0]])
formulation = Subject("mine", NodeToSegment).with_penalty(100.0)
forces = -formulation.residual(interface, None, interface.nodes.reshape(-1))
print("forces that push the nodes:")
print(forces.reshape(-1, 2))

# The harness asks all of its properties; here are three of them.
for row in verify(NodeToSegment, ["balance.*", "patch.flat.transmission"], examples=20, seed=1).rows:
    print(f"{row.property_id}: {row.verdict}")
