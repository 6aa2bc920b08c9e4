"""The command line: one file a command, and the tables that a terminal shows. Nothing else in the house imports it."""

import sys

from contactverif.cli.signals import watch_signals


def main() -> None:
    """Run the command `contactverif`; Ctrl-C or SIGTERM is one line, also while modules are imported."""
    watch_signals()
    try:
        from contactverif.cli import app

        app.main()
    except KeyboardInterrupt:
        sys.stderr.write("contactverif: stopped\n")
        sys.exit(130)
