"""The tests that an author of a formulation writes: every property becomes a pytest test of its own.

    from contactverif.testing import parametrize_with_properties

    @parametrize_with_properties("mine", known={"patch.flat.transmission": "issue 12"})
    def test_mine(check):
        check()

Several decorators on one test add up. Nothing that takes long is imported here: every run of pytest loads this file.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import pytest

from contactverif.contract.errors import MisuseError

__all__ = ["parametrize_with_properties"]
MARK = "contactverif_properties"  # The mark that carries the arguments of the decorator to the pytest plugin.
_Test = TypeVar("_Test", bound=Callable[..., Any])


def parametrize_with_properties(
    *formulations: str | Callable[..., Any],
    properties: Sequence[str] = ("*",),
    examples: int | None = None,
    seed: int | None = None,
    profile: str | None = None,
    known: Mapping[str, str] | None = None,
) -> Callable[[_Test], _Test]:
    """Run the decorated test once for each formulation and property.

    The test takes an argument `check` and calls it. A check passes if a promise is kept, or if the formulation fails
    as it states. It is skipped if the property does not apply or the plugin does not provide what it needs. It is an
    expected failure (xfail) if the failure is known or the formulation promises nothing. Everything else fails, with a
    drawing of the smallest mesh that shows it.

    Parameters
    ----------
    *formulations : str | Callable[..., Any]
        Names as on the command line, or factories `make(*, penalty)`.
    properties : Sequence[str]
        Patterns of property ids.
    examples : int | None
        The number of planned cases of each property.
    seed : int | None
        The seed of the cases.
    profile : str | None
        The name of a profile, `dev` by default. The options `--contactverif-examples`, `--contactverif-seed` and
        `--contactverif-profile` of pytest overrule these three.
    known : Mapping[str, str] | None
        {property id: why its failure is known}. An id that is not checked is an error, and so is one that passes.

    Raises
    ------
    MisuseError
        If there is no formulation, or `properties` is a single string.
    """
    if not formulations or not all(isinstance(item, str) or callable(item) for item in formulations):
        raise MisuseError("formulations", repr(formulations), "names or factories, at least one")
    if isinstance(properties, str):
        raise MisuseError("properties", repr(properties), f"a sequence of patterns, ({properties!r},)")
    mark: Callable[[_Test], _Test] = getattr(pytest.mark, MARK)(
        formulations=formulations,
        properties=tuple(properties),
        examples=examples,
        seed=seed,
        profile=profile,
        known=known or {},
    )
    return mark
