"""Numbers of several formulations, or of two reports, side by side."""
