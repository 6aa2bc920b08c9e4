"""The data that flows through the harness: interfaces, formulations, bodies, cases, properties, results.

This folder imports nothing else of the house. What flows is a frozen dataclass with
read-only arrays. It is checked once, in its constructor, so that nobody who receives one has to check it again.
"""
