"""Units have the values of `scipy.constants`."""

import pytest
from scipy import constants

from oilsim.core import physical_constants


@pytest.mark.parametrize("name", ["hour", "degree", "nautical_mile", "knot", "pound_force"])
def test_units_are_those_of_scipy(name):
    assert getattr(physical_constants, name.upper()) == getattr(constants, name)


def test_standard_gravity_is_that_of_scipy():
    assert constants.g == physical_constants.STANDARD_GRAVITY
