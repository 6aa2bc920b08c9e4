"""Long jobs made of the parts: comparisons, the reference paper."""
