"""The linear theory of heave in a tank, against what is known of a sea and of a cylinder at high frequency."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.bodies.released import turning_points
from tests.validation.heave_theory import MASS, LinearTank, heave_decay
from tests.validation.scenes import read_table


def test_added_mass_at_high_frequency() -> None:
    # half a cylinder under phi = 0 has that of half a cylinder in unbounded water, its displaced mass; a floor 20 R below adds (R / 20)^2
    assert LinearTank(40.0, 20.0).added_mass == pytest.approx(MASS, rel=0.005)


def test_pressure_at_rest_is_what_the_surface_makes_of_it() -> None:
    # phi = 1 on the surface is phi = 1 everywhere: nothing flows, and the cylinder's waterline area takes the impulse
    tank = LinearTank(8.0, 4.0)
    assert np.abs(tank.outflow.sum(axis=1)).max() < 1e-9
    assert tank.impulse.sum() == pytest.approx(2.0, rel=1e-9)


def test_heave_in_a_wide_and_deep_tank_is_that_in_a_sea() -> None:
    # the table is Ursell's; walls and floor count for 0.007 of the first height at 80 and 40 R
    time, height = heave_decay(60.0, 30.0, 11.0)
    table_time, table_height = read_table("heave_decay_half_cylinder_linear.csv")
    within = table_time < 11.0
    assert np.abs(np.interp(table_time[within], time, height) - table_height[within]).max() < 0.012
    (_, first), (_, second) = turning_points(time, height)[:2]
    assert first == pytest.approx(-0.641, rel=0.01)
    assert second == pytest.approx(0.305, rel=0.025)
