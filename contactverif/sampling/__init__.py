"""Draw the planned cases of a run, the same for every formulation, and shrink those that fail."""
