"""A punch that is pressed into a base: the scene of the page about scenes of your own."""

from contactverif import Rectangle, Scene, two_blocks


def scene() -> Scene:
    """Return the scene; the punch is the slave."""
    punch = Rectangle([0, 0.9, 2.1, 3], [0, 1, 2], young=1000.0, poisson=0.3)
    base = Rectangle([-2, -0.7, 0.4, 1.6, 3.3, 5], [-2, -1, 0], young=5000.0, poisson=0.2)
    return two_blocks(punch, base, penalty=1e4, approach=0.05, tilt=0.02)
