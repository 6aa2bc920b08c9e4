"""Engines: whole contact codes that solve scenes. Each is a file, and imports its code inside `solve`."""
