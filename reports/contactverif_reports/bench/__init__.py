"""Speed against error: the numbers of a bench, and what can be read from them. No file, no picture."""
