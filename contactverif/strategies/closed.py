"""Closed rings: chains without an end, which have a seam where their numbering begins."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.case import Case
from contactverif.strategies.panels import assemble_panels
from contactverif.strategies.parts import OFFSETS, motions, penalties, seeds, shuffles
from contactverif.strategies.rings import rings


def closed_cases() -> SearchStrategy[Case]:
    """Return a closed ring in a hole, off the lattice, numbered as one walks along it or at random."""
    return _closed_cases()


@st.composite
def _closed_cases(draw: DrawFn) -> Case:
    ring = replace(draw(rings()), degrees=360)
    motion, penalty, seed, shuffle = draw(motions()), draw(penalties()), draw(seeds()), draw(shuffles())
    interface, z, _ = assemble_panels([ring(draw(OFFSETS))], motion, shuffle)
    return Case(interface, z, penalty, {}, seed)
