"""The numbers of cases that strangers are asked, for the campaign and for the page about it."""

SEEDS, EXAMPLES = (1, 2, 3), 300
UNSTATED = 10  # The part of the cases of a property that solves bodies, if nothing is stated of it.
