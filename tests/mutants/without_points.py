"""Ask about wrong forces without the contact points, which are optional: a mutant must not be caught by them alone.

Where the property that is meant to catch a mutant looks at points, the mutant is asked again without any. What else
then catches it stands in `CAUGHT_BY`. A mutant whose reports alone are wrong is right without them.
"""

from collections.abc import Callable
from typing import Any

from mutate import Mutant
from subjects import Changed

REPORTS_ALONE = "only what it reports is wrong"
CAUGHT_BY = {
    "whole slave segments in contact": "nodal-push",
    "whole slave segment active with one of its points": "nodal-push",
    "activity of the neighbour": "unilateral",
    "penetrations below 1e-9 left open": "hard.offset",
    "gaps below 1e-9 closed": "units",
    "segments of the nearest node only": "hard.search",
    "wrong with four chains": "patch.flat.transmission",
    "wrong at tilts of 23° to 29°": "patch.flat.transmission",
    "wrong beyond 45°": "patch.tilted.resultant",
    "wrong at a re-entrant vertex": "locality.bend",
    "wrong on a closed master": "hard.search",
    "wrong deeper than half a segment": "hard.deep",
    "wrong past the end of the master": "hard.free-end",
}
# Who has wrong forces and survives without points, with the reason.
RIGHT_WITHOUT = {
    "contact points of the last residual": REPORTS_ALONE,
    "contact points of the last pairing": REPORTS_ALONE,
    "residual on the pairing of the last contact points": "nobody asks for points, so nothing remembers their pairing",
}


def reports_alone(mutant: Mutant) -> bool:
    """Return whether the contact points are the one part of a right formulation that is changed."""
    formulation = mutant.make(penalty=1.0)
    changes = set(vars(formulation)) - {"inner"} if isinstance(formulation, Changed) else set()
    return changes == {"contact_points"}


def count_points(make: Callable[..., Any], calls: list[None]) -> Callable[..., Any]:
    """Return the factory of a formulation that adds an entry to a list at each call of `contact_points`."""

    def counting(*, penalty: float) -> Any:
        inner = make(penalty=penalty)
        if not callable(getattr(inner, "contact_points", None)):
            return inner

        def contact_points(*arguments: Any) -> Any:
            calls.append(None)
            return inner.contact_points(*arguments)

        return Changed(inner, contact_points=contact_points)

    return counting


def take_points_away(make: Callable[..., Any]) -> Callable[..., Any]:
    """Return the factory of a formulation without contact points."""
    return lambda *, penalty: Changed(make(penalty=penalty), contact_points=None)
