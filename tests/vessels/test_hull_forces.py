"""Resistance and steering forces of hulls, and what drives give: published values, signs, limits."""

from __future__ import annotations

import math

import pytest

from vessels.drive import HARD_OVER, HULL_PLACE, HULL_SHARE, RUDDERS, WAKE, Drive, DriveModel
from vessels.hull import float_hull, wigley_hull
from vessels.hull_forces import HullForces, HullForm, clarke_derivatives, entrance_angle, wave_resistance

SHIP = HullForm(length=205.0, beam=32.0, draft=10.0, volume=37500.0, waterplane=0.75 * 205.0 * 32.0, midship=0.98)
DRIVE = DriveModel(Drive(diameter=1.1, spacing=2.4, rudder_area=1.2), 15.0, 40e3, 1027.0)
SWIVELS = DriveModel(Drive(diameter=1.1, spacing=2.4), 15.0, 40e3, 1027.0)
BOTH = (True, True)


def test_wave_resistance_of_the_published_example() -> None:
    # Holtrop and Mennen 1982: 557.11 kN at 25 kn, with c2 = 0.7595 for a bulb and c5 = 0.9592 for a transom, which are left out here
    found = wave_resistance(SHIP, 25.0 * 0.5144, 1025.0, entrance=12.08) * 0.7595 * 0.9592
    assert found == pytest.approx(557.11e3, rel=0.01)
    assert entrance_angle(SHIP) == pytest.approx(12.08, abs=0.3)  # theirs with the centre of buoyancy 2 % aft
    assert wave_resistance(SHIP, 4.0, 1025.0) == 0.0


def test_resistance_is_friction_and_waves() -> None:
    hull = float_hull(wigley_hull(15.0, 3.0, 1.2, 2.2), 1.2, water_density=1027.0)
    forces = HullForces(hull)
    # ITTC 1957: log10(3 x 15 / 1.19e-6) = 7.578, C_F = 0.075 / 5.578^2 = 0.002411, with the form factor 0.2
    friction = 0.5 * 1027.0 * 1.2 * 0.002411 * forces._wetted * 9.0
    assert forces.resistance(3.0) == pytest.approx(friction + wave_resistance(forces.form, 3.0, 1027.0), rel=1e-3)
    ahead, _, _ = forces.push(3.0, 0.0, 0.0)
    assert forces.push(-3.0, 0.0, 0.0)[0] == pytest.approx(-ahead)
    assert forces.push(0.0, 1.0, 0.1) == pytest.approx((0.5 * forces._sway * 0.1 - forces._surge * 0.1, 0.0, 0.0))


def test_derivatives_of_a_tanker_are_those_of_clarke() -> None:
    # L / B = 6, B / T = 2.5, C_B = 0.8: pi (T / L)^2 = 0.01396
    form = HullForm(length=6.0, beam=1.0, draft=0.4, volume=0.8 * 2.4, waterplane=5.4)
    found = clarke_derivatives(form)
    assert found.sway_drift == pytest.approx(-0.01396 * 1.8, rel=1e-3)
    assert found.sway_turn == pytest.approx(-0.01396 * (-0.5 + 2.2 / 6.0 - 0.2), rel=1e-3)
    assert found.yaw_drift == pytest.approx(-0.01396 * 0.66, rel=1e-3)
    assert found.yaw_turn == pytest.approx(-0.01396 * (0.25 + 0.0975 - 0.56 / 6.0), rel=1e-3)


def test_drift_and_turn_are_resisted() -> None:
    hull = float_hull(wigley_hull(15.0, 3.0, 1.2, 2.2), 1.2, water_density=1027.0)
    forces = HullForces(hull, skeg_area=2.0)
    _, to_port, moment = forces.push(3.0, 0.5, 0.0)
    assert to_port < 0.0  # against the drift
    assert moment < HullForces(hull).push(3.0, 0.5, 0.0)[2] + 2e4  # and a skeg turns the bow into it
    assert moment > HullForces(hull).push(3.0, 0.5, 0.0)[2]
    assert forces.push(3.0, 0.0, 0.1)[2] < 0.0


