"""Every property of the two formulations is a test of its own."""

from contactverif.testing import parametrize_with_properties


@parametrize_with_properties("mine", "mine-exact")
def test_mine(check):
    check()
