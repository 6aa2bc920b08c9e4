"""Exact answers to judge by: consistent nodal forces, projections, and the distance of a state to a kink.

Rule for the next editor: the judge shares no code with the judged. No plugin uses anything here, and nothing here uses
the compiled geometry of plugins. Where it is affordable, the arithmetic is rational and thus exact.
"""
