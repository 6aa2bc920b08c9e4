"""Scenes that have a name or an exact solution: two blocks, a disk on its foundation, Hertz; interface states too."""
