"""What the tutorial's author writes into the tests of the project."""

from contactverif.testing import parametrize_with_properties


@parametrize_with_properties("mine", "mine-exact")
def test_mine(check):
    check()
