"""The wind acts where the surface is and faces up; a pipe holds and fills as far as its radius."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import PipeEmitter
from oilsim.forcing import ForcingView, Wind

SPACING = 0.1


def blown(gradient: tuple[float, float, float]) -> bool:
    """Whether the wind moves a particle with such a gradient sum [1/spacing]."""
    velocity = np.zeros((3, 1), np.float32)
    sums = np.array(gradient, np.float32)[:, None] / SPACING
    view = ForcingView(
        0.0, 0.01, np.zeros((3, 1), np.float32), velocity, np.zeros(1, np.uint8), sums.astype(np.float32), np.array([1000.0]), SPACING**3
    )  # fmt: skip
    Wind(speed=10.0, direction=0.0, spacing=SPACING, seed=1).apply(view)
    return bool(velocity.any())


@pytest.mark.parametrize(
    ("gradient", "moved"),
    [
        ((0.0, 0.0, -0.3), True), ((0.0, 0.0, 0.3), False), ((0.3, 0.0, 0.0), False), ((0.0, 0.0, -0.11), True), ((0.0, 0.0, -0.09), False),
        ((0.24, 0.0, -0.15), True), ((0.28, 0.0, -0.15), False),
    ],
)  # fmt: skip
def test_the_wind_finds_the_surface_that_faces_up(gradient: tuple[float, float, float], moved: bool) -> None:
    """From a tenth of a unit on, and up to 60 degrees off the vertical."""
    assert blown(gradient) == moved


@pytest.mark.parametrize("radius", [0.1, 0.25])
def test_a_pipe_is_as_wide_as_its_radius(radius: float) -> None:
    pipe = PipeEmitter(
        phase="oil", mouth=(1.0, 1.0, 1.0), direction=(1.0, 0.0, 0.0), radius=radius, speed=1.0, spacing=0.05
    )
    layer = pipe.emit(0.0, 1e-9)
    assert np.hypot(*(layer - (0.0, 1.0, 1.0)).T[1:]).max() <= radius
    assert len(layer) * 0.05**2 == pytest.approx(np.pi * radius**2, rel=0.15)
    ids, within = (
        np.array([1, 2], np.uint32),
        np.array([radius + 0.04, radius + 0.06]),
    )  # a spacing further it holds what swells
    position = np.array([[0.95, 0.95], [1.0, 1.0], 1.0 + within], np.float32)
    velocity = np.zeros((3, 2), np.float32)
    pipe.fill(ids)
    pipe.hold(0.0, ids, position, velocity)
    np.testing.assert_array_equal(velocity[0], [1.0, 0.0])
