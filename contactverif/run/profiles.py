"""The size of a run: profiles with the number of cases and the seed, and which failures are shrunk.

`dev` draws new cases in every run, `ci` the same cases every time, `nightly` twenty times as many.
"""

import secrets
from dataclasses import dataclass, replace
from typing import Literal, Self

from contactverif.contract.errors import MisuseError, unknown_name_error

MOST_EXAMPLES = 10**9
FIRST_CASES = 5  # The number of cases of a property in the first round.
# The failures that are shrunk: those that nobody stated, all, or none. The others show a witness or the first case.
Shrink = Literal["one", "new", "all", "none"]


@dataclass(frozen=True, slots=True)
class Profile:
    """The size of a run under a name on the command line."""

    name: str
    examples: int  # The number of planned cases of each property.
    seed: int | None  # The seed of all cases; None means a fresh seed in every run.

    def resolve(self, *, examples: int | None = None, seed: int | None = None, fresh: int | None = None) -> Self:
        """Return the profile with the numbers of the user, and the seed of either, else the fresh one, or a new one."""
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
    """Return the profile of that name."""
    if name not in PROFILES:
        raise unknown_name_error("profile", name, PROFILES)
    return PROFILES[name]
