"""The size of a run: profiles with the number of cases and the seed, and which failures are shrunk.

`dev` draws new cases in every run, `ci` the same cases every time, `nightly` twenty times as many.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass, replace
from typing import Literal

from contactverif.contract.errors import MisuseError
from contactverif.contract.names import unknown_name_error

MOST_EXAMPLES = 10**9
# The failures that are shrunk: those that nobody stated, all, or none. The others show a witness or the first case.
Shrink = Literal["new", "all", "none"]


@dataclass(frozen=True, slots=True)
class Profile:
    """The size of a run.

    Attributes
    ----------
    name : str
        The name on the command line.
    examples : int
        The number of planned cases of each property.
    seed : int | None
        The seed of all cases; None means a fresh seed in every run.
    """

    name: str
    examples: int
    seed: int | None

    @property
    def derandomised(self) -> bool:
        """Return whether every run draws the same cases."""
        return self.seed is not None

    def resolve(self, *, examples: int | None = None, seed: int | None = None, fresh: int | None = None) -> Profile:
        """Return the profile with the numbers of the user and with a seed, which can be printed and used again.

        Parameters
        ----------
        examples, seed : int | None
            The numbers of the user; None keeps those of the profile.
        fresh : int | None
            The seed if neither the user nor the profile names one; None draws a new one.

        Returns
        -------
        Profile
            A profile whose seed is a number.

        Raises
        ------
        MisuseError
            If there is less than one example or more than a billion, or the seed is not from 0 to 2^63 − 1.
        """
        examples = self.examples if examples is None else examples
        seed = self.seed if seed is None else seed
        if not 1 <= examples <= MOST_EXAMPLES:
            raise MisuseError("examples", str(examples), f"at least 1, at most {MOST_EXAMPLES}")
        if seed is not None and not 0 <= seed < 2**63:
            raise MisuseError("seed", str(seed), "a whole number ≥ 0 and < 2^63")
        if seed is None:
            seed = secrets.randbelow(10**9) if fresh is None else fresh
        return replace(self, examples=examples, seed=seed)


PROFILES = {
    profile.name: profile
    for profile in (Profile("dev", 100, None), Profile("ci", 100, 0), Profile("nightly", 2000, None))
}


def profile_named(name: str) -> Profile:
    """Return the profile of that name.

    Raises
    ------
    MisuseError
        If there is none; the error suggests the nearest name.
    """
    if name not in PROFILES:
        raise unknown_name_error("profile", name, PROFILES)
    return PROFILES[name]
