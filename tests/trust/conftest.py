"""The campaigns of `evidence/trust`, whose tables these tests read, are modules here."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path += [str(ROOT / "evidence" / "trust"), str(ROOT / "tests" / "plugins")]
