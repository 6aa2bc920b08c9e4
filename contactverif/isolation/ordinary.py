"""The check that a name is that of an ordinary file: no folder, no pipe, no device, and none that may not be read."""

from __future__ import annotations

import os
import stat

from contactverif.contract.errors import MisuseError

_KINDS = {
    stat.S_IFDIR: "which is a folder",
    stat.S_IFIFO: "which is a pipe",
    stat.S_IFSOCK: "which is a socket",
    stat.S_IFCHR: "which is a device",
    stat.S_IFBLK: "which is a device",
}


def check_ordinary(path: str | os.PathLike[str], argument: str, needed: str) -> os.stat_result:
    """Check that there is an ordinary file that may be read."""
    name = os.fspath(path)
    try:
        status = os.stat(path)
        kind = _KINDS.get(stat.S_IFMT(status.st_mode), "")
        if not kind:
            with open(path, "rb"):
                return status
    except FileNotFoundError:
        kind = "which does not exist"
    except OSError as error:
        kind = f"which cannot be read ({error.strerror})"
    except ValueError as error:  # A name with NUL.
        kind = f"which is no name of a file ({error})"
    raise MisuseError(argument, f"{name}, {kind}", needed)
