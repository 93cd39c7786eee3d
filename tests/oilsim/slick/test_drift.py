"""Parcels are carried by the flow and dispersed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.oilsim.slick.flows import Rotation, UniformFlow


def test_uniform_flow_moves_the_center(make_slick):
    slick = make_slick()
    for step in range(20):
        slick.step(UniformFlow((0.4, -0.1)), 0.5 * step, 0.5)
    assert np.allclose(slick.parcels.position.mean(axis=0), (4.0, -1.0), atol=0.05)


def test_turning_flow_is_followed_to_second_order(make_slick):
    """A quarter turn in 50 and in 100 steps: the error of the midpoint rule falls to a quarter. One parcel does not spread."""
    errors = []
    for steps in (50, 100):
        slick = make_slick(count=1, center=(30.0, 0.0), radius=0.1)
        begin = slick.parcels.position[0].copy()
        for step in range(steps):
            slick.step(Rotation(0.5 * math.pi), step / steps, 1.0 / steps)
        errors.append(float(np.hypot(*(slick.parcels.position[0] - (-begin[1], begin[0])))))
    assert errors[1] == pytest.approx(errors[0] / 4.0, rel=0.1)


def test_variance_of_dispersion(make_slick):
    """Variance 2 K t in each direction and mean 0, to three standard errors; the volume is so small that it hardly spreads."""
    slick = make_slick(volume=1e-9, count=4000, radius=0.01, age=0.0, diffusivity=0.5, seed=7)
    for step in range(10):
        slick.step(UniformFlow(), 2.0 * step, 2.0)
    position = slick.parcels.position
    error = math.sqrt(2.0 / 4000)
    assert np.allclose(position.var(axis=0) / (2.0 * 0.5 * 20.0), 1.0, atol=3.0 * error)
    assert np.allclose(position.mean(axis=0), 0.0, atol=3.0 * math.sqrt(20.0 / 4000))


def test_flow_that_is_not_finite_is_refused(make_slick):
    with pytest.raises(ValueError, match=r"surface_velocity returned .* allowed: finite, of shape \(500, 2\)"):
        make_slick().step(UniformFlow((math.nan, 0.0)), 0.0, 1.0)


def test_step_of_no_duration_is_refused(make_slick):
    with pytest.raises(ValueError, match=r"duration is 0.0 s, allowed: above 0"):
        make_slick().step(UniformFlow(), 0.0, 0.0)
