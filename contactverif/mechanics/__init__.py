"""Elastic bodies, their condensation onto the interface, scenes, and Newton's method."""
