"""The exact rate of small swings of a viscous drop in a viscous fluid, against the formulas that it contains."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import iv, kv

from oilsim import Phase
from tests.validation.liquids.tension.drops import Drop

WATER = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1e-2)
OIL = replace(WATER, name="oil", interfacial_tension=0.07)
RADIUS = 0.01


@pytest.mark.parametrize("mode", [2, 3])
def test_liquids_of_one_density_and_viscosity_have_the_closed_form(mode):
    # vorticity I_n(q r) inside and K_n(q r) outside, whose slope jumps by what the tension pulls along the interface
    s = Drop(OIL, WATER, RADIUS).swinging(mode)
    x = RADIUS * np.sqrt(s * 1000.0 / 1e-2)
    products = iv(mode + 1, x) * kv(mode, x) + iv(mode, x) * kv(mode - 1, x)
    assert s == pytest.approx(-mode * (mode**2 - 1) * 0.07 / (2.0 * 1e-2 * x * RADIUS) * products, rel=1e-9)


@pytest.mark.parametrize("mode", [2, 3])
def test_thin_drop_in_nearly_nothing_swings_and_decays_as_lamb_says(mode):
    thin, nothing = (
        replace(OIL, dynamic_viscosity=1e-4),
        Phase(name="air", rest_density=1e-4, dynamic_viscosity=1e-10),
    )
    s = Drop(thin, nothing, RADIUS).swinging(mode)
    assert s.imag == pytest.approx(math.sqrt(mode * (mode**2 - 1) * 0.07 / (1000.0 * RADIUS**3)), rel=1e-3)
    assert -s.real == pytest.approx(2.0 * mode * (mode - 1) * 1e-7 / RADIUS**2, rel=0.02)


def test_which_of_the_two_has_the_tension_makes_no_difference():
    other = Drop(replace(OIL, interfacial_tension=0.0), replace(WATER, interfacial_tension=0.07), RADIUS)
    assert other.swinging(2) == pytest.approx(Drop(OIL, WATER, RADIUS).swinging(2))
