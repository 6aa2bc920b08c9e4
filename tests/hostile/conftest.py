"""The campaigns of `evidence/hostile`, of which these tests run a sample, are modules here."""

import sys
from pathlib import Path

sys.path += [str(Path(__file__).parents[2] / folder) for folder in ("evidence/hostile", "evidence/trust")]
