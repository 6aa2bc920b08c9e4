"""The groups of a netCDF file as plain arrays: what is written to a file, and what the reader sees instead of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from numpy.typing import NDArray


@dataclass(frozen=True)
class Variable:
    """A variable of a group."""

    dims: tuple[str, ...]  # The names of its dimensions.
    values: NDArray[Any]  # Its entries: numbers or words, as bytes where they are to be written.
    attrs: dict[str, Any]  # Its attributes: words, or arrays of numbers.


@dataclass(frozen=True)
class Group(Mapping[str, Variable]):
    """A group: a mapping from names to variables."""

    variables: Mapping[str, Variable] = field(default_factory=dict)  # Its variables by name.
    attrs: Mapping[str, Any] = field(default_factory=dict)  # Its attributes: words, or arrays of numbers.

    def __getitem__(self, name: str) -> Variable:
        return self.variables[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.variables)

    def __len__(self) -> int:
        return len(self.variables)

    def words(self, name: str) -> list[str]:
        """Return the entries of a variable as words; none if there is no such variable."""
        return [str(word) for word in self[name].values] if name in self else []

    def labels(self, name: str) -> list[str]:
        """Return the names along a dimension, which are all different."""
        labels = self.words(name)
        if len(set(labels)) != len(labels):
            raise ValueError(f"two of {name} have one name")
        return labels

    @cached_property
    def sizes(self) -> Mapping[str, int]:
        """The lengths of all dimensions of its variables."""
        sizes: dict[str, int] = {}
        for name, variable in self.variables.items():
            for dim, length in zip(variable.dims, variable.values.shape, strict=True):
                if sizes.setdefault(dim, length) != length:
                    raise ValueError(f"{name} is {length} long along {dim}, others {sizes[dim]}")
        return sizes
