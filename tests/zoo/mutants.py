"""All mutants: those of plane formulations, those of formulations on faces, and those that survive."""

from zoo import barriers, faces, factored, laws, lines, memories, reported, rounded, states, tangents
from zoo.making import PLANE, SPACE, SURVIVORS, Mutant

__all__ = ["PLANE", "SPACE", "SURVIVORS", "Mutant", "barriers", "faces", "factored", "laws", "lines", "memories"]
__all__ += ["reported", "rounded", "states", "tangents"]
