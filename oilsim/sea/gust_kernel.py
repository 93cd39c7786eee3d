"""Gusts at many places at once; descriptions of gusts need no compiler."""

from __future__ import annotations

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
