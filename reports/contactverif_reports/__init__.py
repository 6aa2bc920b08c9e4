"""Reports of a run: what is in the file (`schema`), `write`, `read`, and pictures of a case (`draw`)."""
