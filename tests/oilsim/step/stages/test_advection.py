"""x += dt v, and back in at the other side of a periodic axis."""

from __future__ import annotations

import numpy as np

from oilsim.step.stages.advection import advect, wrap_periodic


def test_particles_move_by_their_velocities():
    position, velocity = np.array([[1.0], [2.0], [3.0]], np.float32), np.array([[4.0], [-2.0], [0.5]], np.float32)
    advect(position, velocity, 0.25)
    np.testing.assert_array_equal(position, [[2.0], [1.5], [3.125]])


def test_only_periodic_axes_wrap():
    position = np.array([[2.25, -1.5, 0.5]] * 3, np.float32)
    wrap_periodic(position, (-1.0, 0.0, 0.0), (np.float32(2.0), np.float32(0.0), np.float32(1.0)))
    np.testing.assert_array_equal(position, [[0.25, 0.5, 0.5], [2.25, -1.5, 0.5], [0.25, 0.5, 0.5]])
    wrap_periodic(position, (-1.0, 0.0, 0.0), None)
    assert position[1, 0] == 2.25
