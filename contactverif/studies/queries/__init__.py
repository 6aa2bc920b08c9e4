"""Files of projection queries with exact answers, and the scores of programs that answer them.

The files are read for years: a change of a format raises its number, and changes `docs/how-to/score-your-search.md`.
"""
