"""Mutants of the included formulations: one line of a module reads otherwise.

Rule for the next editor: when a kernel changes, every mutant must go on meaning the same error; its name says which.
"""

from zoo.making import SURVIVORS, line

SMALL = "1e-12"  # The relative size of graded mistakes.
_FORCE = "f_v = pressure * l_ab * (v.c_p - v.c_q) / 2"
_PUSH = "push(r, node_a, (1 - v.c) / 2 * f_v, v.normal)"
_POINT = "v = virtual_slave_node(x_a, x_b, x_1, x_2, c_p, c_q)"
# The nearest of the segments that end at the nearest node.
_BY_NEAREST_NODE = (
    "from contactverif.geometry.projection import distance_to_segment; "
    "nearest_node = min(master.ravel().tolist(), key=lambda k: dot(arm(node(x, k), v), arm(node(x, k), v))); "
    "m = min(np.flatnonzero((master == nearest_node).any(axis=1)), key=lambda k: "
    "distance_to_segment(v.a, arm(v.a, v), node(x, master[k, 0]), node(x, master[k, 1])))"
)
# Node-to-segment and VTS formulations, which state that they fail the patch test: mistakes hid behind that statement.
_PLACES = "c = -1 + (2 * np.arange(n) + 1) / n"
_AREA = "area = weight * area_length(now, slave, s, other[i])"
_SPRING = "f = penalty * v.g * area"
_SHALLOW = "-v.g.real < 1e-4 * v.l_12.real"


def _contact_at(place: str) -> str:
    return f"v = contact_at(now, slave[s, 0], slave[s, 1], master[partner[i], 0], master[partner[i], 1], {place})"


_AT_PLACE = _contact_at("places[slot[i]]")
# Where a master node lies between the two points of a segment, and not in the middle of it, they move apart.
_MOVED = f"""{_contact_at("0.0")}
            in_middle = min(abs(v.xi), abs(1 - v.xi)) < 1e-6
            apart = 1.1 if partner[i] != partner[i ^ 1] and not in_middle else 1.0
            {_contact_at("apart * places[slot[i]]")}"""

