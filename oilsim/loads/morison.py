"""Wrench, added mass and damping of a sea on floating bodies, part by part.

Buoyancy and the pressure of the undisturbed waves (Froude-Krylov): where the water accelerates with a, its pressure has the gradient
rho (g - a), g pointing down. Over a part that is short against the waves this is uniform, and the surface is a plane through its centre's:
    F = rho V (a - g),  at the centre of the wetted volume V below that plane, whose normal is that of a - g at the surface.

Inertia (Morison): the water that a part carries along, A = diag(added mass) s in the body's axes, with s = min(1, V / design volume),

    F = A (a - dv/dt),  v the velocity of the part's wetted centre. dv/dt of the body is left to the solver as added mass.

A part that comes down into water takes hold of more of it (von Karman 1929); what it leaves behind when it rises goes on by itself:

    F = dA/dt (u - v),  dA/dt = added mass / design volume * S max(0, (u - v) . n),  S the area that the surface cuts out of the part,
                        while V is below the design volume.

A plate, such as a skirt, carries along what its own wetted depth h does, at the middle of that depth: A across it fades with (h / draft)^2,
not with the volume, which is a float's. Its foot stays in the water, so it takes hold of none anew.

Wave damping, F = B s (u - v), takes what the body's own waves carry off. Drag by stations, along each of the body's axes by itself
(cross-flow principle), with w the wetted share of the station's height:

    F_i = rho / 2 C_d A_i w |u_i - v_i| (u_i - v_i),   in air: rho_a / 2 C_d A_i (1 - w) |W_i - v_i| (W_i - v_i).

Drag by skin, on every piece of it with area A and outward normal n, half of it in front and half in the wake, with the water of its part:

    F = rho / 4 C_n A w |u_n| u_n n + rho / 2 C_f A w |u_t| u_t,   u_n = (u - v) . n,  u_t = u - v - u_n n; in air likewise.

Damping is the derivative of all drag by the body's twist. Source: Morison et al. 1950; Newman 1977, sections 2.14 and 6.17.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from oilsim.backend.arrays import Array, Ints
from oilsim.backend.jit import njit
from oilsim.core.physical_constants import AIR_DENSITY
from oilsim.loads.body_axes import cross, into_body, rotation_matrices, spread
from oilsim.loads.load_model import (
    LoadModel,
    StackedParts,
    StackedSkin,
    StackedStations,
    add_force_at,
    stacked_parts,
    stacked_skin,
    stacked_stations,
)
from oilsim.loads.wetted_volume import add_wetted_volume
from oilsim.sea import Sea


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
    """Sea at n points: elevation (n,) [m]; velocity [m/s], acceleration [m/s2], each (n, 3).

    Parts have the acceleration of the surface above them, too; stations, and parts with a skin, the wind, each (n, 3).
    """

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
        self._parts, self._stations, self._skin = stacked_parts(models), stacked_stations(models), stacked_skin(models)
        self._skinned = np.unique(self._skin.part)
        self._axes = np.array([model.axes for model in models]).reshape(-1, 3, 3)
        self._count = len(models)

    def in_sea(self, sea: Sea) -> FloatingBodies:
        """Return the same bodies afloat in another sea, of water of the same density and gravity."""
        other = copy(self)
        other.sea = sea
        return other

    def loads(self, time: float, pose: Array, twist: Array) -> BodyLoads:
        """Return the loads at `time` [s]; pose (B, 7) [m, 1] with quaternions xyzw, twist (B, 6) [m/s, rad/s]."""
        turn = rotation_matrices(pose[:, 3:]) @ self._axes
        motion = _Motion(np.ascontiguousarray(pose[:, :3]), turn, np.ascontiguousarray(twist))
        found = BodyLoads(*(np.zeros((self._count, *shape)) for shape in ((6,), (6, 6), (6, 6), ())))
        centers = _world_points(motion, self._parts.body, self._parts.center)
        places = _world_points(motion, self._stations.body, self._stations.place)
        parts, stations = self._water_at(centers, places, time)
        _add_parts(self._parts, motion, parts, self._densities, found)
        _add_stations(self._stations, motion, stations, places, self._densities, found)
        _add_skin(self._skin, self._parts.body, motion, parts, self._densities, found)
        _into_world(motion.turn, found)
        return found

    def _water_at(self, centers: Array, places: Array, time: float) -> tuple[_Water, _Water]:
        """Ask the sea once at the centers (P, 3) [m] of parts, at the surface there, and at the places (S, 3) [m] of stations."""
        surface, count, both = centers + np.array((0.0, 0.0, ALOFT)), len(centers), len(centers) + len(places)
        motion = self.sea.kinematics(np.concatenate([centers, places, surface]), time)
        waters = []
        for chosen in (slice(0, count), slice(count, both)):
            of_parts = chosen.start == 0
            waters.append(
                _Water(
                    elevation=motion.elevation[chosen],
                    velocity=motion.velocity[chosen],
                    acceleration=motion.acceleration[chosen],
                    surface_acceleration=motion.acceleration[both:] if of_parts else np.zeros((0, 3)),
                    wind=self._wind_on_skin(centers, time)
                    if of_parts
                    else self._wind_at(places, motion.elevation[chosen], time),
                )
            )
        return waters[0], waters[1]

    def _wind_on_skin(self, centers: Array, time: float) -> Array:
        """Ask the sea for the wind (P, 3) [m/s] at the centers (P, 3) [m] of parts that have a skin; 0 at the others."""
        wind = np.zeros((len(centers), 3))
        if len(self._skinned):
            wind[self._skinned, :2] = self.sea.wind(centers[self._skinned, :2], time)
        return wind

    def _wind_at(self, places: Array, elevation: Array, time: float) -> Array:
        """Ask the sea for the wind (S, 3) [m/s] at the places (S, 3) [m] of stations that are not all under water; 0 at the others."""
        wind = np.zeros((len(places), 3))
        dry = np.flatnonzero(places[:, 2] + self._stations.half_height > elevation)
        wind[dry, :2] = self.sea.wind(places[dry, :2], time)
        return wind


@njit(nogil=True, cache=True, error_model="numpy")
def _world_points(motion: _Motion, body: Ints, place: Array) -> Array:
    """Return the places (n, 3) [m] of bodies in the world."""
    points = np.empty(place.shape)
    for n in range(len(place)):
        for axis in range(3):
            points[n, axis] = motion.position[body[n], axis]
            for own in range(3):
                points[n, axis] += motion.turn[body[n], axis, own] * place[n, own]
    return points


@njit(nogil=True, cache=True, error_model="numpy")
def _slip(turn: Array, fluid: Array, twist: Array, arm: Array, result: Array) -> None:
    """Write the velocity of a `fluid` (3,) [m/s] past a place at `arm` (3,) [m] to `result` (3,); `twist` (6,) along the body's axes."""
    into_body(turn, fluid, result)
    for axis in range(3):
        after, before = (axis + 1) % 3, (axis + 2) % 3
        result[axis] -= twist[axis] + twist[3 + after] * arm[before] - twist[3 + before] * arm[after]


