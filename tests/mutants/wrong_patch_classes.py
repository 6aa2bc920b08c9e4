"""Mutants of formulations that state that they fail the patch test: their mistakes hid behind that statement.

Each has the traits of the right formulation, or none. What it promises on smaller classes of meshes, or states of
its forces, is what catches it.
"""

from functools import partial
from typing import Any

from mutate import Mutant, changed_line, reports, wrap
from subjects import ResidualAlone

import contactverif_nts
from contactverif.contract.traits import Traits

NORMAL, NORMAL_SOLVE = "patch.flat.normal", "patch.flat.normal.solve"
SINGLE, SINGLE_SOLVE = "patch.flat.single", "patch.flat.single.solve"
NODAL, PUBLISHED, SCALE = "patch.flat.nodal", "patch.flat.published", "total-stiffness"
SMALL = "1e-12"  # The relative size of graded mistakes.

_PLACES = "c = -1 + (2 * np.arange(n) + 1) / n"
_AREA = "area = weight * area_length(now, slave, s, other[i])"
_FORCE = "f = penalty * v.g * area"
_POINT = "v = contact_at(now, slave[s, 0], slave[s, 1], master[partner[i], 0], master[partner[i], 1], {})"
_SHALLOW = "-v.g.real < 1e-4 * v.l_12.real"
# Where a master node lies between the two points of a segment, and not in the middle of it, they move apart.
_MOVED = "\n            ".join(
    [
        _POINT.format("0.0"),
        "in_middle = min(abs(v.xi), abs(1 - v.xi)) < 1e-6",
        "apart = 1.1 if partner[i] != partner[i ^ 1] and not in_middle else 1.0",
        _POINT.format("apart * places[slot[i]]"),
    ]
)


def _softens_both_passes(*, penalty: float) -> Any:
    """Return nine tenths of the forces of two passes of NTS-AR, and of their tangent."""

    def soften(right: Any, *arguments: Any) -> Any:
        return 0.9 * right(*arguments)

    make = partial(contactverif_nts.two_pass, inner=contactverif_nts.nts_ar)
    return wrap(penalty, make, residual=soften, tangent=soften)


def _stiffens(factor: float) -> Any:
    """Return the forces of NTS-AR with another stiffness, and nothing else: no other part, and no promise."""

    def make(*, penalty: float) -> Any:
        springs = ResidualAlone(contactverif_nts.nts_ar(penalty=factor * penalty))
        springs.traits = Traits()
        return springs

    return make


def _line(name: str, caught_by: str, old: str, new: str, factory: str, module: str = "nts_force") -> Mutant:
    return Mutant(name, caught_by, changed_line(module, old, new, factory=factory))


MUTANTS = (
    _line("mean area of competence at every slave node", NORMAL, _AREA,
          "area = sum([area_length(now, slave, k, -1) for k in range(len(slave))]) / len(active)", "nts_ar"),
    _line(f"area of competence at a free end off by {SMALL}", NORMAL, _AREA,
          f"{_AREA} * (1 + {SMALL} * (other[i] < 0))", "nts_ar"),
    Mutant("reported pressure of VTS-ME with the wrong sign", NORMAL,
           reports(contactverif_nts.vts_me, lambda points, *_: {"pressure": -points.pressure})),
    Mutant(f"reported pressure of VTS-G off by {SMALL}", NORMAL,
           reports(contactverif_nts.vts_g, lambda points, *_: {"pressure": (1 + float(SMALL)) * points.pressure})),
    _line("NTS-AR softened in shallow contact", NORMAL_SOLVE, _FORCE, f"{_FORCE} * (0.9 if {_SHALLOW} else 1.0)",
          "nts_ar"),
    _line("points of VTS-ME at Gauss points", SINGLE, _PLACES, "c = np.polynomial.legendre.leggauss(n)[0]", "vts_me",
          module="point_contact"),
    _line(f"points of VTS-ME moved by {SMALL}", SINGLE, _PLACES, f"{_PLACES} + {SMALL}", "vts_me",
          module="point_contact"),
    _line("points of VTS-ME at Gauss points in shallow contact", SINGLE_SOLVE, _POINT.format("places[slot[i]]"),
          f"{_POINT.format('places[slot[i]]')}\n"
          f"            if {_SHALLOW}: {_POINT.format('places[slot[i]] * 2 / 3**0.5')}",
          "vts_me"),
    _line("half a spring at a free end of NTS", NODAL, "area = 1 + 0 * v.g",
          "area = (1 + (other[i] >= 0)) / 2 + 0 * v.g", "nts"),
    _line(f"spring of NTS off by {SMALL}", NODAL, "area = 1 + 0 * v.g", f"area = 1 + {SMALL} + 0 * v.g", "nts"),
    _line("points of VTS-ME moved apart over a master node", PUBLISHED, _POINT.format("places[slot[i]]"), _MOVED,
          "vts_me"),
    Mutant("two passes of NTS-AR a tenth too soft", PUBLISHED, _softens_both_passes),
    Mutant("three times too stiff, without a promise", SCALE, _stiffens(3.0)),
    Mutant("a third as stiff, without a promise", SCALE, _stiffens(1 / 3)),
    Mutant("half again too stiff, without a promise", SCALE, _stiffens(1.5)),
)  # fmt: skip
