"""Formulations for tests: right ones (`right`), `springs` with mistakes, and mutants of the included ones."""
