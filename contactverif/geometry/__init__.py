"""Compiled geometry that plugins may use. The judge never imports it: it shares no code with what it judges."""
