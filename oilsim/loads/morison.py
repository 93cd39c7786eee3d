"""Wrench, added mass and damping of a sea on floating bodies, part by part.

Buoyancy and the pressure of the undisturbed waves (Froude-Krylov): where the water accelerates with a, its pressure has the gradient
rho (g - a), g pointing down. Over a part that is short against the waves this is uniform, and the surface is a plane across it, through
the surface at the part's centre:

    F = rho V (a - g),  at the centre of the wetted volume V below that plane, whose normal is that of a - g at the surface.

Inertia (Morison): the water that a part carries along, A = diag(added mass) s in the body's axes, with s = min(1, V / design volume),

    F = A (a - dv/dt),  v the velocity of the part's wetted centre. dv/dt of the body is left to the solver as added mass.

A part that comes down into water takes hold of more of it (von Karman 1929); what it leaves behind when it rises goes on by itself:

    F = dA/dt (u - v),  dA/dt = added mass / design volume * S max(0, (u - v) . n),  S the area that the surface cuts out of the part,
                        while V is below the design volume.

Wave damping, F = B s (u - v), takes what the body's own waves carry off.
Drag by stations, along each of the body's axes by itself (cross-flow principle), with w the wetted share of the station's height:

    F_i = rho / 2 C_d A_i w |u_i - v_i| (u_i - v_i),   in air: rho_a / 2 C_d A_i (1 - w) |W_i - v_i| (W_i - v_i).

Damping is the derivative of both by the body's twist. Source: Morison et al. 1950; Newman 1977, sections 2.14 and 6.17.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.loads.load_model import LoadModel, StackedParts, StackedStations, stacked_parts, stacked_stations
from oilsim.loads.wetted_volume import wetted_volume
from oilsim.physical_constants import AIR_DENSITY
from oilsim.sea import Sea

Array = NDArray[np.float64]


class BodyLoads(NamedTuple):
    """Loads about each centre of mass, world frame.

    wrench (B, 6) [N, N m]; added_mass (B, 6, 6) [kg, kg m, kg m2]; damping (B, 6, 6) [kg/s, kg m/s, kg m2/s]; wetted_volume (B,) [m3].
    """

    wrench: Array
    added_mass: Array
    damping: Array
    wetted_volume: Array


class _Motion(NamedTuple):
    """Bodies now: position (B, 3) [m], turn (B, 3, 3) body to world, twist (B, 6) [m/s, rad/s]."""

    position: Array
    turn: Array
    twist: Array


class _Water(NamedTuple):
    """Sea at n points: elevation (n,) [m]; velocity [m/s], acceleration and that of the surface [m/s2], wind [m/s], each (n, 3)."""

    elevation: Array
    velocity: Array
    acceleration: Array
    surface_acceleration: Array
    wind: Array


# [m] above any surface; numerical; there a sea gives the values of its surface
ALOFT = 1e4


class FloatingBodies:
    """Bodies afloat in a sea, each with its `LoadModel`."""

    def __init__(self, models: Sequence[LoadModel], sea: Sea) -> None:
        self.sea = sea
        self._densities = np.array([sea.description.density, AIR_DENSITY, sea.description.gravity])
        self._parts, self._stations = stacked_parts(models), stacked_stations(models)
        self._count = len(models)

    def in_sea(self, sea: Sea) -> FloatingBodies:
        """Return the same bodies afloat in another sea, of water of the same density and gravity."""
        other = copy(self)
        other.sea = sea
        return other

    def loads(self, time: float, pose: Array, twist: Array) -> BodyLoads:
        """Return the loads at `time` [s]; pose (B, 7) [m, 1] with quaternions xyzw, twist (B, 6) [m/s, rad/s]."""
        motion = _Motion(np.ascontiguousarray(pose[:, :3]), _matrices(pose[:, 3:]), np.ascontiguousarray(twist))
        found = BodyLoads(*(np.zeros((self._count, *shape)) for shape in ((6,), (6, 6), (6, 6), ())))
        centers = _world_points(motion, self._parts.body, self._parts.center)
        places = _world_points(motion, self._stations.body, self._stations.place)
        parts, stations = self._water_at(centers, places, time)
        _add_parts(self._parts, motion, parts, self._densities, found)
        _add_stations(self._stations, motion, stations, places, self._densities, found)
        return found

    def _water_at(self, centers: Array, places: Array, time: float) -> tuple[_Water, _Water]:
        """Ask the sea once at the centers (P, 3) [m] of parts, at the surface there, and at the places (S, 3) [m] of stations."""
        surface, count = centers + np.array((0.0, 0.0, ALOFT)), len(centers)
        points = np.concatenate([centers, places, surface])
        motion = self.sea.kinematics(points, time)
        wind = np.zeros((len(centers) + len(places), 3))
        wind[:, :2] = self.sea.wind(points[: len(wind), :2], time)
        waters = []
        for chosen in (slice(0, count), slice(count, len(wind))):
            surface_acceleration = motion.acceleration[len(wind) :] if chosen.start == 0 else np.zeros((0, 3))
            waters.append(
                _Water(
                    elevation=motion.elevation[chosen],
                    velocity=motion.velocity[chosen],
                    acceleration=motion.acceleration[chosen],
                    surface_acceleration=surface_acceleration,
                    wind=wind[chosen],
                )
            )
        return waters[0], waters[1]


@njit(nogil=True, cache=True, error_model="numpy")
def _matrices(orientation: Array) -> Array:
    """Compute matrices (B, 3, 3), body axes to world axes, of unit quaternions (B, 4) xyzw."""
    result = np.empty((len(orientation), 3, 3))
    for n in range(len(orientation)):
        x, y, z, w = orientation[n]
        result[n, 0] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)
        result[n, 1] = 2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)
        result[n, 2] = 2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def _world_points(motion: _Motion, body: NDArray[np.int64], place: Array) -> Array:
    """Return the places (n, 3) [m] of bodies in the world."""
    points = np.empty(place.shape)
    for n in range(len(place)):
        for axis in range(3):
            points[n, axis] = motion.position[body[n], axis]
            for own in range(3):
                points[n, axis] += motion.turn[body[n], axis, own] * place[n, own]
    return points


@njit(nogil=True, cache=True, error_model="numpy")
def _crossed(a: Array, b: Array) -> Array:
    """Return a x b, both (3,)."""
    return np.array((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


@njit(nogil=True, cache=True, error_model="numpy")
def _push(wrench: Array, arm: Array, force: Array) -> None:
    """Add `force` (3,) [N] at `arm` (3,) [m] to a wrench (6,)."""
    wrench[:3] += force
    wrench[3:] += _crossed(arm, force)


@njit(nogil=True, cache=True, error_model="numpy")
def _spread(matrix: Array, arm: Array, tensor: Array) -> None:
    """Add J^T `tensor` J to a matrix (6, 6), with J = [1, -arm x] the velocity at `arm` (3,) [m] by the twist; tensor (3, 3)."""
    lever = np.zeros((3, 6))
    lever[0, 0] = lever[1, 1] = lever[2, 2] = 1.0
    lever[0, 4], lever[0, 5] = arm[2], -arm[1]
    lever[1, 3], lever[1, 5] = -arm[2], arm[0]
    lever[2, 3], lever[2, 4] = arm[1], -arm[0]
    for i in range(6):
        for j in range(6):
            for k in range(3):
                for m in range(3):
                    matrix[i, j] += lever[k, i] * tensor[k, m] * lever[m, j]


@njit(nogil=True, cache=True, error_model="numpy")
def _along_axes(turn: Array, values: Array) -> Array:
    """Return R diag(`values`) R^T (3, 3)."""
    result = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                result[i, j] += turn[i, k] * values[k] * turn[j, k]
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def _add_parts(parts: StackedParts, motion: _Motion, water: _Water, densities: Array, found: BodyLoads) -> None:
    """Add buoyancy, wave pressure, added mass and wave damping of all parts to `found`; densities as `FloatingBodies` has them."""
    density, gravity = densities[0], np.array((0.0, 0.0, -densities[2]))
    for p in range(len(parts.body)):
        b = parts.body[p]
        turn, twist, position = motion.turn[b], motion.twist[b], motion.position[b]
        center = position + turn @ parts.center[p]
        steepness = water.surface_acceleration[p] - gravity
        normal = turn.T @ (steepness / np.sqrt((steepness**2).sum()))
        surface = turn.T @ (np.array((center[0], center[1], water.elevation[p])) - position)
        wetted = wetted_volume(parts.triangles[parts.first[p] : parts.first[p + 1]], surface, normal)
        volume = wetted[0]
        if not volume > 0.0:
            continue
        arm = turn @ (surface + wetted[1:4] / volume)
        share = min(1.0, volume / parts.design_volume[p])
        carried = _along_axes(turn, share * parts.added_mass[p])
        damped = _along_axes(turn, share * parts.wave_damping[p])
        turning = _crossed(twist[3:], _crossed(twist[3:], arm))
        slip = water.velocity[p] - twist[:3] - _crossed(twist[3:], arm)
        if share < 1.0:
            entering = wetted[4] * max(0.0, (slip * (turn @ normal)).sum()) / parts.design_volume[p]
            damped += _along_axes(turn, entering * parts.added_mass[p])
        force = density * volume * (water.acceleration[p] - gravity)
        force += carried @ (water.acceleration[p] - turning) + damped @ slip
        _push(found.wrench[b], arm, force)
        _spread(found.added_mass[b], arm, carried)
        _spread(found.damping[b], arm, damped)
        found.wetted_volume[b] += volume


@njit(nogil=True, cache=True, error_model="numpy")
def _add_stations(
    stations: StackedStations, motion: _Motion, water: _Water, places: Array, densities: Array, found: BodyLoads
) -> None:
    """Add drag of water and air at all stations, which are at `places` (S, 3) [m], to `found`."""
    for s in range(len(stations.body)):
        b = stations.body[s]
        turn, twist = motion.turn[b], motion.twist[b]
        arm = places[s] - motion.position[b]
        share = min(1.0, max(0.0, 0.5 + 0.5 * (water.elevation[s] - places[s, 2]) / stations.half_height[s]))
        own = twist[:3] + _crossed(twist[3:], arm)
        pressed, slope = np.zeros(3), np.zeros(3)
        _press(0.5 * densities[0] * share * stations.drag_area[s], turn.T @ (water.velocity[s] - own), pressed, slope)
        _press(
            0.5 * densities[1] * (1.0 - share) * stations.wind_area[s], turn.T @ (water.wind[s] - own), pressed, slope
        )
        _push(found.wrench[b], arm, turn @ pressed)
        _spread(found.damping[b], arm, _along_axes(turn, slope))


@njit(nogil=True, cache=True, error_model="numpy")
def _press(weight: Array, slip: Array, pressed: Array, slope: Array) -> None:
    """Add weight |slip| slip (3,) to `pressed` [N] and its derivative by slip to `slope` [kg/s]; weight rho / 2 C_d A [kg/m]."""
    for axis in range(3):
        pressed[axis] += weight[axis] * abs(slip[axis]) * slip[axis]
        slope[axis] += 2.0 * weight[axis] * abs(slip[axis])