def test_thrust_falls_to_nothing_at_the_free_speed() -> None:
    assert DRIVE.limits(0.0) == pytest.approx((-10e3, 20e3))
    assert DRIVE.limits(0.5 * DRIVE.free_speed)[1] == pytest.approx(10e3)
    assert DRIVE.limits(2.0 * DRIVE.free_speed)[1] == 0.0
    # K_T = 0.44 P/D at rest gives 6.15 turns a second for 20 kN, and K_T is 0 at J = 1.1 P/D
    turns = math.sqrt(20e3 / (0.44 * 0.8 * 1027.0 * 1.1**4))
    made = DriveModel(Drive(diameter=1.1, spacing=2.4, rudder_area=1.2), 15.0, 40e3, 1027.0)
    assert made.free_speed == pytest.approx(1.1 * 0.8 * turns * 1.1 / (1.0 - 0.2))
    given, _ = DRIVE.push((90e3, 0.0), (0.0, 0.0, 0.0), 0.0, 0.2, BOTH)
    assert given == pytest.approx((40e3, 0.0, 0.0), abs=1e-6)


def test_rudder_turns_the_bow_to_its_side_and_takes_time() -> None:
    given, angle = DRIVE.push((10e3, 1e9), (3.0, 0.0, 0.0), 0.0, 0.2, BOTH)
    assert angle == pytest.approx(math.radians(1.0))
    given, angle = DRIVE.push((10e3, 1e9), (3.0, 0.0, 0.0), HARD_OVER, 0.2, BOTH)
    assert angle == HARD_OVER
    assert given.moment > 0.0 > given.to_port  # the stern goes to starboard
    assert given.ahead < 10e3
    mirrored, _ = DRIVE.push((10e3, -1e9), (3.0, 0.0, 0.0), -HARD_OVER, 0.2, BOTH)
    assert mirrored == pytest.approx((given.ahead, -given.to_port, -given.moment))


@pytest.mark.parametrize("angle", [0.1, -0.3])
def test_rudders_of_a_coasting_vessel_push_by_fujiis_formula(angle: float) -> None:
    """F_N = 0.5 rho A U^2 6.13 L / (L + 2.25) sin(angle), with L = 1.5 the aspect ratio and U the speed in the wake."""
    push, held = DRIVE.push((0.0, 0.0), (3.0, 0.0, 0.0), angle, 0.0, (False, False))
    assert held == angle
    normal = 0.5 * 1027.0 * 1.2 * (3.0 * (1.0 - WAKE)) ** 2 * 2.452 * math.sin(angle)
    arm = (RUDDERS + HULL_SHARE * HULL_PLACE) * 15.0
    assert push.to_port == pytest.approx(-(1.0 + HULL_SHARE) * normal * math.cos(angle), rel=1e-9)
    assert push.moment == pytest.approx(-arm * normal * math.cos(angle), rel=1e-9)
    assert push.ahead < 0.0


@pytest.mark.parametrize("motion", [(3.0, 0.0, 0.0), (3.0, 0.2, 0.0), (3.0, 0.0, 0.03)])
def test_rudders_are_laid_so_that_they_give_the_moment_that_is_wanted(motion: tuple[float, float, float]) -> None:
    """A drift or a turn gives the rudders a moment amidships already, which counts."""
    for moment in (3e3, -3e3):
        push, angle = DRIVE.push((0.0, moment), motion, 0.0, 1e3, (False, False))
        assert abs(angle) < HARD_OVER
        assert push.moment == pytest.approx(moment, rel=0.05)


def test_lost_screw_leaves_half_the_pull_and_a_moment() -> None:
    given, _ = DRIVE.push((40e3, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0, (True, False))
    assert given == pytest.approx((20e3, 0.0, -1.2 * 20e3))  # the port screw turns the bow to starboard
    assert DRIVE.push((40e3, 1e5), (0.0, 0.0, 0.0), 0.0, 0.2, (False, False))[0] == pytest.approx((0.0, 0.0, 0.0))


def test_two_screws_turn_a_vessel_on_the_spot() -> None:
    given, _ = DRIVE.push((0.0, 2e4), (0.0, 0.0, 0.0), 0.0, 0.0, BOTH)
    assert given == pytest.approx((0.0, 0.0, 2e4))


def test_azimuth_thrusters_keep_within_their_pull() -> None:
    given, _ = SWIVELS.push((90e3, 1e5), (0.0, 0.0, 0.0), 0.0, 0.2, BOTH)
    assert given.moment == pytest.approx(1e5)
    assert math.hypot(given.ahead, given.to_port) == pytest.approx(40e3)
    lost, _ = SWIVELS.push((5e3, 0.0), (0.0, 0.0, 0.0), 0.0, 0.2, (True, False))
    assert lost.moment == pytest.approx(0.0, abs=1e-6)  # the other one swivels against its own offset


@pytest.mark.parametrize("wrong", [{"count": 3}, {"diameter": 0.0}, {"pitch_ratio": 2.0}, {"rudder_area": -1.0}])
def test_impossible_drives_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="allowed"):
        Drive(**({"diameter": 1.0} | wrong))
