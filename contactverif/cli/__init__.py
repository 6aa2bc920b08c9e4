"""The command line: one file a command, and what they show in a terminal. Nothing of the house imports it."""

from contactverif.cli.app import main

__all__ = ["main"]