@njit(nogil=True, cache=True, error_model="numpy")
def _own_twists(motion: _Motion) -> Array:
    """Return the twists (B, 6) [m/s, rad/s] along the bodies' axes."""
    own = np.empty(motion.twist.shape)
    for b in range(len(own)):
        into_body(motion.turn[b], motion.twist[b, :3], own[b, :3])
        into_body(motion.turn[b], motion.twist[b, 3:], own[b, 3:])
    return own


@njit(nogil=True, cache=True, error_model="numpy")
def _add_parts(parts: StackedParts, motion: _Motion, water: _Water, densities: Array, found: BodyLoads) -> None:
    """Add buoyancy, wave pressure, added mass and wave damping of all parts to `found`, along the bodies' axes.

    densities as `FloatingBodies` has them.
    """
    density, gravity, twists = densities[0], densities[2], _own_twists(motion)
    vectors = np.empty((8, 3))
    up, steep, normal, surface, arm, slip, turning, force = vectors
    carried, damped, total, corner = np.empty(3), np.empty(3), np.empty(5), np.empty((3, 3))
    for p in range(len(parts.body)):
        b = parts.body[p]
        turn, twist, center = motion.turn[b], twists[b], parts.center[p]
        height = motion.position[b, 2]
        for axis in range(3):
            up[axis] = turn[2, axis]
            height += up[axis] * center[axis]
        into_body(turn, water.surface_acceleration[p], steep)
        for axis in range(3):
            steep[axis] += gravity * up[axis]
            surface[axis] = center[axis] + up[axis] * (water.elevation[p] - height)
        size = np.sqrt(steep[0] ** 2 + steep[1] ** 2 + steep[2] ** 2)
        for axis in range(3):
            normal[axis] = steep[axis] / size
        add_wetted_volume(parts.triangles[parts.first[p] : parts.first[p + 1]], surface, normal, total, corner)
        volume = total[0]
        if not volume > 0.0:
            continue
        for axis in range(3):
            arm[axis] = surface[axis] + total[1 + axis] / volume
        share = min(1.0, volume / parts.design_volume[p])
        _slip(turn, water.velocity[p], twist, arm, slip)
        entering = 0.0
        if share < 1.0:
            coming = slip[0] * normal[0] + slip[1] * normal[1] + slip[2] * normal[2]
            entering = total[4] * max(0.0, coming) / parts.design_volume[p]
        cross(twist[3:], arm, force)
        cross(twist[3:], force, turning)
        into_body(turn, water.acceleration[p], steep)
        has_plate = parts.plate[p, 1] > 0.0
        for axis in range(3):
            added = 0.0 if has_plate and axis == 1 else parts.added_mass[p, axis]
            carried[axis] = share * added
            damped[axis] = share * parts.wave_damping[p, axis] + entering * added
            force[axis] = density * volume * (steep[axis] + gravity * up[axis])
            force[axis] += carried[axis] * (steep[axis] - turning[axis]) + damped[axis] * slip[axis]
        add_force_at(found.wrench[b], arm, force)
        spread(found.added_mass[b], arm, carried)
        spread(found.damping[b], arm, damped)
        found.wetted_volume[b] += volume
        if has_plate:
            _add_plate(parts, p, motion, water, twist, steep, found)


