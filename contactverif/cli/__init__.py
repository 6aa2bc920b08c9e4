"""The command line: one file a command, and the tables that a terminal shows. Nothing else in the house imports it."""

import sys


def main() -> None:
    """Run the command `contactverif`; Ctrl-C is one line, also while the modules of the command line are imported."""
    try:
        from contactverif.cli import app

        app.main()
    except KeyboardInterrupt:
        sys.stderr.write("contactverif: stopped\n")
        sys.exit(130)
