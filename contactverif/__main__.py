"""Run the command line as `python -m contactverif`."""

from contactverif.cli import main

main()
