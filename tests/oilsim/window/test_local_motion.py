"""The sea over bodies: mean displacement, velocity and slope, by which they are brought into the places at rest."""

from __future__ import annotations

import numpy as np

from oilsim.sea import CurrentProfile, RegularWaves, Sea, SeaDescription, SteadyFlow
from oilsim.window.sea_motion import SeaMotion
from oilsim.window.window import gauss_points, local_motion

STEP = 1e-4


def motion(height: float = 0.4) -> SeaMotion:
    current = CurrentProfile(flow=SteadyFlow(speed=0.3, direction=1.0))
    waves = RegularWaves(height=height, period=3.0, direction=0.6)
    return SeaMotion(Sea(SeaDescription(depth=40.0, waves=waves, current=current)))


def bar(length: float) -> np.ndarray:
    """Points (M, 3) of a bar along y."""
    along = np.linspace(-0.5 * length, 0.5 * length, 401)
    return np.stack([0.0 * along, along, 0.0 * along], -1)


def test_points_of_gauss_lie_a_standard_deviation_from_the_middle() -> None:
    points = gauss_points(bar(3.0))
    np.testing.assert_allclose(np.sort(np.abs(points[:, 1]))[2:], 3.0 / np.sqrt(12.0), rtol=5e-3)


def test_a_small_body_has_the_water_s_place_velocity_and_slope() -> None:
    sea, place = motion(), np.array([[4.0, -3.0, 0.05]])
    found = local_motion(sea, place, gauss_points(bar(0.1))[None], 12.0)
    rest = sea.at_rest(place, 12.0)
    np.testing.assert_allclose(found.rest, rest, atol=1e-3)
    np.testing.assert_allclose(found.twist[0, :3], sea.velocity(rest, 12.0)[0], atol=1e-3)
    aside = 1e-3 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    slope = (sea.displacement(rest + aside, 12.0) - sea.displacement(rest - aside, 12.0))[:, 2] / 2e-3
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + slope @ slope)
    np.testing.assert_allclose(found.turn[0] @ [0.0, 0.0, 1.0], normal, atol=5e-3)
    np.testing.assert_allclose(found.turn[0] @ found.turn[0].T, np.eye(3), atol=1e-12)


def test_the_angular_velocity_is_that_of_the_normal() -> None:
    sea, rest = motion(0.02), np.array([[4.0, -3.0, 0.0]])
    offsets = gauss_points(bar(0.1))[None]
    normals = [local_motion(sea, sea.in_sea(rest, t), offsets, t).turn[0, :, 2] for t in (12.0 - STEP, 12.0 + STEP)]
    spin = local_motion(sea, sea.in_sea(rest, 12.0), offsets, 12.0).twist[0, 3:]
    rate = (normals[1] - normals[0]) / (2.0 * STEP)
    np.testing.assert_allclose(np.cross(spin, [0.0, 0.0, 1.0])[:2], rate[:2], atol=1e-4)


def test_waves_shorter_than_a_body_do_not_turn_it() -> None:
    """The mean slope of a bar twice as long as the wave is under a third of the water's."""
    short = SeaMotion(
        Sea(SeaDescription(depth=40.0, waves=RegularWaves(height=0.05, period=1.0, direction=0.5 * np.pi)))
    )
    length = 2.0 * 2.0 * np.pi / float(short.sea.components.wave_number[0])
    places = np.stack([np.zeros(40), np.linspace(0.0, length, 40), np.zeros(40)], -1)
    tilt = {
        size: local_motion(short, places, np.tile(gauss_points(bar(size)), (40, 1, 1)), 0.0).turn[:, 1, 2]
        for size in (0.02, length)
    }
    assert np.abs(tilt[length]).max() < 0.33 * np.abs(tilt[0.02]).max()
