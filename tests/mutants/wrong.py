"""The wrong formulations. Each is wrong in one line, and keeps the promises of the right one it was made from."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from mutate import Mutant, Wrapped, changed_line

import contactverif_mortar
import contactverif_nts
from contactverif import Pairing
from contactverif_mortar.cells import Quadrature

PATCH, RESULTANT = "patch.flat.transmission", "patch.flat.resultant"
FORCE, MOMENT = "balance.force", "balance.moment"
SOLVE, VARIANTS, DEAD_ZONE = "patch.flat.solve", "patch.variants", "patch.dead-zone"
RANK = "multipliers.rank"
ORDER, HISTORY = "newton.order", "newton.history"
UNILATERAL, COMPLEMENTARITY = "unilateral", "complementarity"
TANGENT, OBJECTIVITY, SCALING, PURITY = "tangent.directional", "objectivity", "scaling", "purity"
BALANCED = "vts_ppt_balanced"


def line(
    name: str, caught_by: str, module: str, old: str, new: str, *, factory: str = BALANCED, nth: int = 0, **options: Any
) -> Mutant:
    return Mutant(name, caught_by, changed_line(module, old, new, factory=factory, nth=nth, **options))


def _remembers(penalty: float) -> Any:
    seen: list[Any] = []

    def pair(answer: Any, interface: Any, z: Any) -> Any:
        seen.append(answer(interface, z))
        same_problem = seen[0]["master"].shape == seen[-1]["master"].shape
        return seen[0] if same_problem else seen[-1]

    return Wrapped(penalty, pair=pair)


def _restless(penalty: float) -> Any:
    calls: list[int] = []

    def pair(answer: Any, interface: Any, z: Any) -> Any:
        calls.append(0)
        return Pairing({**answer(interface, z), "call": np.array([len(calls) % 2])})

    return Wrapped(penalty, pair=pair)


def _all_or_none(make: Any) -> Any:
    """Where anything touches, all does, and what is open is held: adhesion."""

    def pair(answer: Any, interface: Any, z: Any) -> Any:
        found = answer(interface, z)
        return Pairing({**found, "active": np.full_like(found["active"], found["active"].any())})

    return lambda *, penalty: Wrapped(penalty, make, pair=pair)


def _held_between(make: Any) -> Any:
    """A node is let go only at the end of what touches."""

    def pair(answer: Any, interface: Any, z: Any) -> Any:
        found = answer(interface, z)
        active = np.flatnonzero(found["active"])
        held = found["active"].copy()
        if len(active):
            held[active[0] : active[-1] + 1] = True
        return Pairing({**found, "active": held})

    return lambda *, penalty: Wrapped(penalty, make, pair=pair)


def _soft_multipliers(penalty: float) -> Any:
    """A constraint that gives way by λ/c: the solution depends on the scale of the decision."""

    def with_rows(answer: Any, interface: Any, z: Any, pairing: Any) -> Any:
        n = interface.n_unknowns
        rows = np.where(pairing["active"], z[..., n:] / penalty, 0.0)
        return np.concatenate([answer[..., :n], answer[..., n:] - rows], axis=-1)

    def residual(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        return with_rows(answer(interface, pairing, z), interface, z, pairing)

    def tangent(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        matrix = np.array(answer(interface, pairing, z).toarray())
        n = interface.n_unknowns
        matrix[range(n, len(z)), range(n, len(z))] -= np.where(pairing["active"], 1 / penalty, 0.0)
        return matrix

    return Wrapped(penalty, contactverif_nts.nts_lm, residual=residual, tangent=tangent)


def _moves_the_mesh(penalty: float) -> Any:
    def residual(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        interface.nodes.setflags(write=True)
        interface.nodes[0, 0] += 1e-3
        return answer(interface, pairing, z)

    return Wrapped(penalty, residual=residual)


def _writes_on_its_input(penalty: float) -> Any:
    def residual(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        z += 0.0
        return answer(interface, pairing, z)

    return Wrapped(penalty, residual=residual)


def _numbers_in_the_pairing(penalty: float) -> Any:
    """ξ and the area as bits of a double: frozen with the pairing, so that no difference shows a forgotten Δξ."""
    inner = contactverif_nts.vts_me(penalty=penalty)

    def bits(values: Any) -> Any:
        return np.unpackbits(np.ascontiguousarray(values, float).view(np.uint8)).astype(bool)

    class Encoded:
        traits = replace(inner.traits, takes_complex=False, batched=False)

        def pair(self, interface: Any, z: Any) -> Any:
            pairing = inner.pair(interface, z)
            points = inner.contact_points(interface, pairing, z)
            return {**pairing, "xi": bits(points.xi), "area": bits(points.weight)}

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            x, forces = z.reshape(-1, 2), np.zeros_like(z).reshape(-1, 2)
            xi, area = (np.packbits(pairing[name]).view(float) for name in ("xi", "area"))
            for point in np.flatnonzero(pairing["active"]):
                a, b = interface.slave.segments[pairing["segment"][point]]
                one, two = interface.master.segments[pairing["master"][point]]
                c = inner.c[pairing["slot"][point]]
                t = (x[two] - x[one]) / np.linalg.norm(x[two] - x[one])
                normal = np.array([t[1], -t[0]])
                v = (1 - c) / 2 * x[a] + (1 + c) / 2 * x[b]
                force = penalty * ((v - x[one]) @ normal) * area[point] * normal
                shares = ((a, (1 - c) / 2), (b, (1 + c) / 2), (one, xi[point] - 1), (two, -xi[point]))
                for node, share in shares:
                    forces[node] += share * force
            return forces.reshape(-1)

        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            columns = [self.residual(interface, pairing, z + 2e-6 * d) for d in np.eye(z.size)]
            others = [self.residual(interface, pairing, z - 2e-6 * d) for d in np.eye(z.size)]
            return (np.column_stack(columns) - np.column_stack(others)) / 4e-6

    return Encoded()


def _single_precision(penalty: float) -> Any:
    def residual(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        rounded = z.astype(np.complex64 if np.iscomplexobj(z) else np.float32).astype(z.dtype)
        return answer(interface, pairing, rounded)

    return Wrapped(penalty, residual=residual)


def _tangent_leaves_a_trace(penalty: float) -> Any:
    scale = [1.0]

    def tangent(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        scale[0] = 1 + 2.0**-40
        return answer(interface, pairing, z)

    def residual(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        return answer(interface, pairing, z) * scale[0]

    return Wrapped(penalty, tangent=tangent, residual=residual)


def _drops_small_forces(penalty: float) -> Any:
    def residual(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        forces = answer(interface, pairing, z)
        return np.where(np.abs(forces) < 1e-12, 0, forces)

    return Wrapped(penalty, residual=residual)


def _symmetrises(penalty: float) -> Any:
    def tangent(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        k = answer(interface, pairing, z)
        return (k + k.T) / 2

    return Wrapped(penalty, tangent=tangent)


def _says_of_its_points(penalty: float, pressure: Any) -> Any:
    """Right forces, and another pressure said of the contact points."""

    def contact_points(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        points = answer(interface, pairing, z)
        return replace(points, pressure=pressure(points))

    return Wrapped(penalty, contact_points=contact_points)


def _keeps_its_first_tangent(penalty: float) -> Any:
    """Modified Newton by accident: on one mesh, the matrix of the first iterate serves for all."""
    kept: dict[str, Any] = {}

    def tangent(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        if kept.get("interface") is not interface:
            kept.update(interface=interface, tangent=answer(interface, pairing, z))
        return kept["tangent"]

    return Wrapped(penalty, tangent=tangent)


def _pushes_what_a_roller_takes(penalty: float) -> Any:
    """A couple of forces along the interface at the ends of the slave: right in sum, and in all that bodies see."""

    def residual(answer: Any, interface: Any, pairing: Any, z: Any) -> Any:
        forces = np.array(answer(interface, pairing, z)).reshape(*z.shape[:-1], -1, 2)
        first, last = interface.slave.segments[0, 0], interface.slave.segments[-1, 1]
        along = (z.reshape(forces.shape)[..., last, :] - z.reshape(forces.shape)[..., first, :]) * penalty * 1e-3
        forces[..., first, :] += along
        forces[..., last, :] -= along
        return forces.reshape(z.shape)

    return Wrapped(penalty, residual=residual)


MUTANTS = (
    line("pulls where the gap is open", UNILATERAL, "eq6",
         "pressed(dot(minus(x_v, x1), n), multipliers, point, penalty) and on_surface", "on_surface", factory="vts_me"),
    line("a multiplier that pulls is kept", COMPLEMENTARITY, "eq6",
         "multipliers[point] - penalty * g >= 0", "multipliers[point] - penalty * g >= 0 or multipliers[point] < 0",
         factory="nts_lm"),
    line("with multipliers, contact begins by itself only", UNILATERAL, "eq6",
         "multipliers[point] - penalty * g >= 0", "multipliers[point] > 0", factory="nts_lm"),
    # Force and moment still balance, and where nothing overhangs there is no difference.
    line("free end of the master goes on for ever", DEAD_ZONE, "ppt", '"cover": walk.COVER', '"cover": walk.EXTEND'),
    line("the first multiplier twice", RANK, "points",
         "return segment, other, slot", "return tuple(np.append(of, of[0]) for of in (segment, other, slot))",
         factory="nts_lm"),
    Mutant("forces that a roller takes", VARIANTS, lambda *, penalty: _pushes_what_a_roller_takes(penalty)),
    # Wrong only in shallow contact, as high penalties make it; few states of an interface alone are like that.
    line("spring softened in shallow contact", SOLVE, "box3",
         "f_v = pressure * l_ab * (c_p - c_q) / 2",
         "f_v = pressure * l_ab * (c_p - c_q) / 2 * (1.0 if -g.real > 1e-4 * l_12.real else 0.9)"),
    line("shares of the slave nodes equal in shallow contact", SOLVE, "box3",
         "push(r, node_a, (1 - c) / 2 * f_v, normal)",
         "c = c if -g.real > 1e-4 * l_12.real else 0.0; push(r, node_a, (1 - c) / 2 * f_v, normal)"),
    Mutant("pressure said to be one percent less", SOLVE,
           lambda *, penalty: _says_of_its_points(penalty, lambda points: 0.99 * points.pressure)),
    Mutant("pressure from the vertical gap", VARIANTS,
           lambda *, penalty: _says_of_its_points(penalty, lambda points: points.pressure * abs(points.normal[:, 1]))),
    Mutant("tangent kept from the first iterate", ORDER, lambda *, penalty: _keeps_its_first_tangent(penalty)),
    line("stress part of the tangent missing in shallow contact", ORDER, "box3",
         "f_v = stiffness * e * l_ab * share", "f_v = stiffness * e * l_ab * share * (-g > 1e-3 * l_12)"),
    line("tangent of a softer spring in shallow contact", HISTORY, "box3",
         "d_f = stiffness * share * (l_ab * d_e + e * d_l)",
         "d_f = (1.0 if -g > 1e-3 * l_12 else 0.5) * stiffness * share * (l_ab * d_e + e * d_l)"),
    line("force on a slave node off by 1e-6", FORCE, "box3",
         "push(r, node_a, (1 - c) / 2 * f_v, normal)", "push(r, node_a, (1 - c) / 2 * f_v * (1 + 1e-6), normal)"),
    line("slave and master forces of the printed algorithm", FORCE, "box3",
         "pressure = f_v / dot(minus(x_q, x_p), t)", "pressure = penalty * g"),
    line("shares of one segment exchanged", MOMENT, "box3",
         "xi = dot(minus(x_v, x1), t) / l_12", "xi = 1 - dot(minus(x_v, x1), t) / l_12"),
    line("shares of the nodes of a segment exchanged", MOMENT, "box3",
         "push(r, f, -pressure * w_f, normal)", "w_f, w_m = w_m, w_f; push(r, f, -pressure * w_f, normal)"),
    line("ξ of the last segment from its other end", PATCH, "box3",
         "b = dot(minus(x_q, x_f), t) / length", "b = 1 - dot(minus(x_q, x_f), t) / length"),
    line("intermediate segments skipped", PATCH, "box3",
         "w_m = length * (b * b - a * a) / 2", "w_m = length * (b * b - a * a) / 2 * (b - a < 1)"),
    line("ξ taken for one half", MOMENT, "eq6",
         "xi = dot(minus(x_v, x1), t) / l_12", "xi = 0.5 + 0 * g", factory="vts_me"),
    line("normal of each master segment for its share", FORCE, "box3",
         "x_f, x_m = node(now, f), node(now, m)",
         "x_f, x_m = node(now, f), node(now, m); normal = frame(x_f, x_m)[2]"),
    line("area of competence cut at the wrong node", PATCH, "walk",
         "cut_q[point] = master[stop, 1]", "cut_q[point] = master[stop, 0]"),
    line("penalty squared", PATCH, "box3",
         "f_v = pressure * l_ab * (c_p - c_q) / 2", "f_v = penalty * pressure * l_ab * (c_p - c_q) / 2"),
    line("pushes where the gap is open", PATCH, "walk",
         "pressed(dot(minus(x_v, x1), n_m),", "pressed(-dot(minus(x_v, x1), n_m),"),
    line("virtual slave nodes at Gauss points", PATCH, "box3",
         "c = -1 + (2 * (point % n) + 1) / n", "c = (-1 + (2 * (point % n) + 1) / n) * 2 / 3**0.5"),
    line("area of competence ends at the virtual slave node", PATCH, "box3",
         "c_p, c_q = c + 1 / n + zero, c - 1 / n + zero",
         "c_p, c_q = c + (1 / n if point % n < n - 1 else 0) + zero, c - 1 / n + zero"),
    line("walk ends one segment early", PATCH, "walk",
         "        stop = following", "        stop = following; break"),
    line("pushes the wrong way", PATCH, "box3",
         "f_v = pressure * l_ab * (c_p - c_q) / 2", "f_v = -pressure * l_ab * (c_p - c_q) / 2"),
    Mutant("positions in single precision", PATCH, lambda *, penalty: _single_precision(penalty)),
    line("sign of ω in Eq. 6", TANGENT, "eq6",
         "d_omega[2, i] = -n[i] / l_12", "d_omega[2, i] = n[i] / l_12", factory="vts_me"),
    line("Δn missing", TANGENT, "box3",
         "value -= force * t[i] * d_omega[column, j]", "pass"),
    line("Δl_AB missing", TANGENT, "box3",
         "d_l[A, i], d_l[B, i] = -t_ab[i], t_ab[i]", "pass"),
    line("ΔS missing", TANGENT, "box3",
         "d_pressure[:CORE] = d_f / s - f_v * d_s / (s * s)", "d_pressure[:CORE] = d_f / s"),
    line("Δc of a cut end missing", TANGENT, "box3",
         "d_c[cutting_node, i] += t[i] / half", "pass"),
    line("Δl of the neighbour missing in NTS-AR", TANGENT, "eq6",
         "_stretch(d_area, 4, x, nodes[4], nodes[5], w)", "pass", factory="nts_ar"),
    line("one entry of the tangent off by 1e-3", TANGENT, "box3",
         "values[place] = value", "values[place] = value * (1 + 1e-3 * (place == 5))"),
    line("area of competence not shortened at a free end", TANGENT, "box3",
         "f_v = pressure * l_ab * (c_p - c_q) / 2", "f_v = pressure * l_ab / n"),
    line("virtual slave node not moved with its cut area", TANGENT, "box3",
         "c = (c_p + c_q) / 2\n            x_v", "c = -1 + (2 * (point % n) + 1) / n\n            x_v"),
    line("last point missing in the tangent", TANGENT, "box3",
         "for point in range(len(active)):\n        own", "for point in range(len(active) - 1):\n        own"),
    line("rotation of the frame that cuts missing", TANGENT, "box3",
         "lever = dot(minus(between(x_a, x_b, c), x_e), normal)", "lever = 0.0"),
    line("lever of the ends of an area missing", TANGENT, "box3",
         "lever = dot(minus(x_end, x_f), normal) - end * dot(minus(x_m, x_f), normal)", "lever = 0.0"),
    line("rotation of the projected length missing", TANGENT, "box3",
         "d_length[:CORE] = dot(minus(x_m, x_f), normal) * d_omega", "pass"),
    line("g ω missing in Δξ", TANGENT, "eq6",
         "d_xi += g * d_omega / l_12", "pass", factory="vts_me"),
    line("rows and columns exchanged", TANGENT, "box3",
         "rows[place] = 2 * nodes[at] + i\n                columns[place] = 2 * nodes[column] + j",
         "columns[place] = 2 * nodes[at] + i\n                rows[place] = 2 * nodes[column] + j"),
    Mutant("tangent symmetrised", TANGENT, lambda *, penalty: _symmetrises(penalty)),
    line("length without its imaginary part", TANGENT, "box3",
         "l_ab, _, _ = frame(x_a, x_b)\n            if", "l_ab = frame(x_a, x_b)[0].real\n            if"),
    line("magnitude of a complex gap", TANGENT, "box3",
         "f_v = pressure * l_ab * (c_p - c_q) / 2", "f_v = -penalty * np.abs(g) * l_ab * (c_p - c_q) / 2"),
    line("stale normal", OBJECTIVITY, "box3",
         "l_12, t, normal = frame(x1, node(now, node_2))",
         "l_12, t, normal = frame(node(reference, node_1), node(reference, node_2))"),
    line("a normal along the axis", OBJECTIVITY, "eq6",
         "        l_12, t, n = frame(x1, node(x_now, node_2))",
         "        l_12, t, n = frame(x1, node(x_now, node_2)); n = (0 * n[0], 1.0 + 0 * n[1])", factory="vts_me"),
    line("absolute tolerance for a gap", SCALING, "walk",
         "pressed(dot(minus(x_v, x1), n_m),", "pressed(dot(minus(x_v, x1), n_m) - 1e-9,"),
    line("absolute guard against a division by zero", SCALING, "box3",
         "xi = dot(minus(x_v, x1), t) / l_12", "xi = dot(minus(x_v, x1), t) / (l_12 + 1e-12)"),
    line("shortest length allowed, absolute", SCALING, "eq6",
         "xi = dot(minus(x_v, x1), t) / l_12", "xi = dot(minus(x_v, x1), t) / max(l_12.real, 1e-9)",
         factory="vts_me"),
    Mutant("small forces dropped", SCALING, lambda *, penalty: _drops_small_forces(penalty)),
    line("NaN on a segment seen edge-on", PURITY, "walk",
         "_projected_length(x, master, following, t) <= 0", "_projected_length(x, master, following, t) < 0",
         nth=0, factory="vts_ppt", free_end="extend"),
    line("a batch of one state many times", PURITY, "box3",
         "now, r = x[state], forces[state]", "now, r = x[0], forces[state]"),
    Mutant("open cells adhere", UNILATERAL, _all_or_none(contactverif_mortar.sts)),
    Mutant("open nodes adhere", UNILATERAL, _all_or_none(contactverif_mortar.mortar)),
    Mutant("multipliers of open nodes adhere", COMPLEMENTARITY, _all_or_none(contactverif_mortar.mortar_lm)),
    Mutant("nodes between others are not let go", COMPLEMENTARITY, _held_between(contactverif_mortar.mortar_lm)),
    Mutant("multipliers that give way", COMPLEMENTARITY, lambda *, penalty: _soft_multipliers(penalty)),
    Mutant("numbers encoded in the pairing", TANGENT, lambda *, penalty: _numbers_in_the_pairing(penalty)),
    Mutant("pairing kept from the first call", PURITY, lambda *, penalty: _remembers(penalty)),
    Mutant("pairing that changes at every call", PURITY, lambda *, penalty: _restless(penalty)),
    Mutant("tangent that leaves a trace", PURITY, lambda *, penalty: _tangent_leaves_a_trace(penalty)),
    Mutant("interface modified", PURITY, lambda *, penalty: _moves_the_mesh(penalty)),
    Mutant("positions modified", PURITY, lambda *, penalty: _writes_on_its_input(penalty)),
    line("area measured elsewhere than the trait says", RESULTANT, "ppt",
         "current_area=current,", "current_area=False,"),
    line("last node of the last chain forgotten", RESULTANT, "points",
         "segment = np.concatenate([np.arange(len(slave)), last])",
         "last = last[:-1]; segment = np.concatenate([np.arange(len(slave)), last])", factory="nts_ar"),
    line("neighbour taken by its number", RESULTANT, "points",
         "other = np.concatenate([slave.neighbours[:, 0], ", "other = np.concatenate([np.arange(len(slave)) - 1, ",
         factory="nts_ar"),
    line("weights that do not add up to one", RESULTANT, "points", "np.full(n, 1 / n)", "np.full(n, 0.9 / n)",
         factory="vts_me"),
    line("search on the reference configuration", PATCH, "ppt",
         "x, multipliers = split_state(interface, z)\n        master = interface.master",
         "x, multipliers = np.array(interface.nodes), np.zeros(0)\n        master = interface.master"),
    line("next master segment taken by its number", PATCH, "box3",
         "                j = neighbours[j, 1]", "                j = (j + 1) % len(neighbours)"),
)  # fmt: skip

# Wrong too, and no property asks after it yet: what is missing is named, and a property that catches one tells so.
SURVIVORS = (
    # Exact for a uniform gap, and so on flat interfaces; action equals reaction at each point.
    Mutant("one Gauss point a cell", "accuracy.linear",
           lambda *, penalty: replace(contactverif_mortar.sts(penalty=penalty), quadrature=Quadrature.gauss(1, True))),
)  # fmt: skip
