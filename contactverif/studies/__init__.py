"""Long jobs made of the parts: comparisons, and scenes that are solved to be drawn."""
