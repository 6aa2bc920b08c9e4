"""The questions that every contact formulation is asked, one file a question; `shared` holds what they have in common.

Rules for the next editor: the judge shares no code with the judged, so nothing here imports a plugin or
`contactverif.geometry`. A file holds one property, and its first lines say what is asked, why it matters to an
engineer, how it is judged, and when a case is undecided. The reference pages of the site are made of these lines.
`docs/concepts/tolerances.md` explains what the formulas have in common.
"""
