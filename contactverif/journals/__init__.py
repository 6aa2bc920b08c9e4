"""Keep every outcome of a run as it comes, and believe of what was kept only what is checked."""
