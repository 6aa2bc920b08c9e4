"""Formulations that are derived from one function by automatic differentiation; the one place that knows JAX."""
