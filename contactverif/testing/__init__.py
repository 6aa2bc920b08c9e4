"""The tests that an author of a formulation writes: every property as a pytest test of its own.

The decorator is imported at its first use, because every run of pytest loads the plugin of this package.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contactverif.testing.parametrize import parametrize_with_properties

__all__ = ["parametrize_with_properties"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from contactverif.testing import parametrize

    return getattr(parametrize, name)
