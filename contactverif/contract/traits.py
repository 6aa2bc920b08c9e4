"""The traits of a formulation: what it promises, the rules it follows, what it is able to do, and what shows so.

Rules for the next editor: a new trait is optional, and ``None`` promises nothing. A promise "does not" needs a witness
that runs. A promise that no property checks is withdrawn. No two traits have the same name, whatever their group.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from fractions import Fraction
from functools import lru_cache
from math import inf
from typing import Any, Literal, get_args, get_origin, get_type_hints

from contactverif.contract.errors import ContractError

_LEAST_REACH = 0.125  # Segments. Who looks less far takes almost no state.
_FARTHEST = 1e9  # The largest activation distance, in segments or lengths: a barrier acts near contact.
_HIGHEST = 8.0  # The largest power of the penalty.
_COARSEST = 1e-2  # The largest error that a tangent may promise. A coarser one is `"approximate"`.
_LONGEST_TEXT = 10_000  # Characters of forces. A number with an exponent such as 1e10000000 has as many digits.
_LONG_EXPONENT = re.compile(r"[eE][-+]?[\d_]{3}")


@dataclass(frozen=True, slots=True)
class PatchPromises:
    """The interfaces across which a formulation transmits a uniform pressure exactly.

    With a penalty, the pressure is ε̂ |gap|. A law of its own (trait `law`) has on all meshes the pressure that it has
    on a flat pair whose inner nodes meet.

    Attributes
    ----------
    flat : bool | None
        Any flat interface on which the master covers the slave.
    normal : bool | None
        At least those where each inner node of the master lies on a node of the slave.
    single : bool | None
        At least those where each inner node of the master lies on a node of the slave or in the middle of a slave
        segment.
    kinked : bool | None
        Also an interface with kinks, if nodes of both surfaces lie at every kink.
    overhang : bool | None
        Also where the slave overhangs the master inside a slave segment.
    """

    flat: bool | None = None
    normal: bool | None = None
    single: bool | None = None
    kinked: bool | None = None
    overhang: bool | None = None

    def __post_init__(self) -> None:
        _check_values(self, "promises.patch")


@dataclass(frozen=True, slots=True)
class Promises:
    """Statements about all cases (``True``, or a word), or about a case that shows a fault (``False``).

    Attributes
    ----------
    patch : PatchPromises
        The patch tests that the formulation passes.
    converges : bool | None
        On finer meshes, with a penalty that grows as E/h, nodal forces converge to those of the exact solution.
    inf_sup : bool | None
        The constraints satisfy the inf-sup condition: their constant β does not fall as meshes are refined.
    locks : bool | None
        At a high penalty the interface becomes stiffer than the bodies, or its pressures become rough. ``False``
        promises that it does not, ``True`` needs a witness.
    integrates_linear_gap : bool | None
        The nodal forces of a gap that is linear along a straight, wholly active slave segment are exact integrals.
    tangent : Literal['exact', 'approximate'] | float | None
        ``"exact"``: `Formulation.tangent` is the derivative of the residual on a frozen pairing. ``"approximate"``: it
        is not. A number, such as 1e-8: it is, by differences of this relative error, if coordinates are no larger than
        segments; the error grows in proportion to them.
    symmetric : bool | None
        The tangent is symmetric.
    conserves_force, conserves_moment : bool | None
        The forces on slave and master balance at any tilt and curvature; so do their moments.
    continuity : Literal['C0', 'C1', 'jumps'] | None
        The smoothness of the forces while a slave slides over the vertices of a master that no line along the normal
        meets twice, in space over the edges of a flat one: ``"C0"``, forces are continuous; ``"C1"``, their slopes are
        too where nothing opens; ``"jumps"``, forces jump, which needs a witness.
    local : bool | None
        The forces between a slave and the master segments that it touches do not depend on where other nodes of the
        master are.
    unbiased : bool | None
        The forces are the same if slave and master exchange their roles.
    nodes_push : bool | None
        No node is ever pulled towards the other surface, but for master nodes of a segment that a foot lies past (Eq. 6
        leaves ξ unclipped). Dual shape functions, which are negative in places, may pull.
    opens_at_ends : bool | None
        No force passes where a surface ends under a segment of the other one and the gap is open wherever one faces the
        other, however little that is. A gap that is extrapolated to a node past that end may be negative there.
    translation_stable : bool | None
        An exact translation of the whole state, however far, changes forces and tangent by no more than rounding the
        positions relative to one another would. Kernels that take differences of nodes first are; kernels that round a
        point at its distance from the origin are not. ``None`` promises nothing: such kernels are common and not wrong.
    independent_multipliers : bool | None
        The constraints are independent on any mesh, so that the multipliers are unique.
    never_intersects : bool | None
        No two surfaces ever intersect: the work of a barrier grows without bound as any node of either surface nears
        any segment or vertex of the other one, and no force jumps where the node passes from a segment to its end.
        A barrier that weights gaps, or looks from one surface, may be right without it.
    """

    patch: PatchPromises = field(default_factory=PatchPromises)
    converges: bool | None = None
    inf_sup: bool | None = None
    locks: bool | None = None
    integrates_linear_gap: bool | None = None
    tangent: Literal["exact", "approximate"] | float | None = None
    symmetric: bool | None = None
    conserves_force: bool | None = None
    conserves_moment: bool | None = None
    continuity: Literal["C0", "C1", "jumps"] | None = None
    local: bool | None = None
    unbiased: bool | None = None
    nodes_push: bool | None = None
    opens_at_ends: bool | None = None
    translation_stable: bool | None = None
    independent_multipliers: bool | None = None
    never_intersects: bool | None = None

    def __post_init__(self) -> None:
        _check_values(self, "promises")
        if self.tangent not in ("exact", "approximate"):
            _check_number(self, "promises", "tangent", 0.0, _COARSEST, "'exact', 'approximate', ")


@dataclass(frozen=True, slots=True)
class Rules:
    """The rules by which a formulation finds its gaps, areas, forces and pressures.

    Attributes
    ----------
    enforcement : Literal['penalty', 'multiplier', 'barrier']
        The way in which contact is enforced.
    penalty : Literal['nodal', 'distributed'] | None
        The unit of the penalty: ``"nodal"`` is force per length, ``"distributed"`` is force per length per length of
        penetration. For multipliers it says what a multiplier is: a nodal force, or a pressure.
    area : Literal['reference', 'current'] | None
        The configuration in which areas of competence are measured. They add up to the slave's length there, so that a
        uniform penetration gives the total force ε̂ |gap| × that length. ``None`` where springs act twice (two-pass),
        or where a pressure is no multiple of its gap.
    gap : Literal['closest point', 'slave normal', 'cells', 'cells and nodes'] | None
        The rule by which a contact point gets its master segment, ξ, normal and gap. ``"closest point"``: the nearest
        closed master segment, ξ and gap along that segment's normal. ``"slave normal"``: the line through the point
        along the normal of its slave segment; of the master segments that face the slave (their tangents run against
        each other) and that this line meets, the nearest; the gap along the line, and the normal out of the master is
        the slave segment's, reversed. ``"cells"``: the same, but the segment is chosen once for each cell, the overlap
        of a slave with a master segment seen along the slave's normal; the nearest in the middle of its overlap. A
        weighted node has its own normal and segment by this rule, but the mean gap of its cells. ``"cells and nodes"``:
        as ``"cells"``, but pressures and contact follow from gaps of the slave nodes by ``"closest point"``.
    gap_shapes, pressure_shapes : Literal['standard', 'dual'] | None
        The shapes of the slave nodes in a mortar method: those by which gaps are weighted, G_j = ∫φ_j g / ∫φ_j, and
        those that nodal pressures are multiplied by, Σ ψ_j p_j. ``"standard"``: linear. ``"dual"``: biorthogonal to the
        linear ones; what they are on a segment that is covered in part is not stated.
    force_along : Literal['master normal', 'slave normal'] | None
        The direction in which a contact point pushes: along the normal of its master segment, or of its slave segment.
    activation : float | None
        The largest distance at which a barrier pushes, over the length of `activation_unit`. A barrier that does not
        state it is asked nothing.
    activation_unit : Literal['segment', 'length']
        The unit of `activation` and `law_distance`: the shortest segment of both surfaces in the reference
        configuration, or a length.
    penalty_power : float | None
        The power of a length in the stiffness of a barrier or a law of its own: in a unit of length that is s times as
        small, it gets s^penalty_power times its number. It is −1 for a pressure per length, and 0 for a force per
        length.
    law : Literal['linear', 'own'] | None
        The pressure of distributed springs in one pass. ``"linear"``, and ``None`` where `penalty` is stated: ε̂ |gap|.
        ``"own"``: the penalty times any function of the gap, the same on every mesh. The harness finds it on one flat
        pair, so that a factor is not seen, and asks nothing that hangs on a stiffness, on the gap at which contact
        begins, or on a number of iterations.
    law_distance : float
        The gap at which the pressure of a law of its own begins, over the length of `activation_unit`. It is 0 where
        contact begins in touch.
    """

    enforcement: Literal["penalty", "multiplier", "barrier"] = "penalty"
    penalty: Literal["nodal", "distributed"] | None = None
    area: Literal["reference", "current"] | None = None
    gap: Literal["closest point", "slave normal", "cells", "cells and nodes"] | None = None
    gap_shapes: Literal["standard", "dual"] | None = None
    pressure_shapes: Literal["standard", "dual"] | None = None
    force_along: Literal["master normal", "slave normal"] | None = None
    activation: float | None = None
    activation_unit: Literal["segment", "length"] = "segment"
    penalty_power: float | None = None
    law: Literal["linear", "own"] | None = None
    law_distance: float = 0.0

    def __post_init__(self) -> None:
        _check_values(self, "rules")
        _check_number(self, "rules", "activation", 0.0, _FARTHEST)
        _check_number(self, "rules", "penalty_power", -_HIGHEST, _HIGHEST)
        if self.law_distance != 0:
            _check_number(self, "rules", "law_distance", 0.0, _FARTHEST, "0, ")

    @property
    def own_law(self) -> bool:
        """Return whether springs have a law of their own, which is not known but for the forces that it gives."""
        return self.law == "own" and self.enforcement == "penalty" and self.penalty == "distributed"


@dataclass(frozen=True, slots=True)
class Abilities:
    """The kinds of states that a formulation takes.

    Attributes
    ----------
    dimensions : tuple[int, ...]
        The numbers of coordinates. A formulation without 2 is asked nothing about plane interfaces, and one without 3
        nothing about interfaces in space.
    faces : tuple[int, ...]
        The numbers of corners of the faces in space that it takes: 3, triangles; 4, quadrilaterals; or both.
    batched : bool
        ``residual`` takes a batch of states, z (..., n_unknowns), in one call. Otherwise the harness loops.
    takes_complex : bool
        ``residual`` takes complex positions, so that the harness may use a complex step.
    takes_longdouble : bool
        ``residual`` takes positions in ``numpy.longdouble`` and computes in that precision.
    motions : Literal['finite', 'small']
        ``"small"``: normals are those of the reference configuration, so that the state is not turned.
    chains : Literal['any', 'open']
        ``"open"``: no chain of segments is closed. Of the states, those with a closed one are left out.
    reach : float | None
        The depth behind a surface down to which contact is looked for, at least 0.125, over the length of the master's
        shortest segment or edge in the reference: a search that measures by the segment in hand, by the mean or by the
        longest looks no less far. States in which the slave lies deeper, as its own normal sees it, are left out.
        ``None`` is any depth.
    """

    dimensions: tuple[int, ...] = (2,)
    faces: tuple[int, ...] = (3,)
    batched: bool = False
    takes_complex: bool = False
    takes_longdouble: bool = False
    motions: Literal["finite", "small"] = "finite"
    chains: Literal["any", "open"] = "any"
    reach: float | None = None

    def __post_init__(self) -> None:
        _check_values(self, "abilities")
        if self.reach is not None and not (isinstance(self.reach, int | float) and _LEAST_REACH <= self.reach < inf):
            needed = f"None or a number of at least {_LEAST_REACH:g}"
            raise ContractError(f"Traits.abilities.reach: found {self.reach!r}; needed {needed}")
        for name, first, second in (("dimensions", 2, 3), ("faces", 3, 4)):
            if (value := getattr(self, name)) not in ((first,), (second,), (first, second)):
                needed = f"({first},), ({second},) or ({first}, {second})"
                raise ContractError(f"Traits.abilities.{name}: found {value!r}; needed {needed}")

    @property
    def in_plane(self) -> bool:
        """Return whether a formulation takes plane interfaces, and is asked about these."""
        return 2 in self.dimensions


@dataclass(frozen=True, slots=True)
class Evidence:
    """The cases that show what a formulation states, and its publication.

    Attributes
    ----------
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
    """

    witnesses: Mapping[str, str] = field(default_factory=dict)
    published_forces: Mapping[str, str] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        needs = {"witnesses": "{property id: name of a case}", "published_forces": "{name of a flat case: forces}"}
        for name, needed in needs.items():
            if not isinstance(value := getattr(self, name), Mapping):
                raise ContractError(f"Traits.evidence.{name}: found a {type(value).__name__}; needed {needed}")
        for text in self.published_forces.values():
            (_parse_once if isinstance(text, str) else parse_forces)(text)


@dataclass(frozen=True, slots=True)
class Traits:
    """The statements of a formulation about itself; the harness checks every one.

    Every trait is optional. ``None`` promises nothing. ``True``, or a word, is a promise that holds for all cases.
    ``False`` says "does not"; it needs a case that shows so, the witness of the property that checks the promise.

    Attributes
    ----------
    promises : Promises
        What the formulation keeps on all cases, or does not.
    rules : Rules
        The rules by which it finds gaps, areas and forces, and the unit of its penalty.
    abilities : Abilities
        The kinds of states that it takes.
    evidence : Evidence
        The cases that show what it states, and its publication.

    Raises
    ------
    ContractError
        If a trait has none of the values listed here, for example a misspelt word, or forces are no fractions.

    Examples
    --------
    Nodal springs with an exact tangent that fail the patch test on case A1 of the reference paper:

    >>> from contactverif import Evidence, PatchPromises, Promises, Rules, Traits
    >>> traits = Traits(
    ...     Promises(patch=PatchPromises(flat=False), tangent="exact", symmetric=True),
    ...     Rules(penalty="nodal"),
    ...     evidence=Evidence(witnesses={"patch": "a1"}),
    ... )
    >>> traits.witness("patch.flat.transmission")
    'a1'
    """

    promises: Promises = field(default_factory=Promises)
    rules: Rules = field(default_factory=Rules)
    abilities: Abilities = field(default_factory=Abilities)
    evidence: Evidence = field(default_factory=Evidence)

    def __post_init__(self) -> None:
        for entry, kind in zip(fields(self), (Promises, Rules, Abilities, Evidence), strict=True):
            actual = type(getattr(self, entry.name))
            if not issubclass(actual, kind):
                raise ContractError(f"Traits.{entry.name}: found a {actual.__name__}; needed {kind.__name__}(…)")

    def witness(self, property_id: str) -> str | None:
        """Return the name of the case that shows that a promise "does not" holds; None if there is none.

        It is the one from `Evidence.witnesses` for the id of the property, or for the longest beginning of it.
        """
        parts = property_id.split(".")
        for n in range(len(parts), 0, -1):
            if (name := self.evidence.witnesses.get(".".join(parts[:n]))) is not None:
                return name
        return None

    def revise(self, **changes: Any) -> Traits:
        """Return these traits with some changed, such as those of a formulation that wraps another one.

        New values stand by the name of the trait, whatever its group: ``traits.revise(symmetric=True, area=None)``.
        """
        if strangers := changes.keys() - _GROUPS.keys():
            raise ContractError(f"Traits: found {', '.join(sorted(strangers))}; needed {', '.join(_GROUPS)}")
        revised: dict[str, Any] = {}
        for name, value in changes.items():
            revised.setdefault(_GROUPS[name], {})[name] = value
        if patch := revised.pop("patch", None):
            revised.setdefault("promises", {})["patch"] = replace(self.promises.patch, **patch)
        return replace(self, **{group: replace(getattr(self, group), **values) for group, values in revised.items()})

    def by_name(self) -> dict[str, Any]:
        """Return ``{name: value}`` of the traits of all groups."""
        return dict(_flatten(self))


def promise_at_ends(traits: Traits, tau: float) -> Traits:
    """Return traits without `opens_at_ends` if feet count more than 0.05 of a segment past an end: no case has more."""
    return traits if tau <= 0.05 else traits.revise(opens_at_ends=None)


Fractions = tuple[Fraction, ...]


def parse_forces(text: str) -> tuple[Fractions, Fractions]:
    """Return the forces on the slave nodes and on the master nodes, from left to right, over penalty × penetration.

    Examples
    --------
    >>> slave, master = parse_forces("1 2 1; 2 2")
    >>> sum(slave) == sum(master)
    True
    """
    try:
        is_endless = _LONG_EXPONENT.search(text) or len(text) > _LONGEST_TEXT
        slave, master = ((), ()) if is_endless else (tuple(map(Fraction, row.split())) for row in text.split(";"))
    except (AttributeError, TypeError, ValueError, ZeroDivisionError):
        slave = master = ()
    if not slave or not master:
        needed = 'fractions on the slave nodes; fractions on the master nodes, such as "1 2 1; 2 2"'
        raise ContractError(f"Traits.evidence.published_forces: found {text!r}; needed {needed}")
    return slave, master


def format_forces(slave: Fractions, master: Fractions) -> str:
    """Return the text from which `parse_forces` reads these forces."""
    return "; ".join(" ".join(map(str, row)) for row in (slave, master))


_parse_once = lru_cache(maxsize=64)(parse_forces)  # Traits are made anew for each penalty.


RULES = frozenset(entry.name for entry in fields(Rules))


def traits_behind(statement: Callable[[Traits], object], traits: Traits) -> dict[str, Any]:
    """Return ``{name: value}`` of the traits without any one of which a statement about them would be another."""
    stated, silent = statement(traits), Traits().by_name()
    return {
        name: value
        for name, value in traits.by_name().items()
        if value != silent[name] and statement(traits.revise(**{name: silent[name]})) != stated
    }


def _flatten(group: Any) -> Iterator[tuple[str, Any]]:
    for entry in fields(group):
        value = getattr(group, entry.name)
        yield from _flatten(value) if is_dataclass(value) else [(entry.name, value)]


def _listed_values(kind: type) -> dict[str, tuple[object, ...]]:
    """Return {name: values} of the traits of a group whose annotations list their values."""
    listed = {}
    for name, annotation in get_type_hints(kind).items():
        parts = (annotation,) if annotation is bool or get_origin(annotation) is Literal else get_args(annotation)
        words = {part: get_args(part) for part in parts if get_origin(part) is Literal}
        values = [value for part in parts for value in _VALUES_OF_TYPES.get(part) or words.get(part, ())]
        if values and float not in parts:
            listed[name] = tuple(values)
    return listed


def _check_values(group: Any, path: str) -> None:
    for name, values in _VALUES[type(group)].items():
        if getattr(group, name) not in values:
            needed = ", ".join(map(repr, values))
            raise ContractError(f"Traits.{path}.{name}: found {getattr(group, name)!r}; needed one of {needed}")


def _check_number(group: Any, path: str, name: str, least: float, largest: float, words: str = "") -> None:
    value = getattr(group, name)
    if value is not None and not (isinstance(value, int | float) and least < value <= largest):
        needed = f"{words}None or a number above {least:g} and up to {largest:g}"
        raise ContractError(f"Traits.{path}.{name}: found {value!r}; needed {needed}")


_VALUES_OF_TYPES: dict[Any, tuple[object, ...]] = {bool: (True, False), type(None): (None,)}
_VALUES = {kind: _listed_values(kind) for kind in (PatchPromises, Promises, Rules, Abilities)}
_PARTS = {"patch": PatchPromises, "promises": Promises, "rules": Rules, "abilities": Abilities, "evidence": Evidence}
_GROUPS = {entry.name: group for group, kind in _PARTS.items() for entry in fields(kind) if entry.name != "patch"}
