"""The sea as a function of place and time: a frozen description, evaluated at any points."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from oilsim.backend.jit import FAST
from oilsim.sea.description import Continuation, SeaDescription, profile
from oilsim.sea.flows import SteadyFlow
from oilsim.sea.jonswap import JonswapWaves
from oilsim.sea.linear_waves import WaveField, linear_field, sine_cosine, sum_elevation
from oilsim.sea.regular_waves import RegularWaves
from oilsim.sea.wave_components import NO_WAVES, WaveComponents
from oilsim.sea.wind_stress import LARGEST_NUMBER, WEAKEST_WIND, langmuir_number

Double = NDArray[np.float64]


class Kinematics(NamedTuple):
    """The motion of the sea at points: elevation (N,) [m], pressure (N,) [Pa], velocity and acceleration (N, 3) [m/s], [m/s2].

    `Sea` tells what each of them is.
    """

    elevation: Double
    velocity: Double
    acceleration: Double
    pressure: Double


class Sea:
    """Current, wind and waves by formulas. It has no state: equal descriptions give equal values, whatever was asked before.

    Points are (N, 3) [m] in the world, z up, or (N, 2) where only the place matters. Instead of N there may be any number of axes, also
    none for a single point; results have the same.
    Time is in s since the start of the run.

    elevation     (N,) [m] height of the surface in the world
    velocity      (N, 3) [m/s] current, drift of the wind, and orbital motion of the waves
    acceleration  (N, 3) [m/s2] rate of the velocity seen by a point that the current carries, to first order: the share of the waves, and
                  the rate of the current; the convective term of the orbital motion and the rate of the wind's drift are left out
    pressure      (N,) [Pa] above that of the air, the hydrostatic one included. Above the surface it goes on linearly below 0, so that
                  its zero is the surface; it is no pressure there
    wind          (N, 2) [m/s] at 10 m, gusts included
    surface_drift (N, 2) [m/s] of what floats, beyond the current: drift of the wind, Stokes drift, Langmuir cells

    Above the surface the water's values are those at the surface, below the bottom those at the bottom. Raises ValueError for waves that
    cannot be, for points of another shape or that are not finite, and for times outside of a table.
    """

    def __init__(self, description: SeaDescription) -> None:
        self.description = description
        self._water = description.water
        waves = description.waves
        self._waves = NO_WAVES if waves is None else self._components(waves)
        if description.carried.turn:
            self._waves = self._waves._replace(phase=self._waves.phase + description.carried.turn)
        self._wheeler = waves is None or waves.stretching == "wheeler"
        wind = description.wind
        self._mean_wind = np.zeros(2) if wind is None else wind.flow.mean()
        speed = math.hypot(*self._mean_wind)
        self._gusts = wind.gusts.components(speed) if wind is not None and wind.gusts is not None else None
        self._downwind = self._mean_wind / speed if speed > 0.0 else np.array([1.0, 0.0])

    def _components(self, waves: RegularWaves | JonswapWaves) -> WaveComponents:
        flow = self.description.carried.made_in or self.description.surface_current
        return waves.components(self._water, flow, self.description.shear_exponent)

    def followed_by(self, description: SeaDescription, time: float, place: Double) -> Sea:
        """Return the sea of another description in which the patterns of this go on from where they are at `time` [s], in its stream.

        Waves of the same lengths do so everywhere; waves of as many other lengths, and gusts, whose lengths grow with the wind, at a
        `place` (2,) [m]. Waves of another number begin anew.
        """
        after = Sea(replace(description, carried=Continuation()))
        carried = self.description.carried
        x, y = (self._own_travel(time) - after._own_travel(time)).tolist()
        goes_on = Continuation(
            way=(carried.way[0] + x, carried.way[1] + y),
            lead=carried.lead + (after._arrival(place) - self._arrival(place)),
            made_in=self._made_in(),
        )
        after = Sea(replace(description, stream=self.description.stream, carried=goes_on))
        turn = self._turn_of(after, time, place)
        return after if not turn else Sea(replace(after.description, carried=replace(goes_on, turn=turn)))

    def _turn_of(self, after: Sea, time: float, place: Double) -> tuple[float, ...]:
        """Return the lead [rad] of phases with which the waves `after` are in step with these at a place (2,) [m] and `time` [s]."""
        old, new = self._waves, after._waves
        if old.phase.size != new.phase.size:
            return ()
        if np.array_equal(old.wave_number, new.wave_number):
            return self.description.carried.turn
        angle, begun = (sea._angle_at(place, time) for sea in (self, after))
        return tuple(np.remainder(angle - begun, 2.0 * np.pi).tolist())

    def _angle_at(self, place: Double, time: float) -> Double:
        """Return the angle (M,) [rad] of each component at a place (2,) [m]."""
        waves = self._waves
        return waves.wave_number * (waves.toward_x * place[0] + waves.toward_y * place[1]) - self._phase(time)

    def _made_in(self) -> SteadyFlow | None:
        """Return the current in which the lengths of the waves were made; None where these do not depend on it."""
        waves, flow = self.description.waves, self.description.surface_current
        if waves is None or waves.seen_from == "water":
            return None
        own = flow if isinstance(flow, SteadyFlow) else SteadyFlow(speed=0.0)
        return self.description.carried.made_in or own

    def _arrival(self, place: Double) -> float:
        """Return the time [s] that gusts take from the origin to a place (2,) [m]; 0 without a wind."""
        speed = math.hypot(*self._mean_wind)
        return float(place @ self._downwind) / speed if speed > 0.0 else 0.0

    @property
    def level(self) -> float:
        """Height of the still water [m] in the world."""
        return self.description.level

    def rise(self, time: float) -> float:
        """Return the height [m] of the still water at `time` [s] above `level`, by the tide."""
        tide = self.description.tide
        return 0.0 if tide is None else tide.rise(time)

    def still_level(self, time: float) -> float:
        """Return the height [m] of the still water in the world at `time` [s]."""
        return self.level + self.rise(time)

    @property
    def components(self) -> WaveComponents:
        """The regular waves that the sea is made of, (M,) each: [m], [1/m], [rad/s], [rad]."""
        return self._waves

    def kinematics(self, xyz: ArrayLike, time: float) -> Kinematics:
        """Evaluate elevation, velocity, acceleration and pressure at points (N, 3) [m] together; it costs as much as one of them."""
        points, shape = _points(xyz, 3, time)
        rise = self.rise(time)
        if rise != 0.0:
            points = points - (0.0, 0.0, rise)
        field = self._wave_field(points, time)
        self._add_currents(field, points, time)
        if rise != 0.0:
            field.elevation[:] += rise
        return Kinematics(
            field.elevation.reshape(shape),
            field.velocity.reshape(*shape, 3),
            field.acceleration.reshape(*shape, 3),
            field.pressure.reshape(shape),
        )

    def elevation(self, xy: ArrayLike, time: float) -> Double:
        """Return the height of the surface (N,) [m] at places (N, 2) or points (N, 3) [m]."""
        points, shape = _points(xy, 2, time)
        eta, phase, waves = np.empty(len(points)), self._phase(time), self._grown(self.description.growth(time)[0])
        sum_elevation(points, waves, phase, eta)
        return (eta + self.still_level(time)).reshape(shape)

    def grid_elevation(self, x: Double, y: Double, time: float) -> Double:
        """Return the height of the surface (N, M) [m] at the crossings of grid lines x (N,) and y (M,) [m], increasing.

        It is the sum of `elevation`, as products of one factor for each direction: the cost grows with N + M. A wave that the lines cannot
        show is left out there: along a line it fades from 4 spacings a wave length to 2. Raises ValueError as `elevation` does.
        """
        lines, _ = _points(np.stack([np.r_[x, y], np.zeros(len(x) + len(y))], axis=-1), 2, time)
        waves, phase = self._waves, self._phase(time)
        amplitude, k_x, k_y = waves.amplitude, waves.wave_number * waves.toward_x, waves.wave_number * waves.toward_y
        along = _line_factors(lines[: len(x), 0], k_x) * (amplitude * np.exp(-1j * phase))
        return (along @ _line_factors(lines[len(x) :, 0], k_y).T).real + self.still_level(time)

    def velocity(self, xyz: ArrayLike, time: float) -> Double:
        """Return the velocity of the water (N, 3) [m/s] at points (N, 3) [m]."""
        return self.kinematics(xyz, time).velocity

    def acceleration(self, xyz: ArrayLike, time: float) -> Double:
        """Return the acceleration of the water (N, 3) [m/s2] at points (N, 3) [m]."""
        return self.kinematics(xyz, time).acceleration

    def pressure(self, xyz: ArrayLike, time: float) -> Double:
        """Return the pressure above that of the air (N,) [Pa], the hydrostatic one included, at points (N, 3) [m]."""
        return self.kinematics(xyz, time).pressure

    def current(self, z: ArrayLike, time: float, places: Double | None = None) -> Double:
        """Return the current without waves and wind (N, 2) [m/s] at heights (N,) [m] in the world.

        places (N, 2) [m], or (2,) for a single height; None: far from land, or at the origin of a table.
        """
        current, z = self.description.current, np.asarray(z, np.float64)
        if current is None:
            return np.zeros((*z.shape, 2))
        still = np.clip(z - self.still_level(time), -self._water.depth, 0.0)
        share = profile(still, self._water.depth, current.shear_exponent)
        velocity, stream = current.flow.velocity(time), self.description.stream
        if stream is not None and places is not None:
            velocity = stream.current(velocity, np.atleast_2d(places), time)
        return share[..., None] * velocity

    def mean_wind(self, time: float) -> Double:
        """Return the wind without gusts (2,) [m/s] at 10 m; zeros without a wind."""
        wind = self.description.wind
        return np.zeros(2) if wind is None else wind.flow.velocity(time)

    def wind(self, xy: ArrayLike, time: float) -> Double:
        """Return the wind (N, 2) [m/s] at 10 m above places (N, 2) or points (N, 3) [m], gusts included."""
        points, shape = _points(xy, 2, time)
        factor = np.ones(len(points))
        if self._gusts is not None:
            along = points[:, 0] * self._downwind[0] + points[:, 1] * self._downwind[1]
            add_gusts(along, self._gusts, time + self.description.carried.lead, factor)
        return (factor[:, None] * self.mean_wind(time)).reshape(*shape, 2)

    def surface_drift(self, xy: ArrayLike, time: float) -> Double:
        """Return the velocity (N, 2) [m/s] of what floats at places (N, 2) or points (N, 3) [m], beyond the current."""
        points, shape = _points(xy, 2, time)
        drift = np.tile(self.wind_drift(0.0, time) + self._surface_stokes_drift, (len(points), 1))
        cells, speed = self.description.langmuir, math.hypot(*self.mean_wind(time))
        if cells is not None and speed >= WEAKEST_WIND and self.langmuir_number(time) < LARGEST_NUMBER:
            drift += cells.velocity(points[:, :2] - self.travel(time), self._downwind, speed)
        return drift.reshape(*shape, 2)

    def wind_drift(self, depth: ArrayLike, time: float) -> Double:
        """Return the drift of the wind (N, 2) [m/s] at depths (N,) [m] below the surface; it follows the mean wind at once."""
        wind, depth = self.description.wind, np.asarray(depth, np.float64)
        if wind is None or wind.drift is None:
            return np.zeros((*depth.shape, 2))
        return wind.drift.velocity(depth, wind.flow.velocity(time), self._water.density)

    def stokes_drift(self, z: ArrayLike) -> Double:
        """Return the Stokes drift of the waves (N, 2) [m/s] at heights (N,) [m] in the world.

        That of a spectrum holds the tail up to the spectrum's cut and no more.
        """
        still = np.clip(np.asarray(z, np.float64) - self._water.level, -self._water.depth, 0.0)
        return self._waves.stokes_drift(self._water.depth, still)

    @cached_property
    def _surface_stokes_drift(self) -> Double:
        return self.stokes_drift(self._water.level)

    def langmuir_number(self, time: float) -> float:
        """Return the turbulent Langmuir number [-] of the mean wind and the Stokes drift at the surface; infinite without waves."""
        return langmuir_number(
            math.hypot(*self.mean_wind(time)), math.hypot(*self._surface_stokes_drift), self._water.density
        )

    def travel(self, time: float) -> Double:
        """Return the way (2,) [m] of the surface current since time 0, that in the seas before this one included."""
        return self._own_travel(time) + self.description.carried.way

    def _own_travel(self, time: float) -> Double:
        """Return the way (2,) [m] of the surface current since time 0, had it always been this one."""
        flow = self.description.surface_current
        return np.zeros(2) if flow is None else flow.travel(time)

    def _phase(self, time: float) -> Double:
        return self._waves.phase_at(time, self.travel(time))

    def _wave_field(self, points: Double, time: float) -> WaveField:
        share, rate = self.description.growth(time)
        waves = self._grown(share)
        phase = self._phase(time) if waves.amplitude.size else np.zeros(0)
        field = linear_field(points, waves, phase, self._water, wheeler=self._wheeler)
        if rate > 0.0:
            field.acceleration[:] += rate / share * field.velocity
        return field

    def _grown(self, share: float) -> WaveComponents:
        """Return the waves at a share of their height."""
        return self._waves if share == 1.0 else self._waves._replace(amplitude=share * self._waves.amplitude)

    def _add_currents(self, field: WaveField, points: Double, time: float) -> None:
        """Add the current and the drift of the wind to the waves' field, each at its depth below the moving surface."""
        current, wind = self.description.current, self.description.wind
        if current is not None:
            share: Double | float = 1.0
            if current.shear_exponent:
                share = profile(field.stretched, self._water.depth, current.shear_exponent)[:, None]
            velocity, rate, stream = current.flow.velocity(time), current.flow.rate(time), self.description.stream
            if stream is not None:
                velocity, rate = stream.current(velocity, points, time), stream.current_rate(rate, points, time)
            field.velocity[:, :2] += share * velocity
            field.acceleration[:, :2] += share * rate
        if wind is not None and wind.drift is not None:
            layer = wind.drift.layer_under(wind.flow.velocity(time), self._water.density)
            add_drift(points[:, 2], field.elevation, layer, field.velocity)


