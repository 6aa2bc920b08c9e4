"""A plugin that makes every import that follows end the process with status 0."""

import os
import sys
from typing import Any

from hostile_kit import HostileNts


class _Finder:
    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        os._exit(0)


sys.meta_path.insert(0, _Finder())  # type: ignore[arg-type]


def make(*, penalty: float) -> Any:
    return HostileNts(penalty, {})