@njit(nogil=True, cache=True, error_model="numpy")
def _add_plate(
    parts: StackedParts, p: int, motion: _Motion, water: _Water, twist: Array, acceleration: Array, found: BodyLoads
) -> None:
    """Add the inertia of the water that the plate of part `p` carries along; twist (6,) and acceleration (3,) in the body's axes."""
    b, foot, draft = parts.body[p], parts.plate[p, 0], parts.plate[p, 1]
    up = max(motion.turn[b, 2, 2], 0.1)  # one that lies on its side is as deep as it is long
    wet = min(draft, (water.elevation[p] - motion.position[b, 2]) / up - foot)
    if not wet > 0.0:
        return
    vectors = np.zeros((4, 3))
    arm, turning, force, carried = vectors
    arm[0], arm[1], arm[2] = parts.center[p, 0], parts.center[p, 1], foot + 0.5 * wet
    carried[1] = parts.added_mass[p, 1] * (wet / draft) ** 2
    cross(twist[3:], arm, force)
    cross(twist[3:], force, turning)
    force[:] = 0.0
    force[1] = carried[1] * (acceleration[1] - turning[1])
    add_force_at(found.wrench[b], arm, force)
    spread(found.added_mass[b], arm, carried)


@njit(nogil=True, cache=True, error_model="numpy")
def _add_stations(
    stations: StackedStations, motion: _Motion, water: _Water, places: Array, densities: Array, found: BodyLoads
) -> None:
    """Add drag of water and air at all stations, which are at `places` (S, 3) [m], to `found`, along the bodies' axes."""
    twists = _own_twists(motion)
    pressed, slope, slip = np.empty(3), np.empty(3), np.empty(3)
    for s in range(len(stations.body)):
        b, arm = stations.body[s], stations.place[s]
        share = min(1.0, max(0.0, 0.5 + 0.5 * (water.elevation[s] - places[s, 2]) / stations.half_height[s]))
        pressed[:], slope[:] = 0.0, 0.0
        if share > 0.0:
            _slip(motion.turn[b], water.velocity[s], twists[b], arm, slip)
            _press(0.5 * densities[0] * share, stations.drag_area[s], slip, pressed, slope)
        if share < 1.0:
            _slip(motion.turn[b], water.wind[s], twists[b], arm, slip)
            _press(0.5 * densities[1] * (1.0 - share), stations.wind_area[s], slip, pressed, slope)
        add_force_at(found.wrench[b], arm, pressed)
        spread(found.damping[b], arm, slope)


