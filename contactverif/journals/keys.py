"""The keys of journals. A record that bears a digest under the key of its journal was written by a run of this user.

A key lies in the user's state folder, which no plugin in a box can read, and goes when its journal goes.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from secrets import token_bytes

_BYTES = 32


def state_folder() -> Path:
    """Return the folder of what contactverif keeps for its user from run to run."""
    name, default = "XDG_STATE_HOME", ".local/state"
    if os.name == "nt":
        name, default = "LOCALAPPDATA", "AppData/Local"
    elif sys.platform == "darwin":
        name, default = "", "Library/Application Support"
    folder = Path(os.environ.get(name, ""))
    return (folder if folder.is_absolute() else Path.home() / default) / "contactverif"


def make_key(identity: str) -> None:
    """Make the key of a journal. Where the folder cannot be written there is none, and the journal proves nothing."""
    with suppress(OSError, RuntimeError):  # The latter where no home is known.
        path = _path(identity)
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        path.parent.chmod(0o700)
        with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(token_bytes(_BYTES))


def read_key(identity: str) -> bytes:
    """Return the key of a journal; empty if it is not here."""
    with suppress(OSError, RuntimeError):
        key = _path(identity).read_bytes()
        return key if len(key) == _BYTES else b""
    return b""


def remove_key(identity: str) -> None:
    """Remove the key of a journal, if there is one."""
    with suppress(OSError, RuntimeError):
        if identity:
            _path(identity).unlink(missing_ok=True)


def _path(identity: str) -> Path:
    return state_folder() / "keys" / identity
