"""See that a tangent is the exact derivative of a residual.

A complex step gives a derivative without truncation error: the imaginary part of R(z + ih d), divided by h. It needs a
residual that takes complex positions, and a pairing that is frozen: who touches whom must not change on the way.
"""

import numpy as np

from contactverif import Interface, load_formulation

# Two bent surfaces that do not match, pressed into each other.
x = np.linspace(0, 3, 7)
slave = np.column_stack([x, -0.02 - 0.03 * x * (3 - x)])
master = np.column_stack([np.linspace(3.2, -0.3, 6), [0, -0.03, -0.08, -0.07, -0.03, 0]])
interface = Interface.from_chains(slave, master)
z = interface.nodes.reshape(-1)

for name in ("vts-ppt", "vts-ppt-basic", "mortar"):
    formulation = load_formulation(name).with_penalty(1e3)
    pairing = formulation.pair(interface, z)
    tangent = formulation.tangent(interface, pairing, z)
    matrix = tangent if isinstance(tangent, np.ndarray) else tangent.toarray()

    h = 2.0**-100
    columns = [formulation.residual(interface, pairing, z + 1j * h * unit).imag / h for unit in np.eye(z.size)]
    error = np.abs(matrix - np.column_stack(columns)).max() / np.abs(matrix).max()
    print(f"{name:14} largest error of the tangent: {error:.0e}")
