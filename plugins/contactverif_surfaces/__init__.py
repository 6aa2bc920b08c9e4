"""Contact of surfaces in three dimensions, with exact tangents: nodes, quarters, cells and mortar. Frictionless.

`face_search` decides which pairs of faces make a cell and what its corners are, as integers. `cell_points` computes
every real number of a cell from the positions of its nodes. A method is a rule for the pressures: at points of cells,
at slave nodes from weighted gaps, or at slave nodes themselves (`face_methods`). VTS-PPT has a search of its own
(`face_ppt_search`), and presses on all master faces under a part of a slave face (`face_ppt`).

Of all factories `penalty` is the stiffness ε̂ > 0, force per area per length of penetration; of `nts_3d` it is ε > 0,
force per length.

These files are written to be read. All numbers are computed on arrays of real or complex positions, so a tangent is the
derivative of the same lines, by a complex step in the nodes of one cell. Compiled are one point a cell
(`centre_springs`) and VTS-PPT.
"""

from contactverif_surfaces.centre_springs import vts_cell_3d
from contactverif_surfaces.face_methods import mortar_3d, nts_3d, nts_ar_3d, sts_3d
from contactverif_surfaces.face_ppt import vts_ppt_3d, vts_ppt_balanced_3d

__all__ = ["mortar_3d", "nts_3d", "nts_ar_3d", "sts_3d", "vts_cell_3d", "vts_ppt_3d", "vts_ppt_balanced_3d"]
