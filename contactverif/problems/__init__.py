"""Scenes and interface states that have a name or an exact solution: two blocks, a disk on its foundation, Hertz.

Rule for the next editor: a fact that is stored with a scene is exact for every formulation, and a number that the paper
does not print is called an assumption.
"""
