"""The first act of a process that may hold a plugin: it binds itself to its parent, and takes on its limits.

Rule for the next editor: the standard library alone, since engines have interpreters of their own.
"""

from __future__ import annotations

import faulthandler
import os

from contactverif.isolation.box import PROCESSES
from contactverif.isolation.child import limit_memory, limit_processes
from contactverif.isolation.landlock import WRITABLE, keep_to
from contactverif.isolation.parent_death import die_with_parent

MEMORY = "CONTACTVERIF_MEMORY"  # The megabytes that the process may take.


def confine() -> None:
    """Confine this process as its environment says."""
    die_with_parent()
    faulthandler.enable()
    limit_memory(int(os.environ[MEMORY]))
    if PROCESSES in os.environ:
        limit_processes(int(os.environ[PROCESSES]))
    if WRITABLE in os.environ:
        keep_to(os.environ[WRITABLE].split(os.pathsep))
