"""The rules of Landlock for a plugin's process, in a box or without: what it may write, and whom it may reach.

Rule: a process sets them for itself before it loads a plugin, and nothing takes them back. It may read what the user
may read, and it sees other processes; the rules hold for what it writes, for TCP, and from Linux 6.12 on for signals.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from functools import cache

WRITABLE = "CONTACTVERIF_WRITABLE"  # The environment variable with the paths that may be written.
NETWORK = "network"  # The name by which a user opens the network, and not a file.


@cache
def landlock_version() -> int:
    """Return the version of Landlock's interface here; 0 if there is none, or nothing that calls it."""
    if sys.platform != "linux":
        return 0
    try:
        import landlockpy
    except ImportError:
        return 0
    return int(landlockpy.abi_version())


def keep_to(paths: Sequence[str]) -> None:
    """Let this process write to these paths alone, and to devices that swallow; `NETWORK` lets it use the network.

    Nothing is done where there is no Landlock.
    """
    if not landlock_version():
        return
    from landlockpy import AccessFS, AccessNet, Ruleset, Scope, fs_for_abi, net_for_abi

    writing = fs_for_abi(landlock_version()) & ~(AccessFS.READ_FILE | AccessFS.READ_DIR | AccessFS.EXECUTE)
    of_files = AccessFS.WRITE_FILE | AccessFS.TRUNCATE | AccessFS.IOCTL_DEV
    net, scope = net_for_abi(landlock_version()), Scope.ABSTRACT_UNIX_SOCKET | Scope.SIGNAL
    if NETWORK in paths:
        net, scope = AccessNet.NONE, Scope.SIGNAL
    with Ruleset(handled_fs=writing, handled_net=net, scoped=scope) as rules:
        for path in (os.devnull, *paths):
            if os.path.exists(path):
                rules.allow_path(path, writing if os.path.isdir(path) else of_files)
        rules.restrict()
