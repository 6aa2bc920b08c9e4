"""How much a run asks: `dev` while one works, `ci` the same every time, `nightly` twenty times as much."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, replace

from contactverif.contract.errors import MisuseError
from contactverif.contract.names import unknown_name_error


@dataclass(frozen=True, slots=True)
class Profile:
    """How much is asked.

    Attributes
    ----------
    name : str
        On the command line.
    examples : int
        Planned cases of a property.
    seed : int | None
        Of all cases; None is a fresh one each run.
    """

    name: str
    examples: int
    seed: int | None

    @property
    def derandomised(self) -> bool:
        """Whether every run asks the same."""
        return self.seed is not None

    def resolve(self, *, examples: int | None = None, seed: int | None = None, fresh: int | None = None) -> Profile:
        """The profile with the caller's own numbers and a seed, which can be printed and given again.

        Where neither the caller nor the profile names a seed, it is `fresh`, or a new one.

        Raises
        ------
        MisuseError
            If there is less than one example, or the seed is negative.
        """
        examples = self.examples if examples is None else examples
        seed = self.seed if seed is None else seed
        if examples < 1:
            raise MisuseError("examples", str(examples), "at least 1")
        if seed is not None and seed < 0:
            raise MisuseError("seed", str(seed), "a whole number ≥ 0")
        if seed is None:
            seed = secrets.randbelow(10**9) if fresh is None else fresh
        return replace(self, examples=examples, seed=seed)


PROFILES = {
    profile.name: profile
    for profile in (Profile("dev", 100, None), Profile("ci", 100, 0), Profile("nightly", 2000, None))
}


def profile_named(name: str) -> Profile:
    """One of `PROFILES`; a `MisuseError` that suggests the nearest if there is none."""
    if name not in PROFILES:
        raise unknown_name_error("profile", name, PROFILES)
    return PROFILES[name]
