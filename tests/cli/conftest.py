"""The fixture by which tests run `contactverif` in their own process."""

from asking import ask

__all__ = ["ask"]
