"""Run the command line as `python -m contactverif`."""

from contactverif.cli.app import main

main()
