"""The terminal speed of a drop, by its limits: Stokes's sphere, smooth joints of the fit, and the flattened drop."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.drops.drift import sphere_reynolds, terminal_speed

WATER = {"density": 1000.0, "viscosity": 1e-3, "gravity": 9.81}


def test_a_small_drop_rises_as_stokes_says() -> None:
    """w = drho g D^2 / (18 mu); at Re = 0.004 inertia takes less than 0.1 %."""
    speed = terminal_speed(5e-5, difference=100.0, tension=0.02, **WATER)
    assert speed == pytest.approx(100.0 * 9.81 * 5e-5**2 / (18.0 * 1e-3), rel=2e-3)


@pytest.mark.parametrize("best", [73.0, 580.0, 1.55e7])
def test_the_fit_is_joined_smoothly(best: float) -> None:
    assert sphere_reynolds(best * (1.0 - 1e-9)) == pytest.approx(sphere_reynolds(best), rel=0.02)


@pytest.mark.parametrize("diameter", [2e-4, 1e-3, 3e-3])
def test_spheres_agree_with_another_law_of_their_drag(diameter: float) -> None:
    """Schiller and Naumann 1933: C_D = 24 / Re (1 + 0.15 Re^0.687), w^2 = 4 g' D / (3 C_D), which is good within some percent."""
    speed = terminal_speed(diameter, difference=100.0, tension=1.0, **WATER)
    reynolds = speed * diameter / 1e-6
    drag = 24.0 / reynolds * (1.0 + 0.15 * reynolds**0.687)
    assert speed == pytest.approx(math.sqrt(4.0 * 0.981 * diameter / (3.0 * drag)), rel=0.06)


def test_a_large_drop_is_flattened_and_rises_at_one_speed() -> None:
    """sqrt(2) (sigma g drho / rho^2)^(1/4): 98 mm/s of oil of 900 in sea water of 1025 kg/m3, 0.02 N/m."""
    sea = {"density": 1025.0, "viscosity": 1.1e-3, "gravity": 9.81, "difference": 125.0, "tension": 0.02}
    assert terminal_speed(0.01, **sea) == terminal_speed(0.1, **sea) == pytest.approx(0.0983, abs=5e-5)
    sizes = np.geomspace(1e-4, 0.1, 50)
    speeds = [terminal_speed(size, **sea) for size in sizes]
    assert (np.diff(speeds) >= 0.0).all()


def test_in_an_ideal_liquid_the_drag_coefficient_is_constant() -> None:
    """w^2 = 4 g' D / (3 C_D), with the C_D = N / Re^2 of the end of the fit, 0.53."""
    speeds = [terminal_speed(size, 1000.0, 0.0, 100.0, 1.0, 9.81) for size in (1e-3, 4e-3)]
    assert speeds[1] == pytest.approx(2.0 * speeds[0])
    assert speeds[0] == pytest.approx(math.sqrt(4.0 * 0.981 * 1e-3 / (3.0 * 5e10 / sphere_reynolds(5e10) ** 2)))


def test_nothing_rises_without_gravity_or_a_difference() -> None:
    assert terminal_speed(0.01, difference=0.0, tension=0.02, **WATER) == 0.0
    assert terminal_speed(0.01, difference=100.0, tension=0.02, **(WATER | {"gravity": 0.0})) == 0.0
