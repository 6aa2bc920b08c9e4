"""The properties that every contact formulation is checked for, a file for each family.

The judge shares no code with the judged, so nothing here imports a plugin or `contactverif.geometry`. The docstring of
a property says what is asked, why it matters to an engineer, how it is judged, and when a case is undecided: the
reference pages of the site are made of it. `states`, `roundoff`, `kinks`, `applicability` and `exact_forces` hold what
several families need, and import no property. `docs/concepts/tolerances.md` explains what the formulas have in common.
"""
