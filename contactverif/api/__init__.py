"""The harness for scripts and notebooks, and what they share with the command line."""
