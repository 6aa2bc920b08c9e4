"""A module whose import loads all installed properties: the server of worker processes imports it once for all."""

import gc

from contactverif.plugins.registry import load_properties

load_properties(engines=True)  # One that does not load is `NotLoaded` in each worker, too.
gc.freeze()  # No worker's collection walks over what all of them share.
