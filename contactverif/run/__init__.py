"""Finds plugins, draws cases, judges them, and shrinks what failed."""
