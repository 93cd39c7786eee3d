"""The closures against closed forms, balances of forces integrated step by step, and figures computed by hand."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from booms.losses import closure_losses, liquids, rates
from booms.losses.liquids import OilOnWater, mixed
from oilsim.core.physical_constants import GRAVITY

WATER = 1027.0


def oil(density=900.0, tension=0.025, viscosity=1e-5):
    return OilOnWater(
        oil_density=density, water_density=WATER, kinematic_viscosity=viscosity, interfacial_tension=tension
    )


def test_liquids_refuse_what_cannot_float_or_has_no_such_tension():
    with pytest.raises(ValueError, match="oil_density is 1030"):
        oil(1030.0)
    with pytest.raises(ValueError, match=r"interfacial_tension is 5\.0, allowed: 0.001 or more and at most 0.1"):
        oil(tension=5.0)
    assert oil().density_difference == pytest.approx(127.0 / 1027.0)


def test_a_mixture_lies_between_its_oils():
    both = mixed([oil(840.0, 0.02, 1e-6), oil(940.0, 0.03, 1e-4)], [3.0, 1.0])
    assert both.oil_density == pytest.approx(865.0)
    assert both.interfacial_tension == pytest.approx(0.0225)
    assert both.kinematic_viscosity == pytest.approx(10.0**-5.5)
    with pytest.raises(ValueError, match="volumes are all 0"):
        mixed([oil()], [0.0])


def test_front_stands_as_high_as_the_stopped_water():
    """The surface of oil at rest is Delta h above the water, and water that stops rises by U^2 / (2 g)."""
    front = float(liquids.front_thickness(0.36, oil()))
    assert oil().density_difference * front == pytest.approx(0.36**2 / (2.0 * GRAVITY))


@pytest.mark.parametrize("held", [0.2, 1.0])
def test_profile_is_that_of_the_balance_of_forces(held):
    """Integrates d(0.5 rho_o g' h^2) / dx = 0.5 rho_w C_f U^2 from the front on until the oil is used up."""
    one, speed, friction = oil(), 0.36, 0.005

    def slope(_, state):
        stress = 0.5 * WATER * friction * speed**2
        return [stress / (one.oil_density * one.reduced_gravity * state[0]), state[0]]

    def used_up(_, state):
        return state[1] - held

    used_up.terminal = True
    found = solve_ivp(
        slope, (0.0, 100.0), [float(liquids.front_thickness(speed, one)), 0.0], events=used_up, rtol=1e-10
    )
    assert float(liquids.boom_thickness(speed, held, one)) == pytest.approx(found.y[0, -1], rel=1e-5)
    assert float(liquids.slick_length(speed, held, one)) == pytest.approx(found.t[-1], rel=1e-5)


@pytest.mark.parametrize(
    ("density", "speed", "front", "held", "thickness", "length"),
    [
        (900.0, 0.30, 0.037, 0.2, 0.056, 4.2),
        (900.0, 0.30, 0.037, 1.0, 0.088, 15.1),
        (900.0, 0.36, 0.053, 0.2, 0.069, 3.2),
        (900.0, 0.50, 0.103, 1.0, 0.142, 8.1),
        (840.0, 0.36, 0.036, 1.0, 0.089, 15.0),
        (950.0, 0.36, 0.088, 0.2, 0.099, 2.1),
    ],
)
def test_slicks_that_were_computed_by_hand(density, speed, front, held, thickness, length):
    one = oil(density)
    assert float(liquids.front_thickness(speed, one)) == pytest.approx(front, abs=6e-4)
    assert float(liquids.boom_thickness(speed, held, one)) == pytest.approx(thickness, abs=6e-4)
    assert float(liquids.slick_length(speed, held, one)) == pytest.approx(length, abs=0.06)


@pytest.mark.parametrize(
    ("density", "draft", "speed", "most"),
    [
        (840.0, 0.2, 0.36, 6.5),
        (900.0, 0.2, 0.36, 3.3),
        (900.0, 0.2, 0.45, 0.70),
        (950.0, 0.2, 0.30, 2.5),
        (900.0, 0.6, 0.36, 178.0),
    ],
)
def test_oil_that_a_skirt_can_hold_against_drainage(density, draft, speed, most):
    """V' = (h_c^3 - h_f^3) / (1.5 K): as much as is h_c thick at the boom."""
    one = oil(density)
    limit, front = rates.held_thickness(speed, draft, one), liquids.front_thickness(speed, one)
    assert float((limit**3 - front**3) / (1.5 * liquids.thickening(speed, one))) == pytest.approx(most, rel=0.02)


def test_suction_takes_the_front_where_the_interface_reaches_the_foot():
    """k^2 U^2 / (2 g') = d: and there the skirt holds less than the front."""
    for draft in (0.2, 0.6):
        for factor in (math.sqrt(2.0), 1.86):
            speed = float(rates.suction_limit(draft, oil(), factor))
            front = float(liquids.front_thickness(speed, oil()))
            assert factor**2 * front == pytest.approx(draft)
            assert float(rates.held_thickness(speed, draft, oil(), factor)) == pytest.approx(front)
    assert float(rates.suction_limit(0.2, oil(840.0))) == pytest.approx(0.60, abs=0.005)
    assert float(rates.suction_limit(0.6, oil(950.0), 1.86)) == pytest.approx(0.51, abs=0.005)


def test_drainage_begins_at_the_held_thickness_and_grows():
    rate = rates.drainage_rate(0.1, np.array([0.1, 0.12, 0.2]), 0.12, 0.4, oil())
    assert list(rate[:2]) == [0.0, 0.0]
    assert rate[2] == pytest.approx(0.6 * 0.08 * math.sqrt(oil().reduced_gravity * 0.2))


def test_oil_that_reaches_below_the_foot_drains_with_the_water():
    """No deeper a layer than the skirt, at the speed of the water where that is faster than a gravity current."""
    assert float(rates.drainage_rate(0.9, 5.0, 0.0, 0.4, oil(1020.0))) == pytest.approx(0.6 * 0.4 * 0.9)


@pytest.mark.parametrize(
    ("density", "tension", "onset"),
    [(840.0, 0.020, 0.38), (875.0, 0.020, 0.36), (900.0, 0.025, 0.36), (950.0, 0.020, 0.30), (980.0, 0.020, 0.26)],
)
def test_onset_of_entrainment(density, tension, onset):
    assert rates.onset_speed(oil(density, tension)) == pytest.approx(onset, abs=0.006)


def test_waves_that_grow_first_have_no_growth_at_onset():
    """At U_KH, the growth rate of the wave by Kelvin and Helmholtz, with gravity and tension, is 0 there and imaginary beside it."""
    one = oil()
    speed = rates.onset_speed(one) / rates.ONSET_RATIO
    total, product = one.oil_density + WATER, one.oil_density * WATER
    first = math.sqrt(GRAVITY * (WATER - one.oil_density) / one.interfacial_tension)  # wave number that grows first
    k = first * np.array([0.8, 1.0, 1.25])
    stiff = GRAVITY * k * (WATER - one.oil_density) / total + one.interfacial_tension * k**3 / total
    growth = product * k**2 * speed**2 / total**2 - stiff
    assert growth[1] == pytest.approx(0.0, abs=1e-9 * stiff[1])
    assert growth[0] < 0.0 and growth[2] < 0.0


@pytest.mark.parametrize("density", [840.0, 900.0, 950.0])
@pytest.mark.parametrize("size", [0.1e-3, 0.5e-3, 1e-3, 2e-3])
def test_drops_rise_where_drag_and_buoyancy_are_equal(density, size):
    one = oil(density)

    def excess(rise):
        reynolds = rise * size / rates.WATER_VISCOSITY
        drag = max(24.0 / reynolds * (1.0 + 0.15 * reynolds**0.687), 0.44)
        return 0.75 * drag * rise**2 / size - one.reduced_gravity

    assert float(rates.rise_speed(size, one)) == pytest.approx(brentq(excess, 1e-9, 1.0), rel=1e-6)


def test_small_drops_rise_by_stokes_law():
    one, size = oil(), 20e-6
    stokes = one.reduced_gravity * size**2 / (18.0 * rates.WATER_VISCOSITY)
    assert float(rates.rise_speed(size, one)) == pytest.approx(stokes, rel=0.01)


def test_largest_drop_has_a_weber_number_of_twelve():
    size = float(rates.largest_drop(0.5, oil()))
    assert WATER * 0.5**2 * size / 0.025 == pytest.approx(12.0)
    assert size == pytest.approx(1.17e-3, rel=0.01)


@pytest.mark.parametrize(("speed", "per_hour"), [(0.41, 0.37), (0.46, 0.94), (0.51, 1.74), (0.62, 4.45)])
def test_torn_oil_of_a_metre_of_front(speed, per_hour):
    """C_e (U - U_e) h_f, with the onset of 0.36 m/s that the check values have."""
    one = oil()
    excess = (speed - 0.36) / (speed - rates.onset_speed(one))
    assert 3600.0 * excess * float(rates.entrainment_rate(speed, 0.4, one)) == pytest.approx(per_hour, rel=0.03)


def test_a_long_pool_catches_its_own_drops():
    share = rates.escaping_share(np.full(3, 0.45), np.array([0.05, 0.3, 2.0]), np.full(3, 0.4), oil())
    assert 1.0 > share[0] > share[1] > share[2] > 0.0
    one, speed, held, draft = oil(), 0.45, 0.3, 0.4
    rise = float(rates.rise_speed(0.4 * rates.largest_drop(speed, one), one))
    length, deep = (float(of(speed, held, one)) for of in (liquids.slick_length, liquids.boom_thickness))
    assert share[1] == pytest.approx(math.exp(-rise * length / (speed * (draft - deep))))


def test_viscous_oil_is_lost_as_a_whole_and_thin_oil_is_not():
    thick = oil(980.0, 0.02, 5e-3)
    rate = rates.accumulation_rate(np.array([0.19, 0.30]), 0.2, thick)
    assert list(rate) == [0.0, pytest.approx(0.03 * 0.1 * 0.2)]
    assert not rates.accumulation_rate(np.array([0.6]), 0.2, oil()).any()


def test_overflow_is_a_weir_of_which_oil_is_the_top():
    rate = rates.overflow_rate(np.array([0.05, -0.02, -0.1]), 0.05)
    assert list(rate) == [
        0.0,
        pytest.approx(1.705 * 0.02**1.5, rel=1e-3),
        pytest.approx(0.5 * 1.705 * 0.1**1.5, rel=1e-3),
    ]


def test_draft_ends_at_the_surface():
    assert list(closure_losses.effective_draft(1.0, np.array([0.7, 1.1]))) == [pytest.approx(0.3), 0.0]
