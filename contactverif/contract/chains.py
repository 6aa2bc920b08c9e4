"""Chains of segments in the plane: the segment that follows each, the order of a walk, and what is wrong."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import IntArray
from contactverif.contract.errors import MisuseError


def link_segments(segments: IntArray) -> list[IntArray]:
    """Check segments (n_segments, 2); return neighbours, chain order and starts, and nodes, as `Surface` has them."""
    _check_chains(segments)
    nodes, ends = np.unique(segments, return_inverse=True)
    first, second = ends.reshape(segments.shape).T  # Node numbers without gaps.
    starting, ending = (np.full(len(nodes), -1) for _ in range(2))
    starting[first] = ending[second] = np.arange(len(segments))
    neighbours = np.column_stack([ending[first], starting[second]])  # −1 at a free end.
    order = _chain_order(neighbours)
    starts = np.flatnonzero(np.append(True, neighbours[order[:-1], 1] != order[1:]))
    return [neighbours, order, starts, nodes]


def _check_chains(segments: IntArray) -> None:
    """Check that node numbers and connections are those of chains."""
    if segments.min() < 0:
        raise MisuseError("segments", f"node number {segments.min()}", "node numbers ≥ 0")
    loops = np.flatnonzero(segments[:, 0] == segments[:, 1])
    if len(loops):
        segment = loops[0]
        node = segments[segment, 0]
        raise MisuseError("segments", f"segment {segment} that begins and ends at node {node}", "two nodes")
    for end, verb in ((0, "begin"), (1, "end")):
        numbers = np.sort(segments[:, end])
        if (numbers[1:] == numbers[:-1]).any():
            numbers, counts = np.unique(numbers, return_counts=True)
            node = numbers[np.argmax(counts)]
            meeting = ", ".join(map(str, np.flatnonzero(segments[:, end] == node)[:4]))
            raise MisuseError(
                "segments",
                f"segments {meeting} that all {verb} at node {node}",
                "chains: a node begins at most one segment and ends at most one (body on the left throughout)",
            )


def _chain_order(neighbours: IntArray) -> IntArray:
    """Return open chains first, each from its free end; then closed chains, each from its lowest segment."""
    numbers = np.arange(len(neighbours))
    if ((neighbours[:, 1] == numbers + 1) | (neighbours[:, 1] < 0)).all():
        return numbers  # Open chains, numbered as they run.
    following = neighbours[:, 1].tolist()
    visited = [False] * len(following)
    order = []
    for start in [*np.flatnonzero(neighbours[:, 0] < 0).tolist(), *range(len(following))]:
        segment = start
        while segment >= 0 and not visited[segment]:
            visited[segment] = True
            order.append(segment)
            segment = following[segment]
    return np.array(order, dtype=np.int64)
