"""The mutants: formulations that are wrong in one line, and promise what the right formulation promises.

Each mutant names the property that must catch it. Rule for the next editor: when a kernel changes, every mutant must go
on meaning the same error; its name says which.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import wrong_accuracy
import wrong_bent
import wrong_hard
import wrong_invariants
import wrong_multipliers
import wrong_newton
import wrong_patch_classes
import wrong_pressures
import wrong_projection
import wrong_purity
import wrong_pushes
import wrong_stability
import wrong_states
import wrong_tangent
from mutate import Mutant, changed_line, decides, replaces, reports, wrap

import contactverif_mortar
import contactverif_nts
from contactverif import Pairing
from contactverif_mortar.integration_cells import Quadrature

PATCH, RESULTANT = "patch.flat.transmission", "patch.flat.resultant"
FORCE, MOMENT = "balance.force", "balance.moment"
SOLVE, VARIANTS, DEAD_ZONE = "patch.flat.solve", "patch.variants", "patch.dead-zone"
RANK = "multipliers.rank"
ORDER, HISTORY = "newton.order", "newton.history"
UNILATERAL, COMPLEMENTARITY = "unilateral", "complementarity"
TANGENT, OBJECTIVITY, SCALING, PURITY = "tangent.directional", "objectivity", "units", "purity"
BALANCED, VTS_PPT_BALANCED = "vts_ppt_balanced", contactverif_nts.vts_ppt_balanced


def line(
    name: str, caught_by: str, module: str, old: str, new: str, *, factory: str = BALANCED, nth: int = 0, **options: Any
) -> Mutant:
    return Mutant(name, caught_by, changed_line(module, old, new, factory=factory, nth=nth, **options))


def _keeps_first_pairing(*, penalty: float) -> Any:
    pairings: list[Any] = []

    def pair(right: Any, interface: Any, z: Any) -> Any:
        pairings.append(right(interface, z))
        same_problem = pairings[0]["master"].shape == pairings[-1]["master"].shape
        return pairings[0] if same_problem else pairings[-1]

    return wrap(penalty, pair=pair)


def _changes_pairing(*, penalty: float) -> Any:
    calls: list[int] = []

    def pair(right: Any, interface: Any, z: Any) -> Any:
        calls.append(0)
        return Pairing({**right(interface, z), "call": np.array([len(calls) % 2])})

    return wrap(penalty, pair=pair)


def _all_or_none(pairing: Any, interface: Any) -> Any:
    """Return that all points are active as soon as one is: what is open adheres."""
    return np.full_like(pairing["active"], pairing["active"].any())


def _keeps_between(pairing: Any, interface: Any) -> Any:
    """Return that all nodes between two active ones are active."""
    numbers, active = np.flatnonzero(pairing["active"]), pairing["active"].copy()
    if len(numbers):
        active[numbers[0] : numbers[-1] + 1] = True
    return active


def _soft_multipliers(*, penalty: float) -> Any:
    """Soften the constraint by λ/c, so that the solution depends on the scale of the decision."""

    def with_soft_rows(answer: Any, interface: Any, z: Any, pairing: Any) -> Any:
        n = interface.n_unknowns
        rows = np.where(pairing["active"], z[..., n:] / penalty, 0.0)
        return np.concatenate([answer[..., :n], answer[..., n:] - rows], axis=-1)

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        return with_soft_rows(right(interface, pairing, z), interface, z, pairing)

    def tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        matrix = np.array(right(interface, pairing, z).toarray())
        n = interface.n_unknowns
        matrix[range(n, len(z)), range(n, len(z))] -= np.where(pairing["active"], 1 / penalty, 0.0)
        return matrix

    return wrap(penalty, contactverif_nts.nts_lm, residual=residual, tangent=tangent)


@replaces("residual")
def _moves_mesh(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    interface.nodes.setflags(write=True)
    interface.nodes[0, 0] += 1e-3
    return right(interface, pairing, z)


@replaces("residual")
def _writes_on_input(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    z += 0.0
    return right(interface, pairing, z)


def _encodes_numbers(*, penalty: float) -> Any:
    """Store ξ and the area as bits in the pairing: they are frozen with it, and no difference shows a forgotten Δξ."""
    inner = contactverif_nts.vts_me(penalty=penalty)

    def bits(values: Any) -> Any:
        return np.unpackbits(np.ascontiguousarray(values, float).view(np.uint8)).astype(bool)

    class Encoded:
        traits = inner.traits.revise(takes_complex=False, batched=False)

        def pair(self, interface: Any, z: Any) -> Any:
            pairing = inner.pair(interface, z)
            points = inner.contact_points(interface, pairing, z)
            return {**pairing, "xi": bits(points.xi), "area": bits(points.weight)}

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            x, forces = z.reshape(-1, 2), np.zeros_like(z).reshape(-1, 2)
            xi, area = (np.packbits(pairing[name]).view(float) for name in ("xi", "area"))
            for point in np.flatnonzero(pairing["active"]):
                a, b = interface.slave.segments[pairing["segment"][point]]
                node_1, node_2 = interface.master.segments[pairing["master"][point]]
                c = inner.c[pairing["slot"][point]]
                t = (x[node_2] - x[node_1]) / np.linalg.norm(x[node_2] - x[node_1])
                normal = np.array([t[1], -t[0]])
                v = (1 - c) / 2 * x[a] + (1 + c) / 2 * x[b]
                force = penalty * ((v - x[node_1]) @ normal) * area[point] * normal
                shares = ((a, (1 - c) / 2), (b, (1 + c) / 2), (node_1, xi[point] - 1), (node_2, -xi[point]))
                for node, share in shares:
                    forces[node] += share * force
            return forces.reshape(-1)

        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            columns = [self.residual(interface, pairing, z + 2e-6 * d) for d in np.eye(z.size)]
            others = [self.residual(interface, pairing, z - 2e-6 * d) for d in np.eye(z.size)]
            return (np.column_stack(columns) - np.column_stack(others)) / 4e-6

    return Encoded()


@replaces("residual")
def _single_precision(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    rounded = z.astype(np.complex64 if np.iscomplexobj(z) else np.float32).astype(z.dtype)
    return right(interface, pairing, rounded)


def _changes_state_in_tangent(*, penalty: float) -> Any:
    scale = [1.0]

    def tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        scale[0] = 1 + 2.0**-40
        return right(interface, pairing, z)

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        return right(interface, pairing, z) * scale[0]

    return wrap(penalty, tangent=tangent, residual=residual)


@replaces("residual")
def _drops_small_forces(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    forces = right(interface, pairing, z)
    return np.where(np.abs(forces) < 1e-12, 0, forces)


@replaces("tangent")
def _symmetrises(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    k = right(interface, pairing, z)
    return (k + k.T) / 2


def _keeps_first_tangent(*, penalty: float) -> Any:
    """Use the matrix of the first iterate on a mesh for all others: modified Newton by accident."""
    memory: dict[str, Any] = {}

    def tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        if memory.get("interface") is not interface:
            memory.update(interface=interface, tangent=right(interface, pairing, z))
        return memory["tangent"]

    return wrap(penalty, tangent=tangent)


def _pushes_along_rollers(*, penalty: float) -> Any:
    """Add a couple of forces along the interface at the ends of the slave, which rollers take from the bodies."""

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        forces = np.array(right(interface, pairing, z)).reshape(*z.shape[:-1], -1, 2)
        first, last = interface.slave.segments[0, 0], interface.slave.segments[-1, 1]
        along = (z.reshape(forces.shape)[..., last, :] - z.reshape(forces.shape)[..., first, :]) * penalty * 1e-3
        forces[..., first, :] += along
        forces[..., last, :] -= along
        return forces.reshape(z.shape)

    return wrap(penalty, residual=residual)


MUTANTS = (
    line("pulls where the gap is open", UNILATERAL, "nts_force",
         "is_pressed(g, multipliers, i, penalty) and on_surface", "on_surface",
         factory="vts_me"),
    line("multiplier that pulls stays active", COMPLEMENTARITY, "nts_force",
         "multipliers[i] - penalty * g >= 0", "multipliers[i] - penalty * g >= 0 or multipliers[i] < 0",
         factory="nts_lm"),
    line("closed gap without a multiplier stays inactive", UNILATERAL, "nts_force",
         "multipliers[i] - penalty * g >= 0", "multipliers[i] > 0", factory="nts_lm"),
    # Force and moment still balance, and nothing changes where nothing overhangs.
    line("last master segment continued past its free end", DEAD_ZONE, "patch_test_passing",
         "search = self.n, self.free_end,", "search = self.n, walk.EXTEND,"),
    line("first multiplier counted twice", RANK, "point_contact",
         "return segment, other, slot", "return tuple(np.append(array, array[0]) for array in (segment, other, slot))",
         factory="nts_lm"),
    Mutant("forces that rollers take from the bodies", VARIANTS, _pushes_along_rollers),
    # The next two are wrong in shallow contact only, as high penalties make it. Few drawn states are like that.
    line("spring softened in shallow contact", SOLVE, "vts_ppt_force",
         "f_v = pressure * l_ab * (v.c_p - v.c_q) / 2",
         "f_v = pressure * l_ab * (v.c_p - v.c_q) / 2 * (1.0 if -v.g.real > 1e-4 * v.l_12.real else 0.9)"),
    line("shares of the slave nodes equal in shallow contact", SOLVE, "vts_ppt_force",
         "push(r, node_a, (1 - v.c) / 2 * f_v, v.normal)",
         "v = v if -v.g.real > 1e-4 * v.l_12.real else v._replace(c=0.0); "
         "push(r, node_a, (1 - v.c) / 2 * f_v, v.normal)"),
    Mutant("reported pressure one percent too small", SOLVE,
           reports(VTS_PPT_BALANCED, lambda points, *_: {"pressure": 0.99 * points.pressure})),
    Mutant("reported pressure from the vertical gap", VARIANTS,
           reports(VTS_PPT_BALANCED, lambda points, *_: {"pressure": points.pressure * abs(points.normal[:, 1])})),
    Mutant("tangent kept from the first iterate", ORDER, _keeps_first_tangent),
    line("stress part of the tangent missing in shallow contact", ORDER, "vts_ppt_tangent",
         "f_v = stiffness * e * l_ab * share", "f_v = stiffness * e * l_ab * share * (-v.g > 1e-3 * v.l_12)"),
    line("tangent of a softer spring in shallow contact", HISTORY, "vts_ppt_tangent",
         "d_f, by_share = _variation_of_force(d, force),",
         "d_f, by_share = (0.5 if is_slave and -v.g <= 1e-3 * v.l_12 else 1.0) * _variation_of_force(d, force),"),
    line("force on a slave node off by 1e-6", FORCE, "vts_ppt_force",
         "push(r, node_a, (1 - v.c) / 2 * f_v, v.normal)",
         "push(r, node_a, (1 - v.c) / 2 * f_v * (1 + 1e-6), v.normal)"),
    line("slave and master forces of the printed algorithm", FORCE, "vts_ppt_force",
         "pressure = f_v / sum_of_parts(now, v, area, master)", "pressure = penalty * v.g"),
    line("shares of one segment exchanged", MOMENT, "vts_ppt_force",
         "xi = dot(v.d, v.t) / v.l_12", "xi = 1 - dot(v.d, v.t) / v.l_12"),
    line("shares of the nodes of a segment exchanged", MOMENT, "vts_ppt_force",
         "push(r, f, -pressure * w_f, v.normal)", "w_f, w_m = w_m, w_f; push(r, f, -pressure * w_f, v.normal)"),
    line("ξ of the last segment from its other end", PATCH, "vts_ppt_force",
         "b = dot(arm(x_f, v.q), v.t) / length", "b = 1 - dot(arm(x_f, v.q), v.t) / length"),
    line("intermediate segments skipped", PATCH, "vts_ppt_force",
         "w_m = length * (b * b - a * a) / 2", "w_m = length * (b * b - a * a) / 2 * (b - a < 1)"),
    line("ξ set to one half", MOMENT, "nts_force",
         "xi = dot(d, t) / l_12", "xi = 0.5 + 0 * g", factory="vts_me"),
    line("normal of each master segment for its share", FORCE, "vts_ppt_force",
         "push(r, f, -pressure * w_f, v.normal)",
         "v = v._replace(normal=frame(node(now, f), node(now, m))[2]); push(r, f, -pressure * w_f, v.normal)"),
    line("area of competence cut at the wrong node", PATCH, "walk",
         "cut_q = master[last, 1]", "cut_q = master[last, 0]"),
    line("penalty squared", PATCH, "vts_ppt_force",
         "f_v = pressure * l_ab * (v.c_p - v.c_q) / 2",
         "f_v = penalty * pressure * l_ab * (v.c_p - v.c_q) / 2"),
    line("pushes where the gap is open", PATCH, "walk",
         "is_pressed(g,", "is_pressed(-g,"),
    line("virtual slave nodes at Gauss points", PATCH, "vts_ppt_force",
         "c = middle_of_part(i, n, unity)", "c = middle_of_part(i, n, unity) * 2 / 3**0.5"),
    line("area of competence ends at the virtual slave node", PATCH, "vts_ppt_force",
         "c_p, c_q = c + unity / n, c - unity / n",
         "c_p, c_q = c + (unity / n if i % n < n - 1 else 0), c - unity / n"),
    line("walk ends one segment early", PATCH, "walk",
         "        last = following", "        last = following; break"),
    line("pushes the wrong way", PATCH, "vts_ppt_force",
         "f_v = pressure * l_ab * (v.c_p - v.c_q) / 2", "f_v = -pressure * l_ab * (v.c_p - v.c_q) / 2"),
    Mutant("positions in single precision", PATCH, _single_precision),
    line("sign of ω in Eq. 6", TANGENT, "nts_force",
         "omega = times(-1 / v.l_12, v.normal)", "omega = times(1 / v.l_12, v.normal)", factory="vts_me"),
    line("Δn missing", TANGENT, "vts_ppt_tangent",
         "turn_x, turn_y = turn * n_x, turn * n_y", "turn_x = turn_y = 0.0"),
    line("Δl_AB missing", TANGENT, "vts_ppt_tangent",
         "if current_area else ZERO", "if False else ZERO"),
    line("ΔS missing", TANGENT, "vts_ppt_tangent",
         "_variation_of_force(d, force) - pressure.size * d_s", "_variation_of_force(d, force)"),
    line("Δc of a cut end missing", TANGENT, "vts_ppt_tangent",
         "times(1 / half, t)", "ZERO"),
    line("Δl of the neighbour missing in NTS-AR", TANGENT, "nts_force",
         "area = times(1.0 if k == OTHER_B else -1.0, force.t_other)", "pass", factory="nts_ar"),
    line("one entry of the tangent off by 1e-3", TANGENT, "vts_ppt_tangent",
         "_add_block(local, first, column, v, on_1_n,",
         "_add_block(local, first, column, v, (1 + 1e-3 * (k == 0 and is_slave)) * on_1_n,"),
    line("area of competence not shortened at a free end", TANGENT, "vts_ppt_force",
         "f_v = pressure * l_ab * (v.c_p - v.c_q) / 2", "f_v = pressure * l_ab / n"),
    line("virtual slave node not moved with its cut area", TANGENT, "vts_ppt_force",
         "v = virtual_slave_node(x_a, x_b, x_1, x_2, c_p, c_q)",
         "c = middle_of_part(i, n, 1.0); v = virtual_slave_node(x_a, x_b, x_1, x_2, c + 1 / n, c - 1 / n); "
         "v = v._replace(c_p=c_p, c_q=c_q, p=v.p._replace(c=c_p), q=v.q._replace(c=c_q))"),
    line("last point missing in the tangent", TANGENT, "vts_ppt_tangent",
         "for i in range(first_point[coupling], end_point[coupling]):",
         "for i in range(first_point[coupling], min(end_point[coupling], len(active) - 1)):"),
    line("rotation of the frame that cuts missing", TANGENT, "vts_ppt_tangent",
         "lever = dot(arm(node(x, e), PointOnSegment(v.x_a, v.x_b, c)), normal)", "lever = 0.0"),
    line("lever of the ends of an area missing", TANGENT, "vts_ppt_tangent",
         "a_lever = dot(fp, v.normal) - a * rise", "a_lever = 0.0"),
    line("rotation of the projected length missing", TANGENT, "vts_ppt_tangent",
         "d_length = ends.m - ends.f + part.rise * d.omega", "d_length = ends.m - ends.f"),
    line("g ω missing in Δξ", TANGENT, "nts_force",
         "plus(times(shape, v.t), times(v.g, omega))", "times(shape, v.t)", factory="vts_me"),
    line("rows and columns exchanged", TANGENT, "nts_force",
         "row, column, xx, xy, yx, yy)", "row, column, xx, yx, xy, yy)", factory="nts_ar"),
    Mutant("tangent symmetrised", TANGENT, _symmetrises),
    line("length without its imaginary part", TANGENT, "vts_ppt_force",
         "l_ab, _, _ = frame(x_a, x_b)\n    if", "l_ab = frame(x_a, x_b)[0].real\n    if"),
    line("absolute value of a complex gap", TANGENT, "vts_ppt_force",
         "f_v = pressure * l_ab * (v.c_p - v.c_q) / 2",
         "f_v = -penalty * np.abs(v.g) * l_ab * (v.c_p - v.c_q) / 2"),
    line("stale normal", OBJECTIVITY, "vts_ppt_force",
         "v = virtual_slave_node(x_a, x_b, x_1, x_2, c_p, c_q)",
         "v = virtual_slave_node(x_a, x_b, x_1, x_2, c_p, c_q); "
         "l_0, t_0, n_0 = frame(node(reference, node_1), node(reference, node_2)); "
         "v = v._replace(l_12=l_0, t=t_0, normal=n_0, g=dot(v.d, n_0))"),
    line("normal along the axis", OBJECTIVITY, "nts_force",
         "l_12, t, normal = frame(x_1, x_2)",
         "l_12, t, normal = frame(x_1, x_2); normal = (0 * normal[0], 1.0 + 0 * normal[1])",
         factory="vts_me"),
    line("absolute tolerance for a gap", SCALING, "walk",
         "is_pressed(g,", "is_pressed(g - 1e-9,"),
    line("absolute guard against a division by zero", SCALING, "vts_ppt_force",
         "xi = dot(v.d, v.t) / v.l_12", "xi = dot(v.d, v.t) / (v.l_12 + 1e-12)"),
    line("shortest length allowed, absolute", SCALING, "nts_force",
         "xi = dot(d, t) / l_12", "xi = dot(d, t) / max(l_12.real, 1e-9)",
         factory="vts_me"),
    Mutant("small forces dropped", SCALING, _drops_small_forces),
    line("NaN on a segment seen edge-on", PURITY, "walk",
         "_projected_length(x, master, following, t) <= 0", "_projected_length(x, master, following, t) < 0",
         nth=0, factory="vts_ppt", free_end="extend"),
    line("residual in one call off by 1e-6", PURITY, "vts_ppt_tangent",
         "_add_force(push, first, f_1, v)",
         "_add_force(push, first, f_1 * (1 + 1e-6 * is_slave), v)", in_one_call=True),
    line("batch of the first state only", PURITY, "vts_ppt_force",
         "now, r = x[state], forces[state]", "now, r = x[0], forces[state]"),
    Mutant("open cells adhere", UNILATERAL, decides(contactverif_mortar.sts, _all_or_none)),
    Mutant("open nodes adhere", UNILATERAL, decides(contactverif_mortar.mortar, _all_or_none)),
    Mutant("multipliers of open nodes adhere", COMPLEMENTARITY, decides(contactverif_mortar.mortar_lm, _all_or_none)),
    Mutant("nodes between active ones are not released", COMPLEMENTARITY,
           decides(contactverif_mortar.mortar_lm, _keeps_between)),
    Mutant("constraint softened by its multiplier", COMPLEMENTARITY, _soft_multipliers),
    Mutant("numbers encoded in the pairing", TANGENT, _encodes_numbers),
    Mutant("pairing kept from the first call", PURITY, _keeps_first_pairing),
    Mutant("pairing that changes at every call", PURITY, _changes_pairing),
    Mutant("tangent that leaves a trace", PURITY, _changes_state_in_tangent),
    Mutant("interface modified", PURITY, _moves_mesh),
    Mutant("positions modified", PURITY, _writes_on_input),
    line("area measured elsewhere than the trait says", RESULTANT, "patch_test_passing",
         "current_area=current,", "current_area=False,"),
    line("last node of the last chain forgotten", RESULTANT, "point_contact",
         "segment = np.concatenate([np.arange(len(slave)), last])",
         "last = last[:-1]; segment = np.concatenate([np.arange(len(slave)), last])", factory="nts_ar"),
    line("neighbour taken by its number", RESULTANT, "point_contact",
         "other = np.concatenate([slave.neighbours[:, 0], ", "other = np.concatenate([np.arange(len(slave)) - 1, ",
         factory="nts_ar"),
    line("weights that do not add up to one", RESULTANT, "point_contact", "np.full(n, 1 / n)", "np.full(n, 0.9 / n)",
         factory="vts_me"),
    line("search on the reference configuration", PATCH, "patch_test_passing",
         "state = split_state(interface, z)\n        tree",
         "state = np.array(interface.nodes), np.zeros(0)\n        tree"),
    line("next master segment taken by its number", PATCH, "vts_ppt_force",
         "                j = neighbours[j, 1]", "                j = (j + 1) % len(neighbours)"),
    *wrong_accuracy.MUTANTS,
    *wrong_bent.MUTANTS,
    # It is exact for a uniform gap, and so on flat interfaces; action equals reaction at each point.
    Mutant("one Gauss point a cell", "patch.tilted.nodal",
           lambda *, penalty: replace(contactverif_mortar.sts(penalty=penalty), quadrature=Quadrature.gauss(1, True))),
    *wrong_hard.MUTANTS,
    *wrong_invariants.MUTANTS,
    *wrong_multipliers.MUTANTS,
    *wrong_newton.MUTANTS,
    *wrong_patch_classes.MUTANTS,
    *wrong_pressures.MUTANTS,
    *wrong_projection.MUTANTS,
    *wrong_purity.MUTANTS,
    *wrong_pushes.MUTANTS,
    *wrong_stability.MUTANTS,
    *wrong_states.MUTANTS,
    *wrong_tangent.MUTANTS,
)  # fmt: skip

# The mutants that no property catches yet. Each names the property that is missing.
SURVIVORS = (
    # The printed VTS-PPT promises no balance on bent surfaces, and on flat ones no foot lies past an interior segment.
    # `tests/plugins/test_free_ends.py` catches it.
    line("share of an interior segment cut where the foot lies past its end", "free_end.interior", "walk",
         "    return clip_p, clip_q",
         "    if dot(arm(node(x, master[last, 0]), q), t) < 0:\n        clip_q = 0\n"
         "    if dot(arm(node(x, master[first, 1]), p), t) > 0:\n        clip_p = 1\n"
         "    return clip_p, clip_q", factory="vts_ppt"),
)  # fmt: skip
