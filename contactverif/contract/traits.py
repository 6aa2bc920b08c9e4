"""The promises of a formulation: `Traits`.

A trait is a claim that a property checks. The words that say what each promise means stand here, once.

Rules for the next editor: a new trait is optional, and ``None`` promises nothing. A promise "does not" needs a witness
that runs. A promise that no property checks is withdrawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from contactverif.contract.errors import ContractError
from contactverif.contract.published_forces import check_published_forces

_VALUES_OF_TRAITS: dict[str, tuple[object, ...]] = {
    "passes_flat_patch": (True, False, None),
    "passes_normal_patch": (True, False, None),
    "passes_single_patch": (True, False, None),
    "passes_kinked_patch": (True, False, None),
    "covers_overhang": (True, False, None),
    "converges": (True, False, None),
    "inf_sup": (True, False, None),
    "locks": (True, False, None),
    "integrates_linear_gap": (True, False, None),
    "tangent": ("exact", "approximate", None),
    "symmetric": (True, False, None),
    "conserves_force": (True, False, None),
    "conserves_moment": (True, False, None),
    "continuity": ("C0", "C1", "jumps", None),
    "area": ("reference", "current", None),
    "gap": ("closest point", "slave normal", "cells", "cells and nodes", None),
    "force_along": ("master normal", "slave normal", None),
    "local": (True, False, None),
    "unbiased": (True, False, None),
    "nodes_push": (True, False, None),
    "translation_stable": (True, False, None),
    "penalty": ("nodal", "distributed", None),
    "enforcement": ("penalty", "multiplier", "barrier"),
    "independent_multipliers": (True, False, None),
    "batched": (True, False),
    "takes_complex": (True, False),
    "takes_longdouble": (True, False),
}


@dataclass(frozen=True, slots=True)
class Traits:
    """The promises of a formulation; the harness checks every one.

    Every trait is optional. ``None`` promises nothing. ``True``, or a word, is a promise that holds for all cases.
    ``False`` says "does not"; it needs a case that shows so, the witness of the property that checks the promise.

    Attributes
    ----------
    passes_flat_patch : bool | None
        The formulation transmits a uniform pressure exactly across any flat interface on which the master covers the
        slave. With a penalty, the pressure is ε̂ |gap|; so a formulation whose law is not linear promises nothing here.
    passes_normal_patch : bool | None
        It does so at least where each inner node of the master lies on a node of the slave.
    passes_single_patch : bool | None
        It does so at least where each inner node of the master lies on a node of the slave or in the middle of a slave
        segment.
    passes_kinked_patch : bool | None
        The formulation does so too on an interface with kinks, if nodes of both surfaces lie at every kink.
    covers_overhang : bool | None
        The formulation does so too where the slave overhangs the master inside a slave segment.
    converges : bool | None
        On finer meshes, with a penalty that grows as E/h, nodal forces converge to those of the exact solution.
    inf_sup : bool | None
        The constraints satisfy the inf-sup condition: their constant β does not fall as meshes are refined.
    locks : bool | None
        At a high penalty the interface becomes stiffer than the bodies, or its pressures become rough. ``False``
        promises that it does not, ``True`` needs a witness.
    integrates_linear_gap : bool | None
        The nodal forces of a gap that is linear along a straight, wholly active slave segment are exact integrals.
    tangent : Literal['exact', 'approximate'] | None
        ``"exact"``: `Formulation.tangent` is the derivative of the residual on a frozen pairing. ``"approximate"``: it
        is not.
    symmetric : bool | None
        The tangent is symmetric.
    conserves_force, conserves_moment : bool | None
        The forces on slave and master balance at any tilt and curvature; so do their moments.
    continuity : Literal['C0', 'C1', 'jumps'] | None
        The smoothness of the forces while a slave slides over the vertices of a master that no line along the normal
        meets twice: ``"C0"``, forces are continuous; ``"C1"``, their slopes are too; ``"jumps"``, forces jump, which
        needs a witness.
    area : Literal['reference', 'current'] | None
        The configuration in which areas of competence are measured. They add up to the slave's length there, so that a
        uniform penetration gives the total force ε̂ |gap| × that length. ``None`` where springs act twice (two-pass).
    gap : Literal['closest point', 'slave normal', 'cells', 'cells and nodes'] | None
        The rule by which a contact point gets its master segment, ξ, normal and gap. ``"closest point"``: the nearest
        closed master segment, ξ and gap along that segment's normal. ``"slave normal"``: the line through the point
        along the normal of its slave segment; of the master segments that face the slave (their tangents run against
        each other) and that this line meets, the nearest; the gap along the line, and the normal out of the master is
        the slave segment's, reversed. ``"cells"``: the same, but the segment is chosen once for each cell, the overlap
        of a slave with a master segment seen along the slave's normal; the nearest in the middle of its overlap. A
        weighted node has its own normal and segment by this rule, but the mean gap of its cells. ``"cells and nodes"``:
        as ``"cells"``, but pressures and contact follow from gaps of the slave nodes by ``"closest point"``.
    force_along : Literal['master normal', 'slave normal'] | None
        The direction in which a contact point pushes: along the normal of its master segment, or of its slave segment.
    local : bool | None
        The forces between a slave and the master segments that it touches do not depend on where other nodes of the
        master are.
    unbiased : bool | None
        The forces are the same if slave and master exchange their roles.
    nodes_push : bool | None
        No node is ever pulled towards the other surface, but for master nodes of a segment that a foot lies past (Eq. 6
        leaves ξ unclipped). Dual shape functions, which are negative in places, may pull.
    translation_stable : bool | None
        An exact translation of the whole state, however far, changes forces and tangent by no more than rounding the
        positions relative to one another would. Kernels that take differences of nodes first are; kernels that round a
        point at its distance from the origin are not. ``None`` promises nothing: such kernels are common and not wrong.
    penalty : Literal['nodal', 'distributed'] | None
        The unit of the penalty: ``"nodal"`` is force per length, ``"distributed"`` is force per length per length of
        penetration. For multipliers it says what a multiplier is: a nodal force, or a pressure.
    enforcement : Literal['penalty', 'multiplier', 'barrier']
        The way in which contact is enforced.
    independent_multipliers : bool | None
        The constraints are independent on any mesh, so that the multipliers are unique.
    dimensions : tuple[int, ...]
        The numbers of coordinates that the formulation supports.
    batched : bool
        ``residual`` takes a batch of states, z (..., n_unknowns), in one call. Otherwise the harness loops.
    takes_complex : bool
        ``residual`` takes complex positions, so that the harness may use a complex step.
    takes_longdouble : bool
        ``residual`` takes positions in ``numpy.longdouble`` and computes in that precision.
    witnesses : Mapping[str, str]
        ``{property id: name of a case}`` for each promise "does not". The case always runs. The beginning of an id
        stands for all ids below it: ``"patch"`` is the witness of ``"patch.flat.solve"`` too. A property that solves
        bodies takes the scene of that name (``"c-prime"``, or with options ``"c-prime:penalty=1e4"``).
    published_forces : Mapping[str, str]
        ``{name of a flat case: forces}``: what the formulation makes of a uniform penetration, right or wrong, as
        fractions over penalty × penetration, or what it makes of unit multipliers. First those on the slave nodes, then
        those on the master nodes, each from left to right: ``{"a1": "1 2 1; 2 2"}``. The harness holds it to them.
    source : str
        The publication of the formulation.

    Raises
    ------
    ContractError
        If a trait has none of the values listed here, for example a misspelt word, or forces are no fractions.

    Examples
    --------
    Nodal springs with an exact tangent that fail the patch test on case A1 of the reference paper:

    >>> from contactverif import Traits
    >>> traits = Traits(
    ...     passes_flat_patch=False, witnesses={"patch": "a1"}, tangent="exact", symmetric=True, penalty="nodal"
    ... )
    >>> traits.witness("patch.flat.transmission")
    'a1'
    """

    passes_flat_patch: bool | None = None
    passes_normal_patch: bool | None = None
    passes_single_patch: bool | None = None
    passes_kinked_patch: bool | None = None
    covers_overhang: bool | None = None
    converges: bool | None = None
    inf_sup: bool | None = None
    locks: bool | None = None
    integrates_linear_gap: bool | None = None
    tangent: Literal["exact", "approximate"] | None = None
    symmetric: bool | None = None
    conserves_force: bool | None = None
    conserves_moment: bool | None = None
    continuity: Literal["C0", "C1", "jumps"] | None = None
    area: Literal["reference", "current"] | None = None
    gap: Literal["closest point", "slave normal", "cells", "cells and nodes"] | None = None
    force_along: Literal["master normal", "slave normal"] | None = None
    local: bool | None = None
    unbiased: bool | None = None
    nodes_push: bool | None = None
    translation_stable: bool | None = None
    penalty: Literal["nodal", "distributed"] | None = None
    enforcement: Literal["penalty", "multiplier", "barrier"] = "penalty"
    independent_multipliers: bool | None = None
    dimensions: tuple[int, ...] = (2,)
    batched: bool = False
    takes_complex: bool = False
    takes_longdouble: bool = False
    witnesses: Mapping[str, str] = field(default_factory=dict)
    published_forces: Mapping[str, str] = field(default_factory=dict)
    source: str = ""

    def witness(self, property_id: str) -> str | None:
        """Return the name of the case that shows that a promise "does not" holds.

        Parameters
        ----------
        property_id : str
            The id of a property, such as ``"patch.flat.solve"``.

        Returns
        -------
        str | None
            The name from `witnesses` for the id or for the longest beginning of it; None if there is none.
        """
        parts = property_id.split(".")
        for n in range(len(parts), 0, -1):
            if (name := self.witnesses.get(".".join(parts[:n]))) is not None:
                return name
        return None

    def __post_init__(self) -> None:
        for name, values in _VALUES_OF_TRAITS.items():
            if getattr(self, name) not in values:
                needed = ", ".join(map(repr, values))
                raise ContractError(f"Traits.{name}: found {getattr(self, name)!r}; needed one of {needed}")
        if not isinstance(self.witnesses, Mapping):
            raise ContractError(
                f"Traits.witnesses: found a {type(self.witnesses).__name__}; needed {{property id: name of a case}}"
            )
        check_published_forces(self.published_forces)
