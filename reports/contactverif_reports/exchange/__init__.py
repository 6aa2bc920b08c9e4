"""A run for other programs: JSON for scripts, JUnit for servers that run tests."""
