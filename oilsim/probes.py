"""Point measurements: pressure and velocity by the kernel mean of nearby particles, the free surface by its highest ones.

f(x) = sum_j V f_j W(x - x_j) / sum_j V W(x - x_j)   (Shepard), pressure with its mean gradient carried along below.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.neighborhood.smoothing_kernels import kernel
from oilsim.state import FluidState
from oilsim.step.step_tools import StepTools

Double = NDArray[np.float64]

# [1] share of the kernel that liquid must fill for a reading; tuned; not on record
PRESENT = 0.05
# [1] share of a full layer of particles across the support that belongs to the surface at least; tuned; fewer are spray
FEWEST = 0.15


def _offsets(state: FluidState, tools: StepTools, point: Double) -> Double:
    """Return the ways (axes, N) [m] from a point, along as many axes as it has, to the nearest image of every particle."""
    offset = state.position[: point.size].astype(np.float64) - point[:, None]
    for axis, length in enumerate((tools.constants.period or ())[: point.size]):
        if length > 0.0:
            offset[axis] -= length * np.round(offset[axis] / length)
    return offset


def _weights(state: FluidState, tools: StepTools, point: Double) -> tuple[NDArray[np.int64], Double, Double]:
    """Return the particles within the support of a point, the ways to them (3, n) [m], and their shares V W [1]."""
    offset = _offsets(state, tools, point)
    distance = np.sqrt((offset**2).sum(axis=0))
    near = np.flatnonzero(distance < tools.constants.support)
    shares = kernel(distance[near] / float(tools.constants.support), float(tools.constants.sigma))
    return near, offset[:, near], float(tools.constants.volume) * shares


def pressure_at(state: FluidState, tools: StepTools, points: Double) -> Double:
    """Return the pressure (K,) [Pa] at points (K, 3) [m]: a first-order fit p_0 + b . (x_j - x) weighted by the kernel, 0 in air."""
    result = np.zeros(len(points))
    per_impulse = tools.constants.reference_density / state.time_step if state.time_step > 0.0 else 0.0
    for n, point in enumerate(points):
        near, offset, share = _weights(state, tools, point)
        if share.sum() < PRESENT:
            continue
        values = per_impulse * state.pressure_impulse[near].astype(np.float64)
        basis = np.vstack([np.ones(len(near)), offset / float(tools.constants.support)])
        normal = (basis * share) @ basis.T + 1e-6 * share.sum() * np.diag([0.0, 1.0, 1.0, 1.0])
        result[n] = np.linalg.solve(normal, (basis * share) @ values)[0]
    return result


def velocity_at(state: FluidState, tools: StepTools, points: Double) -> Double:
    """Return the velocity (K, 3) [m/s] at points (K, 3) [m], the kernel mean of the particles near; 0 in air."""
    result = np.zeros((len(points), 3))
    for n, point in enumerate(points):
        near, _, share = _weights(state, tools, point)
        if share.sum() >= PRESENT:
            result[n] = state.velocity[:, near].astype(np.float64) @ share / share.sum()
    return result


def surface_height_at(state: FluidState, tools: StepTools, points: Double) -> Double:
    """Measure the height (K,) [m] of the free surface over points (K, 2) [m], by the particles within a support radius across.

    It lies half a spacing above the mean of the highest ones, those within three quarters of a spacing of the highest that hangs
    together with the liquid below, like a gauge wire. Spray does not count: neither drops in the air nor single particles on the surface
    (`FEWEST` of a layer). Where there is no liquid, the reading is the domain's lower side.
    """
    config = tools.config
    spacing, radius = config.particle_spacing, config.support_radius
    layer = (
        2.0 * radius / spacing if tools.constants.plane else np.pi * (radius / spacing) ** 2
    )  # particles of a full one
    fewest = max(2, int(np.ceil(FEWEST * layer)))
    result = np.full(len(points), config.lower[2])
    for n, point in enumerate(points):
        offset = _offsets(state, tools, point[:1] if tools.constants.plane else point)
        heights = np.sort(state.position[2, (offset**2).sum(axis=0) < radius**2].astype(np.float64))
        parts = np.split(heights, np.flatnonzero(np.diff(heights) > 1.5 * spacing) + 1)
        liquid = next((part for part in parts if len(part) >= fewest), None)
        if liquid is not None:
            result[n] = _top(liquid, 0.75 * spacing, fewest) + 0.5 * spacing
    return result


def _top(heights: Double, thickness: float, fewest: int) -> float:
    """Return the mean height [m] of the uppermost particles (n,), sorted, within `thickness` [m], without single ones above them."""
    while True:
        upper = heights > heights[-1] - thickness
        if upper.all() or int(upper.sum()) >= fewest:
            return float(heights[upper].mean())
        heights = heights[~upper]
