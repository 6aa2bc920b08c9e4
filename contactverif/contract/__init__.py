"""What flows through the harness: interfaces, formulations, bodies, cases, properties, results.

This folder imports nothing else of the house.
"""
