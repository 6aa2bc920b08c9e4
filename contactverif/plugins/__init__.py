"""Find the installed formulations and properties, load them, and say which code they are."""
