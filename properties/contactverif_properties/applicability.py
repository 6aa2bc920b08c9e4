"""Questions that the traits of a formulation decide alone: its promise, and why another question makes no sense for it.

A reason is printed in the table; it is an empty string where the question can be asked.
"""

from contactverif.contract.traits import Traits

# Why a law of its own is not asked: the reasons of `Property.linear`.
LINEAR_FORCES = "the exact answer is that of springs in proportion to the gap, and the law is the formulation's own"
LINEAR_BEGINNING = "the law is the formulation's own, and says what springs do in touch"
LINEAR_STEPS = "the law is the formulation's own, and says how many iterations it takes"
LINEAR_SIZE = "the law is the formulation's own: a factor of its forces is not seen by any question"


def refuse_dependent_multipliers(traits: Traits) -> str:
    """Return why no scene is solved, or an empty string if a solution can be expected.

    Constraints that depend on one another contradict each other on bent surfaces, so Newton's method has nothing to
    converge to.
    """
    dependent = traits.promises.independent_multipliers is False
    return "the multipliers are not independent, so there need be no solution, nor one alone" if dependent else ""


def promise_exact_tangent(traits: Traits) -> bool | None:
    """Return whether the traits promise a tangent that is exact, or as exact as differences; None if neither."""
    return None if traits.promises.tangent is None else traits.promises.tangent != "approximate"


def tangent_error(traits: Traits) -> float:
    """Return the relative error of the tangent that the traits state for small coordinates, 0 where they state none."""
    return traits.promises.tangent if isinstance(traits.promises.tangent, int | float) else 0.0


def refuse_unstated(traits: Traits, *names: str, group: str = "rules") -> str:
    """Return which traits of a group have to be stated, in words that a screen collects, or an empty string."""
    missing = ", ".join(f"{group}.{name}" for name in names if getattr(getattr(traits, group), name) is None)
    return f"state {missing} to be asked" if missing else ""


def law_is_linear(traits: Traits) -> bool | None:
    """Return True where the traits say that springs are linear, None where they say nothing: a law may be another."""
    rules = traits.rules
    return True if rules.law == "linear" or rules.penalty is not None or rules.enforcement != "penalty" else None


def refuse_unknown_pressure(traits: Traits) -> str:
    """Return why springs or multipliers have no pressure that is known, or an empty string."""
    return refuse_dependent_multipliers(traits) or refuse_unstated(traits, "penalty")


def knows_total(traits: Traits) -> bool:
    """Return whether the traits say what the total force of a uniform penetration is."""
    return traits.rules.penalty == "distributed" and traits.rules.area is not None


def may_act_twice(traits: Traits) -> bool:
    """Return whether the traits leave room for springs on both surfaces.

    They do not where areas add up to the slave's length, or where nodal springs stand on the slave alone.
    """
    return bool(traits.promises.unbiased) if traits.rules.penalty == "nodal" else not knows_total(traits)


def refuse_unknown_total(traits: Traits) -> str:
    """Return why the total force is unknown from the traits, or an empty string if they say enough."""
    if traits.rules.penalty == "nodal":
        return "there are no distributed springs"
    return refuse_unstated(traits, "penalty", "area")


def promise_single(traits: Traits) -> bool | None:
    """Return the promise for meshes with master nodes on slave nodes and in the middle of slave segments."""
    return True if traits.promises.patch.flat else traits.promises.patch.single


def promise_normal(traits: Traits) -> bool | None:
    """Return the promise for meshes with master nodes on slave nodes."""
    return True if promise_single(traits) else traits.promises.patch.normal
