"""Error against condition number: the numbers of the stability sweeps, in a table, a page and sentences."""