def _line_factors(lines: Double, wave_number: Double) -> NDArray[np.complex128]:
    """Compute exp(i k x) (N, M) at grid lines x (N,) [m] for wave numbers k (M,) [1/m], faded where the lines are too far apart."""
    spacing = np.gradient(lines)[:, None] if len(lines) > 1 else np.zeros((len(lines), 1))
    shown = np.clip(2.0 - 2.0 * np.abs(wave_number) * spacing / np.pi, 0.0, 1.0)  # 1 at pi / 2 a spacing, 0 at pi
    return np.asarray(shown * np.exp(1j * lines[:, None] * wave_number))


def _points(given: ArrayLike, least: int, time: float) -> tuple[Double, tuple[int, ...]]:
    """Return points as (N, 2 or 3) [m], and their leading shape; ValueError for another shape or for values that are not finite."""
    points = np.asarray(given, np.float64)
    if points.ndim < 1 or not least <= points.shape[-1] <= 3:
        allowed = "(..., 3)" if least == 3 else "(..., 2) or (..., 3)"
        raise ValueError(f"sea: points have the shape {points.shape}, allowed: {allowed}, in m")
    if not math.isfinite(time):
        raise ValueError(f"sea: time is {time}, allowed: finite, in s")
    # of one layout, for which the kernels are compiled already
    flat = np.require(points.reshape(-1, points.shape[-1]), requirements=["C", "W"])
    if not math.isfinite(flat.sum()):
        row = np.flatnonzero(~np.isfinite(flat).all(1))[0]
        raise ValueError(f"sea: point {row} is {tuple(flat[row].tolist())}, allowed: finite, in m")
    return flat, points.shape[:-1]


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
