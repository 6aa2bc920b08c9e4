"""Compiled geometry that plugins may use. The properties never import it: the judge shares no code with the judged."""
