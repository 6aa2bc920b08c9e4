"""Two blocks of sfepy that overlap by 0.1, with contact alone."""

from typing import Any

import numpy as np
from sfepy.base.base import output
from sfepy.discrete import Equation, Equations, FieldVariable, Integral, Material, Problem
from sfepy.discrete.fem import FEDomain, Field
from sfepy.mesh.mesh_generators import gen_block_mesh
from sfepy.terms import Term


def make_problem(n_lower: int, n_upper: int) -> Any:
    """Return the problem of blocks with some edges on their surfaces, and springs of a stiffness of 1."""
    output.set_output(quiet=True)
    low = gen_block_mesh((6, 1), (n_lower + 1, 2), (3, -0.5), verbose=False)
    up = gen_block_mesh((6, 1), (n_upper + 1, 2), (3, 0.4), verbose=False)
    domain = FEDomain("blocks", low + up)
    field = Field.from_args("moves", np.float64, "vector", domain.create_region("All", "all"), approx_order=1)
    u, v = FieldVariable("u", "unknown", field), FieldVariable("v", "test", field, primary_var_name="u")
    edges = domain.create_region("Contact", "vertices in (y > -0.45) & (y < 0.4)", "facet")
    springs = Material("springs", values={".stiffness": 1.0})
    term = Term.new("dw_contact(springs.stiffness, v, u)", Integral("i", 2), edges, springs=springs, u=u, v=v)
    problem = Problem("contact", equations=Equations([Equation("balance", term)]))
    problem.time_update()
    problem.set_default_state()
    problem.update_materials()
    return problem