# (name, caught by, module, old line, new line, factory if it is not that of the balanced VTS-PPT)
for _row in (
    ("pulls where the gap is open", "unilateral", "nts_force", "is_pressed(g, multipliers, i, penalty) and on_surface",
     "on_surface", "vts_me"),
    ("multiplier that pulls stays active", "complementarity", "nts_force", "multipliers[i] - penalty * g >= 0",
     "multipliers[i] - penalty * g >= 0 or multipliers[i] < 0", "nts_lm"),
    ("closed gap without a multiplier stays inactive", "unilateral", "nts_force", "multipliers[i] - penalty * g >= 0",
     "multipliers[i] > 0", "nts_lm"),
    # Force and moment still balance, and nothing changes where nothing overhangs.
    ("last master segment continued past its free end", "patch.dead-zone", "patch_test_passing",
     "search = self.n, self.free_end,", "search = self.n, vts_ppt_force.EXTEND,"),
    ("first multiplier counted twice", "multipliers.rank", "point_contact", "return segment, other, slot",
     "return tuple(np.append(array, array[0]) for array in (segment, other, slot))", "nts_lm"),
    # The next two are wrong in shallow contact only, as high penalties make it. Few drawn states are like that.
    ("spring softened in shallow contact", "patch.flat.solve", "vts_ppt_force", _FORCE,
     f"{_FORCE} * (1.0 if -v.g.real > 1e-4 * v.l_12.real else 0.9)"),
    ("shares of the slave nodes equal in shallow contact", "patch.flat.solve", "vts_ppt_force", _PUSH,
     f"v = v if -v.g.real > 1e-4 * v.l_12.real else v._replace(c=0.0); {_PUSH}"),
    ("stress part of the tangent missing in shallow contact", "newton.order", "vts_ppt_tangent",
     "f_v = stiffness * e * l_ab * share", "f_v = stiffness * e * l_ab * share * (-v.g > 1e-3 * v.l_12)"),
    ("tangent of a softer spring in shallow contact", "newton.history", "vts_ppt_tangent",
     "d_f, by_share = _variation_of_force(d, force),",
     "d_f, by_share = (0.5 if is_slave and -v.g <= 1e-3 * v.l_12 else 1.0) * _variation_of_force(d, force),"),
    ("force on a slave node off by 1e-6", "balance.force", "vts_ppt_force", _PUSH,
     "push(r, node_a, (1 - v.c) / 2 * f_v * (1 + 1e-6), v.normal)"),
    ("slave and master forces of the printed algorithm", "balance.force", "vts_ppt_force",
     "pressure = f_v / sum_of_parts(now, v, area, master)", "pressure = penalty * v.g"),
    ("shares of one segment exchanged", "balance.moment", "vts_ppt_force", "xi = dot(v.d, v.t) / v.l_12",
     "xi = 1 - dot(v.d, v.t) / v.l_12"),
    ("shares of the nodes of a segment exchanged", "balance.moment", "vts_ppt_force",
     "push(r, f, -pressure * w_f, v.normal)", "w_f, w_m = w_m, w_f; push(r, f, -pressure * w_f, v.normal)"),
    ("ξ of the last segment from its other end", "patch.flat.transmission", "vts_ppt_force",
     "b = dot(arm(x_f, v.q), v.t) / length", "b = 1 - dot(arm(x_f, v.q), v.t) / length"),
    ("intermediate segments skipped", "patch.flat.transmission", "vts_ppt_force", "w_m = length * (b * b - a * a) / 2",
     "w_m = length * (b * b - a * a) / 2 * (b - a < 1)"),
    ("ξ set to one half", "balance.moment", "nts_force", "xi = dot(d, t) / l_12", "xi = 0.5 + 0 * g", "vts_me"),
    ("normal of each master segment for its share", "balance.force", "vts_ppt_force",
     "push(r, f, -pressure * w_f, v.normal)",
     "v = v._replace(normal=frame(node(now, f), node(now, m))[2]); push(r, f, -pressure * w_f, v.normal)"),
    ("area of competence cut at the wrong node", "patch.flat.transmission", "vts_ppt_force", "cut_q = master[last, 1]",
     "cut_q = master[last, 0]"),
    ("penalty squared", "patch.flat.transmission", "vts_ppt_force", _FORCE,
     "f_v = penalty * pressure * l_ab * (v.c_p - v.c_q) / 2"),
    ("pushes where the gap is open", "patch.flat.transmission", "vts_ppt_force", "is_pressed(g,", "is_pressed(-g,"),
    ("virtual slave nodes at Gauss points", "patch.flat.transmission", "vts_ppt_force",
     "c = middle_of_part(i, n, unity)", "c = middle_of_part(i, n, unity) * 2 / 3**0.5"),
    ("area of competence ends at the virtual slave node", "patch.flat.transmission", "vts_ppt_force",
     "c_p, c_q = c + unity / n, c - unity / n", "c_p, c_q = c + (unity / n if i % n < n - 1 else 0), c - unity / n"),
    ("walk ends one segment early", "patch.flat.transmission", "vts_ppt_force", "        last = following",
     "        last = following; break"),
    ("pushes the wrong way", "patch.flat.transmission", "vts_ppt_force", _FORCE,
     "f_v = -pressure * l_ab * (v.c_p - v.c_q) / 2"),
    ("sign of ω in Eq. 6", "tangent.directional", "nts_force", "omega = times(-1 / v.l_12, v.normal)",
     "omega = times(1 / v.l_12, v.normal)", "vts_me"),
    ("Δn missing", "tangent.directional", "vts_ppt_tangent", "turn_x, turn_y = turn * n_x, turn * n_y",
     "turn_x = turn_y = 0.0"),
    ("Δl_AB missing", "tangent.directional", "vts_ppt_tangent", "if current_area else ZERO", "if False else ZERO"),
    ("ΔS missing", "tangent.directional", "vts_ppt_tangent", "_variation_of_force(d, force) - pressure.size * d_s",
     "_variation_of_force(d, force)"),
    ("Δc of a cut end missing", "tangent.directional", "vts_ppt_tangent", "times(1 / half, t)", "ZERO"),
    ("Δl of the neighbour missing in NTS-AR", "tangent.directional", "nts_force",
     "area = times(1.0 if k == OTHER_B else -1.0, force.t_other)", "pass", "nts_ar"),
    ("one entry of the tangent off by 1e-3", "tangent.directional", "vts_ppt_tangent",
     "_add_block(local, first, column, v, on_1_n,",
     "_add_block(local, first, column, v, (1 + 1e-3 * (k == 0 and is_slave)) * on_1_n,"),
    ("area of competence not shortened at a free end", "tangent.directional", "vts_ppt_force", _FORCE,
     "f_v = pressure * l_ab / n"),
    ("virtual slave node not moved with its cut area", "tangent.directional", "vts_ppt_force", _POINT,
     "c = middle_of_part(i, n, 1.0); v = virtual_slave_node(x_a, x_b, x_1, x_2, c + 1 / n, c - 1 / n); "
     "v = v._replace(c_p=c_p, c_q=c_q, p=v.p._replace(c=c_p), q=v.q._replace(c=c_q))"),
    ("last point missing in the tangent", "tangent.directional", "vts_ppt_tangent",
     "for i in range(first_point[coupling], end_point[coupling]):",
     "for i in range(first_point[coupling], min(end_point[coupling], len(active) - 1)):"),
    ("rotation of the frame that cuts missing", "tangent.directional", "vts_ppt_tangent",
     "lever = dot(arm(node(x, e), PointOnSegment(v.x_a, v.x_b, c)), normal)", "lever = 0.0"),
    ("lever of the ends of an area missing", "tangent.directional", "vts_ppt_tangent",
     "a_lever = dot(fp, v.normal) - a * rise", "a_lever = 0.0"),
    ("rotation of the projected length missing", "tangent.directional", "vts_ppt_tangent",
     "d_length = ends.m - ends.f + part.rise * d.omega", "d_length = ends.m - ends.f"),
    ("g ω missing in Δξ", "tangent.directional", "nts_force", "plus(times(shape, v.t), times(v.g, omega))",
     "times(shape, v.t)", "vts_me"),
    ("rows and columns exchanged", "tangent.directional", "nts_force", "row, column, xx, xy, yx, yy)",
     "row, column, xx, yx, xy, yy)", "nts_ar"),
    ("length without its imaginary part", "tangent.directional", "vts_ppt_force",
     "l_ab, _, _ = frame(x_a, x_b)\n    if", "l_ab = frame(x_a, x_b)[0].real\n    if"),
    ("absolute value of a complex gap", "tangent.directional", "vts_ppt_force", _FORCE,
     "f_v = -penalty * np.abs(v.g) * l_ab * (v.c_p - v.c_q) / 2"),
    ("stale normal", "objectivity", "vts_ppt_force", _POINT,
     f"{_POINT}; l_0, t_0, n_0 = frame(node(reference, node_1), node(reference, node_2)); "
     "v = v._replace(l_12=l_0, t=t_0, normal=n_0, g=dot(v.d, n_0))"),
    ("normal along the axis", "objectivity", "nts_force", "l_12, t, normal = frame(x_1, x_2)",
     "l_12, t, normal = frame(x_1, x_2); normal = (0 * normal[0], 1.0 + 0 * normal[1])", "vts_me"),
    ("absolute tolerance for a gap", "units", "vts_ppt_force", "is_pressed(g,", "is_pressed(g - 1e-9,"),
    ("absolute guard against a division by zero", "units", "vts_ppt_force", "xi = dot(v.d, v.t) / v.l_12",
     "xi = dot(v.d, v.t) / (v.l_12 + 1e-12)"),
    ("shortest length allowed, absolute", "units", "nts_force", "xi = dot(d, t) / l_12",
     "xi = dot(d, t) / max(l_12.real, 1e-9)", "vts_me"),
    ("batch of the first state only", "purity", "vts_ppt_force", "now, r = x[state], forces[state]",
     "now, r = x[0], forces[state]"),
    ("area measured elsewhere than the trait says", "patch.flat.resultant", "patch_test_passing",
     "current_area=current,", "current_area=False,"),
    ("last node of the last chain forgotten", "patch.flat.resultant", "point_contact",
     "segment = np.concatenate([np.arange(len(slave)), last])",
     "last = last[:-1]; segment = np.concatenate([np.arange(len(slave)), last])", "nts_ar"),
    ("neighbour taken by its number", "patch.flat.resultant", "point_contact",
     "other = np.concatenate([slave.neighbours[:, 0], ", "other = np.concatenate([np.arange(len(slave)) - 1, ",
     "nts_ar"),
    ("weights that do not add up to one", "patch.flat.resultant", "point_contact", "np.full(n, 1 / n)",
     "np.full(n, 0.9 / n)", "vts_me"),
    ("search on the reference configuration", "patch.flat.transmission", "patch_test_passing",
     "state = split_state(interface, z)\n        tree", "state = np.array(interface.nodes), np.zeros(0)\n        tree"),
    ("next master segment taken by its number", "patch.flat.transmission", "vts_ppt_force",
     "                j = neighbours[j, 1]", "                j = (j + 1) % len(neighbours)"),
    ("penetrations below 1e-9 left open", "projection.activity", "nts_force", "is_pressed(g,", "is_pressed(g + 1e-9,",
     "vts_me"),
    ("gaps below 1e-9 closed", "projection.activity", "nts_force", "is_pressed(g,", "is_pressed(g - 1e-9,", "vts_me"),
    ("segments of the nearest node only", "projection.segment", "nts_force", "m = order[place]",
     _BY_NEAREST_NODE, "vts_me"),
    # At a vertex of a flat master both segments meet the foot at their ends, and neither counts it as its own.
    ("force dropped where a slave node stands over a master node", "patch.flat.resultant", "nts_force",
     "on_surface = foot_on_surface(", "on_surface = 0 < dot(d, t) < l_12 and foot_on_surface(", "nts_ar"),
    ("mean area of competence at every slave node", "patch.flat.normal", "nts_force", _AREA,
     "area = sum([area_length(now, slave, k, -1) for k in range(len(slave))]) / len(active)", "nts_ar"),
    (f"area of competence at a free end off by {SMALL}", "patch.flat.normal", "nts_force", _AREA,
     f"{_AREA} * (1 + {SMALL} * (other[i] < 0))", "nts_ar"),
    ("NTS-AR softened in shallow contact", "patch.flat.normal.solve", "nts_force", _SPRING,
     f"{_SPRING} * (0.9 if {_SHALLOW} else 1.0)", "nts_ar"),
    ("points of VTS-ME at Gauss points", "patch.flat.single", "point_contact", _PLACES,
     "c = np.polynomial.legendre.leggauss(n)[0]", "vts_me"),
    (f"points of VTS-ME moved by {SMALL}", "patch.flat.single", "point_contact", _PLACES, f"{_PLACES} + {SMALL}",
     "vts_me"),
    ("points of VTS-ME at Gauss points in shallow contact", "patch.flat.single.solve", "nts_force", _AT_PLACE,
     f"{_AT_PLACE}\n            if {_SHALLOW}: {_contact_at('places[slot[i]] * 2 / 3**0.5')}", "vts_me"),
    ("half a spring at a free end of NTS", "patch.flat.nodal", "nts_force", "area = 1 + 0 * v.g",
     "area = (1 + (other[i] >= 0)) / 2 + 0 * v.g", "nts"),
    (f"spring of NTS off by {SMALL}", "patch.flat.nodal", "nts_force", "area = 1 + 0 * v.g",
     f"area = 1 + {SMALL} + 0 * v.g", "nts"),
    ("points of VTS-ME moved apart over a master node", "patch.flat.published", "nts_force", _AT_PLACE, _MOVED,
     "vts_me"),
):  # fmt: skip
    line(*_row[:5], factory=_row[5] if len(_row) > 5 else "vts_ppt_balanced")
line("NaN on a segment seen edge-on", "purity", "vts_ppt_force", "_projected_length(x, master, following, t) <= 0",
     "_projected_length(x, master, following, t) < 0", factory="vts_ppt", free_end="extend")  # fmt: skip
line("residual in one call off by 1e-6", "purity", "vts_ppt_tangent", "_add_force(push, first, f_1, v)",
     "_add_force(push, first, f_1 * (1 + 1e-6 * is_slave), v)", in_one_call=True)  # fmt: skip
# The printed VTS-PPT promises no balance on bent surfaces, and on flat ones no foot lies past an interior segment.
# `tests/plugins/test_free_ends.py` catches it.
line(
    "share of an interior segment cut where the foot lies past its end",
    "free_end.interior",
    "vts_ppt_force",
    "                clip_q[i] = 1\n",
    "                clip_q[i] = 1\n"
    "            if dot(arm(node(x, master[last[i], 0]), q), t) < 0:\n                clip_q[i] = 0\n"
    "            if dot(arm(node(x, master[first[i], 1]), p), t) > 0:\n                clip_p[i] = 1\n",
    factory="vts_ppt",
    into=SURVIVORS,
)
