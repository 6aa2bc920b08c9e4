"""A file of projection queries with exact answers, and the scores of programs that answer them.

`query_kinds` draws the situations, `query_making` finds the exact answers, `query_file` and `answer_file` know the
formats, `query_scores` compares. Rule for the next editor: the files are read long after this program is forgotten. A
change of a format raises its number and its page, `docs/how-to/score-your-search.md`.
"""
