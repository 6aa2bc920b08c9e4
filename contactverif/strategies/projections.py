"""Cases by kind of projection: one strategy for each way in which a slave point can face the master.

`Case.kind` names the kind, so that a run can count how many cases of each kind it judged. The parameters
"probe_segment" and "probe_c" name the slave point that the case is about; its other points are where they happen to be.

Every kind is constructed, and none is filtered. Where exactness is the point (a hit node, a tie), coordinates are exact
in binary and stay so under the motion. The other cases have full mantissas: sevenths, any rotation, offsets to 2^20.
The oracle says whether a case is of its kind (`contactverif.oracle.is_of_kind`), and a test asks it.
"""

from __future__ import annotations

from functools import cache
from typing import overload

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.strategies import given_projections, segment_kinds, vertex_kinds
from contactverif.strategies.sketches import Sketch, sketch_cases

_SKETCHES: dict[str, SearchStrategy[Sketch]] = {
    "inside a segment": segment_kinds.inside(),
    "first of several segments": segment_kinds.one_of_several("first"),
    "intermediate of several segments": segment_kinds.one_of_several("intermediate"),
    "last of several segments": segment_kinds.one_of_several("last"),
    "node hit exactly": vertex_kinds.node_hit(),
    "coincident nodes": vertex_kinds.coincident_nodes(),
    "convex vertex": vertex_kinds.vertex("convex vertex"),
    "concave vertex": vertex_kinds.vertex("concave vertex"),
    "master angle below 90°": vertex_kinds.vertex("master angle below 90°"),
    "equidistant from three segments": vertex_kinds.three_segments(),
    "equidistant from three nodes": vertex_kinds.three_nodes(),
    "free end hit exactly": segment_kinds.free_end(),
    "past a free end, inside τ": segment_kinds.past_end("past a free end, inside τ"),
    "past a free end, outside τ": segment_kinds.past_end("past a free end, outside τ"),
    "overlap going to zero": segment_kinds.small_overlap(),
    "edge-on, 89.9°": segment_kinds.angle("edge-on, 89.9°", 89.9),
    "edge-on, 90°": segment_kinds.angle("edge-on, 90°", 90.0),
    "from behind": segment_kinds.angle("from behind", 180.0),
    "second body behind": segment_kinds.second_body(),
    "closing segment": segment_kinds.closing_segment(),
    "nearest node not on nearest segment": segment_kinds.other_node(),
}
KINDS = tuple(_SKETCHES)


@cache
def cases_of_kind(kind: str) -> SearchStrategy[Case]:
    """Return cases of one kind; the parameters "probe_segment" and "probe_c" name the slave point of this kind."""
    return sketch_cases(_SKETCHES[kind])


@overload
def projections_by_kind(interface: None = None) -> dict[str, SearchStrategy[Case]]: ...
@overload
def projections_by_kind(interface: Interface | None) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case]: ...
def projections_by_kind(
    interface: Interface | None = None,
) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case]:
    """Return a strategy for each kind, so that each gets its share of a run; one strategy for a mesh of the user."""
    return {kind: cases_of_kind(kind) for kind in KINDS} if interface is None else given_projections.states(interface)


def projection_states(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Return cases of all kinds of projection, mixed with others by `st.one_of`.

    Hypothesis varies what it has drawn before, so the shares of the kinds differ widely; `projections_by_kind` gives
    each kind its share.
    """
    if interface is not None:
        return given_projections.states(interface)
    return st.one_of(*map(cases_of_kind, KINDS))
