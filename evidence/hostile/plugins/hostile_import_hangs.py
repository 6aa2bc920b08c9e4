"""A plugin that sleeps when it is imported."""

import time

from hostile_kit import LONG

time.sleep(LONG)
