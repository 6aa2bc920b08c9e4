"""The command line: one file a command, and the tables that a terminal shows. Nothing else in the house imports it."""

from contactverif.cli.app import main

__all__ = ["main"]