@njit(nogil=True, cache=True, error_model="numpy")
def _add_skin(
    skin: StackedSkin, body: Ints, motion: _Motion, water: _Water, densities: Array, found: BodyLoads
) -> None:
    """Add drag of water and air on all pieces of skin to `found`, along the bodies' axes; body (P,) of each part."""
    twists = _own_twists(motion)
    slip, along, across, force = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for k in range(len(skin.part)):
        p = skin.part[k]
        b, arm, normal = body[p], skin.center[k], skin.normal[k]
        share = _wet_share(motion.turn[b, 2], skin.corners[k], water.elevation[p] - motion.position[b, 2])
        force[:] = 0.0
        for fluid in range(2):
            weight = 0.5 * densities[fluid] * skin.area[k] * (share if fluid == 0 else 1.0 - share)
            if not weight > 0.0:
                continue
            _slip(motion.turn[b], water.velocity[p] if fluid == 0 else water.wind[p], twists[b], arm, slip)
            through = slip[0] * normal[0] + slip[1] * normal[1] + slip[2] * normal[2]
            for axis in range(3):
                along[axis] = slip[axis] - through * normal[axis]
            speed = np.sqrt(along[0] ** 2 + along[1] ** 2 + along[2] ** 2)
            pressing = 0.5 * weight * skin.drag[p, 0] * abs(through)
            rubbing = weight * skin.drag[p, 1] * speed
            for axis in range(3):
                force[axis] += pressing * through * normal[axis] + rubbing * along[axis]
            _add_along(found.damping[b], arm, normal, 2.0 * pressing)
            if rubbing > 0.0:
                for axis in range(3):
                    along[axis] /= speed
                cross(normal, along, across)
                _add_along(found.damping[b], arm, along, 2.0 * rubbing)
                _add_along(found.damping[b], arm, across, rubbing)
        add_force_at(found.wrench[b], arm, force)


@njit(nogil=True, cache=True, error_model="numpy")
def _wet_share(up: Array, corners: Array, level: float) -> float:
    """Return the share of a triangle's height below `level` [m]; up (3,), corners (3, 3) [m] along a body's axes."""
    low, high = np.inf, -np.inf
    for corner in range(3):
        height = up[0] * corners[corner, 0] + up[1] * corners[corner, 1] + up[2] * corners[corner, 2]
        low, high = min(low, height), max(high, height)
    if level >= high:
        return 1.0
    return 0.0 if level <= low else (level - low) / (high - low)


@njit(nogil=True, cache=True, error_model="numpy")
def _add_along(matrix: Array, arm: Array, direction: Array, value: float) -> None:
    """Add value g g^T to a matrix (6, 6), g the velocity along `direction` (3,) at `arm` (3,) [m] by the twist."""
    lever = np.empty(6)
    lever[:3] = direction
    cross(arm, direction, lever[3:])
    for i in range(6):
        for j in range(6):
            matrix[i, j] += value * lever[i] * lever[j]


@njit(nogil=True, cache=True, error_model="numpy")
def _press(weight: float, area: Array, slip: Array, pressed: Array, slope: Array) -> None:
    """Add weight area |slip| slip (3,) to `pressed` [N] and its derivative by slip to `slope` [kg/s].

    weight: rho / 2 of the wetted or dry share [kg/m3]; area (3,) [m2].
    """
    for axis in range(3):
        change = weight * area[axis] * abs(slip[axis])
        pressed[axis] += change * slip[axis]
        slope[axis] += 2.0 * change


@njit(nogil=True, cache=True, error_model="numpy")
def _into_world(turn: Array, found: BodyLoads) -> None:
    """Turn the loads in `found` from the bodies' axes to the world's; turn (B, 3, 3)."""
    half, vector = np.empty((3, 3)), np.empty(3)
    for b in range(len(turn)):
        for start in (0, 3):
            vector[:] = found.wrench[b, start : start + 3]
            for axis in range(3):
                found.wrench[b, start + axis] = (
                    turn[b, axis, 0] * vector[0] + turn[b, axis, 1] * vector[1] + turn[b, axis, 2] * vector[2]
                )
        for matrix in (found.added_mass[b], found.damping[b]):
            for row in (0, 3):
                for column in (0, 3):
                    _turn_block(turn[b], matrix[row : row + 3, column : column + 3], half)


@njit(nogil=True, cache=True, error_model="numpy")
def _turn_block(turn: Array, block: Array, half: Array) -> None:
    """Replace `block` T (3, 3) by R T R^T; `half` (3, 3) is room for R T."""
    for i in range(3):
        for j in range(3):
            half[i, j] = turn[i, 0] * block[0, j] + turn[i, 1] * block[1, j] + turn[i, 2] * block[2, j]
    for i in range(3):
        for j in range(3):
            block[i, j] = half[i, 0] * turn[j, 0] + half[i, 1] * turn[j, 1] + half[i, 2] * turn[j, 2]
