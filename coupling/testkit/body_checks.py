"""Checks of bodies over time: force, period and damping, terminal speed, added mass, joint gap, tension.

Checks of floating bodies: draft, heel and trim, metacentric height.

Fits to measured signals: plain arrays in, plain numbers out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from coupling.solids.hydrostatics import hydrostatics
from coupling.testkit.readings import BodyTrack, Readings, Track, readings_of
from coupling.testkit.verdict import Context, require_at_most, require_near
from oilsim.backend.arrays import Array, Flags

STARTS = (0.85, 0.92, 1.0, 1.08, 1.15)  # of the guessed period


@dataclass(frozen=True)
class DampedCosine:
    """The function c + a exp(-rate t) cos(omega t + phase): period [s], decay rate [1/s], share of the amplitude lost a period."""

    amplitude: float
    rate: float
    omega: float
    phase: float
    offset: float

    @property
    def period(self) -> float:
        """2 pi / omega [s]."""
        return 2.0 * math.pi / self.omega

    @property
    def loss(self) -> float:
        """1 - exp(-rate T)."""
        return 1.0 - math.exp(-self.rate * self.period)


def fit_damped_cosine(time: ArrayLike, signal: ArrayLike, period: float) -> DampedCosine:
    """Fit a damped cosine by least squares to `signal` (n,) at `time` (n,) [s], from a guessed `period` [s] on.

    Linear in a cos, a sin and c, so only rate and omega are iterated; starts about the guess find the best.
    """
    t, y = np.asarray(time, np.float64), np.asarray(signal, np.float64)

    def linear_part(parameters: Array) -> tuple[Array, Array]:
        rate, omega = parameters
        decay = np.exp(-rate * t)
        basis = np.stack([decay * np.cos(omega * t), decay * np.sin(omega * t), np.ones_like(t)], axis=1)
        weights = np.linalg.lstsq(basis, y, rcond=None)[0]
        return weights, basis @ weights - y

    guess = 2.0 * math.pi / period
    fits = [
        least_squares(lambda p: linear_part(p)[1], (0.05 / period, share * guess), x_scale=(1.0 / period, guess))
        for share in STARTS
    ]
    rate, omega = min(fits, key=lambda fit: fit.cost).x
    cosine, sine, offset = linear_part(np.array([rate, omega]))[0]
    return DampedCosine(
        float(np.hypot(cosine, sine)), float(rate), float(omega), float(np.arctan2(-sine, cosine)), float(offset)
    )


def order_of_convergence(spacing: ArrayLike, error: ArrayLike) -> float:
    """Return the slope [1] of ln error (n,) over ln spacing (n,) [m] by least squares.

    NaN for fewer than two errors or where one is 0 or unknown.
    """
    d, e = np.asarray(spacing, np.float64), np.asarray(error, np.float64)
    if e.size < 2 or not (np.isfinite(e).all() and (e > 0.0).all()):
        return math.nan
    return float(np.polyfit(np.log(d), np.log(e), 1)[0])


Vector = tuple[float, float, float]
Along = Literal["x", "y", "z"]
Quantity = Literal["x", "y", "z", "roll", "pitch", "yaw"]

STEADY_SHARE = 0.25  # of a run, at its end, over which a steady value is taken


def assert_force(
    source: object,
    body: str,
    expected: float | Callable[[Array], Array],
    *,
    along: Along,
    within: float,
    since: float = 0.0,
) -> None:
    """Require that the fluid's force on a body is `expected` [N], to `within` [N]; CheckFailed if not.

    expected: a number, with which the mean force after `since` [s] is compared, or a curve: a function of the times (N,) [s] that returns
    forces (N,) [N], each of which is compared. Raises ValueError if nothing was recorded after `since`.
    """
    readings = readings_of(source)
    track = readings.body(body)
    chosen = _after(track.time, since)
    force, what = track.wrench[chosen, "xyz".index(along)], f"force along {along} on {body!r}"
    if callable(expected):
        _compare_curves(
            what, track.time[chosen], force, np.asarray(expected(track.time[chosen])), within, readings, body
        )
    else:
        require_near(f"mean {what}", float(force.mean()), expected, within, "N", readings.context(body))


def assert_period(
    source: object, body: str, expected: float, *, of: Quantity, within: float, since: float = 0.0
) -> None:
    """Require that a damped oscillation has the period `expected` [s], to `within` [s]; CheckFailed if not.

    of: the coordinate that oscillates, [m] or [rad]. A damped cosine is fitted to it after `since` [s].
    """
    readings = readings_of(source)
    found = _oscillation(readings, body, of, expected, since).period
    require_near(f"period of {body!r} in {of}", found, expected, within, "s", readings.context(body))


def assert_damping(
    source: object, body: str, expected: float, *, of: Quantity, period: float, within: float, since: float = 0.0
) -> None:
    """Require that an oscillation loses `expected` [1] of its amplitude in a period, to `within` [1]; CheckFailed if not.

    of: as in `assert_period`. period [s]: a guess, from which the fit of a damped cosine begins.
    """
    readings = readings_of(source)
    found = _oscillation(readings, body, of, period, since).loss
    require_near(f"damping a period of {body!r} in {of}", found, expected, within, "", readings.context(body))


def assert_terminal_speed(source: object, body: str, expected: float, *, along: Along, within: float) -> None:
    """Require that a body has reached the steady velocity `expected` [m/s], to `within` [m/s]; CheckFailed if not.

    The velocity is the mean over the last quarter of the run, within which it must not change by more than `within`.
    """
    readings = readings_of(source)
    track = readings.body(body)
    late = _after(track.time, track.time[-1] - STEADY_SHARE * (track.time[-1] - track.time[0]))
    speed = track.twist[late, "xyz".index(along)]
    what = f"velocity along {along} of {body!r}"
    change = abs(float(speed[len(speed) // 2 :].mean() - speed[: max(1, len(speed) // 2)].mean()))
    require_at_most(
        f"{what} is not steady: its late change", change, within, "m/s", Context(bodies=(body,), time=readings.time)
    )
    require_near(f"terminal {what}", float(speed.mean()), expected, within, "m/s", readings.context(body))


def assert_added_mass(source: object, body: str, expected: float, *, along: Along, within: float) -> None:
    """Require that a submerged body that moves off from rest carries an added mass of `expected` [kg], to `within` [kg].

    m_a = (F_b - F) / a in the first step, with F the fluid's force, F_b the buoyancy rho g V along z, and a the acceleration. rho is the
    density of the first phase. Raises CheckFailed for another mass, and ValueError for a body that does not begin at rest, or does not
    accelerate.
    """
    readings = readings_of(source)
    track, axis = readings.body(body), "xyz".index(along)
    if len(track.time) < 2 or abs(track.twist[0, axis]) > 1e-9:
        raise ValueError(
            f"added mass of {body!r}: velocity at the start is not 0 or no step was made, allowed: a start from rest"
        )
    acceleration = float((track.twist[1, axis] - track.twist[0, axis]) / (track.time[1] - track.time[0]))
    if abs(acceleration) < 1e-9:
        raise ValueError(
            f"added mass of {body!r}: acceleration along {along} is 0 m/s2, allowed: a body that moves off"
        )
    density = readings.run.phases[0].rest_density
    buoyancy = density * readings.gravity * float(readings.mesh(body).volume) if along == "z" else 0.0
    found = (buoyancy - float(track.wrench[1, axis])) / acceleration
    require_near(f"added mass of {body!r} along {along}", found, expected, within, "kg", readings.context(body))


def assert_joint_gap(
    source: object,
    body_a: str,
    point_a: Vector,
    body_b: str | None,
    point_b: Vector,
    *,
    within: float,
) -> None:
    """Require that the two ends of a joint stay together to `within` [m] all the time; CheckFailed if not.

    point_a, point_b [m]: the ends along the axes of their bodies, from the centre of mass; of the world if body_b is None.
    """
    readings = readings_of(source)
    track = readings.body(body_a)
    ends = _place(track, point_a) - (np.array(point_b) if body_b is None else _place(readings.body(body_b), point_b))
    gaps = np.linalg.norm(ends, axis=1)
    worst = int(np.argmax(gaps))
    names = (body_a,) if body_b is None else (body_a, body_b)
    context = Context(bodies=names, time=float(track.time[worst]))
    require_at_most(
        f"joint of {' and '.join(map(repr, names))}", float(gaps[worst]), within, "m", context, verb="gapes by"
    )


def assert_tension(source: object, name: str, expected: float, *, within: float, since: float = 0.0) -> None:
    """Require that the mean tension after `since` [s] of a line or joint, or of a boom's segment, is `expected` [N], to `within` [N].

    name: of a series `tension/NAME`, or of a body. Raises CheckFailed if not, ValueError for an unknown name.
    """
    readings = readings_of(source)
    series = readings.series.get(f"tension/{name}")
    if series is None and name not in readings.bodies:
        known = [one.removeprefix("tension/") for one in readings.series if one.startswith("tension/")]
        raise ValueError(
            f"{readings.source} has no tension of {name!r}, allowed: {', '.join([*known, *readings.bodies])}"
        )
    track = Track(readings.body(name).time, readings.body(name).tension) if series is None else series
    found = float(track.value[_after(track.time, since)].mean())
    bodies = (name,) if name in readings.bodies else ()
    require_near(f"mean tension of {name!r}", found, expected, within, "N", readings.context(*bodies))


def _compare_curves(
    what: str, time: Array, found: Array, expected: Array, within: float, readings: Readings, body: str
) -> None:
    """Require that two curves (N,) over time (N,) [s] are as near as `within`, in N."""
    if expected.shape != found.shape:
        raise ValueError(f"{what}: the expected curve has shape {expected.shape}, allowed: {found.shape}")
    worst = int(np.argmax(np.abs(found - expected)))
    context = Context(bodies=(body,), time=float(time[worst]), spacing=readings.spacing)
    require_near(what, float(found[worst]), float(expected[worst]), within, "N", context)


def _oscillation(readings: Readings, body: str, of: Quantity, period: float, since: float) -> DampedCosine:
    """Fit a damped cosine to a coordinate after `since` [s]; ValueError for less than half a period."""
    track = readings.body(body)
    chosen = _after(track.time, since)
    if of in ("x", "y", "z"):
        signal = track.pose[chosen, "xyz".index(of)]
    else:
        angles = Rotation.from_quat(track.pose[chosen, 3:]).as_euler("ZYX")
        signal = np.unwrap(angles[:, ("yaw", "pitch", "roll").index(of)])
    seen = float(track.time[chosen][-1] - track.time[chosen][0])
    if not seen > 0.5 * period:
        raise ValueError(
            f"oscillation of {body!r}: {seen:.3g} s were seen, allowed: more than half a period, {0.5 * period:.3g} s"
        )
    return fit_damped_cosine(track.time[chosen] - track.time[chosen][0], signal, period)


def _after(time: Array, since: float) -> Flags:
    chosen = np.asarray(time >= since - 1e-9)
    if not (math.isfinite(since) and chosen.any()):
        last = time[-1] if len(time) else math.nan
        raise ValueError(f"since is {since} s, allowed: up to {last:.6g} s, the end of the run")
    return chosen


def _place(track: BodyTrack, point: Vector) -> Array:
    """Return the places (N, 3) [m] of a point of a body over time."""
    return np.asarray(Rotation.from_quat(track.pose[:, 3:]).apply(np.array(point)) + track.pose[:, :3])


def assert_draft(source: object, body: str, expected: float, *, within: float, level: float | None = None) -> None:
    """Require that the body's lowest point lies `expected` [m] below the still-water level, to `within` [m].

    level [m]: of the still water; by default it follows from the tank and all liquid in it. Raises CheckFailed, an AssertionError, if not.
    """
    readings = readings_of(source)
    found = _level(readings, level) - float(readings.placed(body).bounds[0, 2])
    require_near(f"draft of {body!r}", found, expected, within, "m", readings.context(body))


def assert_heel(source: object, body: str, expected: float, *, within: float) -> None:
    """Require that the body has turned by `expected` [rad] about its own x axis, to `within` [rad]; CheckFailed if not."""
    _assert_angle(readings_of(source), body, 2, "heel", expected, within)


def assert_trim(source: object, body: str, expected: float, *, within: float) -> None:
    """Require that the body has turned by `expected` [rad] about its y axis, bow down positive, to `within` [rad]; CheckFailed if not."""
    _assert_angle(readings_of(source), body, 1, "trim", expected, within)


def assert_metacentric_height(
    source: object, body: str, expected: float, *, within: float, level: float | None = None
) -> None:
    """Require that GM = I / V + z_B - z_G at the draft at which the body floats is `expected` [m], to `within` [m]; CheckFailed if not.

    I [m4]: second moment of the waterplane about the body's x axis; V [m3], z_B [m]: displaced volume and its centre; z_G: centre of mass.
    """
    readings = readings_of(source)
    afloat = hydrostatics(readings.placed(body), _level(readings, level))
    found = afloat.metacentric_height(float(readings.body(body).pose[-1, 2]))
    require_near(f"metacentric height of {body!r}", found, expected, within, "m", readings.context(body))


def _level(readings: Readings, level: float | None) -> float:
    return readings.level() if level is None else level


def _assert_angle(readings: Readings, body: str, axis: int, name: str, expected: float, within: float) -> None:
    """Compare an angle [rad] of yaw, pitch and roll (axis 0, 1, 2), turned in this order."""
    angle = float(Rotation.from_quat(readings.body(body).pose[-1, 3:]).as_euler("ZYX")[axis])
    found = expected + math.remainder(angle - expected, 2.0 * math.pi)
    require_near(f"{name} of {body!r}", found, expected, within, "rad", readings.context(body))
