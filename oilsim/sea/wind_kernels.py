"""Gusts and the drift of the wind at many places at once; their descriptions need no compiler."""

from __future__ import annotations

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST
from oilsim.sea.vector_math import sine_cosine


@njit(**FAST)
def add_gusts(along, gusts, time, gust):
    """Add the gust (N,) [-], over the mean speed, at places `along` the wind (N,) [m] and `time` [s]; gusts: GustComponents."""
    for j in range(gusts.amplitude.shape[0]):
        a, k = gusts.amplitude[j], gusts.wave_number[j]
        shift = gusts.frequency[j] * time + gusts.phase[j]
        for i in range(along.shape[0]):
            _, c = sine_cosine(shift - k * along[i])
            gust[i] += a * c


@njit(**FAST)
def add_drift(height, elevation, layer, velocity):
    """Add the drift of the wind to `velocity` (N, 3) [m/s] at points of a `height` (N,) [m] below a surface at `elevation` (N,) [m].

    layer: DriftLayer.
    """
    for i in range(height.shape[0]):
        depth = max(elevation[i] - height[i], 0.0)
        if depth < layer.thickness:
            speed = max(layer.surface - layer.slope * np.log1p(depth / layer.roughness), 0.0)
            velocity[i, 0] += speed * layer.toward_x
            velocity[i, 1] += speed * layer.toward_y
