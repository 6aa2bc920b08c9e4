"""Commands that start Python anew, on the installed packages."""

import sys

# -P: the tests start in the working copy, whose packages would otherwise be imported instead of the installed ones.
PYTHON = (sys.executable, "-P")
MAIN = (*PYTHON, "-c", "from contactverif.cli import main; main()")
