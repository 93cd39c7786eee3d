"""Checks of the liquid: hydrostatic pressure, leaks, volumes, oil retained.

Checks of waves at gauges: height, and the share that comes back.

Checks of conserved quantities over the next steps of a live run: momentum and energy.
"""

from __future__ import annotations

import math

import numpy as np

from coupling.solids.signed_distance import SignedDistance
from coupling.testkit.readings import Live, Readings, Track, readings_of
from coupling.testkit.verdict import Context, require_at_most, require_near
from oilsim.backend.arrays import Array
from oilsim.sea.regular_waves import wave_number

Vector = tuple[float, float, float]


def assert_pressure_hydrostatic(
    source: object, *, at: tuple[float, float], within: float, density: float = 1000.0, level: float | None = None
) -> None:
    """Require that the pressure below the point `at` (x, y) [m] is rho g (level - z), with rho the `density` [kg/m3].

    The pressure is compared at points one particle spacing apart, from the bottom to two spacings below the level. within [-]: allowed
    error relative to the pressure at the bottom. Raises CheckFailed if an error is larger, and ValueError
    for water less than two and a half spacings deep.
    """
    readings = readings_of(source)
    fluid, bottom = readings.alive("pressures").fluid, 0.0 if readings.basin is None else readings.basin.bottom
    surface, spacing = readings.level() if level is None else level, readings.spacing
    heights = np.arange(bottom + 0.5 * spacing, surface - 2.0 * spacing, spacing)
    if not len(heights):
        raise ValueError(
            f"water is {surface - bottom:.3g} m deep, allowed: more than two and a half spacings, {2.5 * spacing:.3g} m"
        )
    found = fluid.pressure_at(np.column_stack([np.full((len(heights), 2), at), heights]))
    unit_weight = density * readings.gravity
    expected = unit_weight * (surface - heights)
    worst = int(np.argmax(np.abs(found - expected)))
    require_near(
        f"pressure at z = {heights[worst]:.5g} m",
        float(found[worst]),
        float(expected[worst]),
        within * unit_weight * (surface - bottom),
        "Pa",
        readings.context(),
    )


def assert_volume(source: object, expected: float, *, within: float, phase: str | None = None) -> None:
    """Require that there are `expected` [m3] of a phase (None: of all liquid), to `within` [m3]; CheckFailed if not."""
    readings = readings_of(source)
    require_near(
        f"volume of {phase or 'all liquid'}", readings.volume(phase), expected, within, "m3", readings.context()
    )


def assert_no_leak(
    source: object, lower: Vector, upper: Vector, *, phase: str | None = None, at_most: float = 0.0
) -> None:
    """Require that all of a phase (None: of all liquid) is in the box from `lower` to `upper` [m], but for `at_most` [m3].

    The centres of particles count. Raises CheckFailed if more is outside.
    """
    readings = readings_of(source)
    found = readings.volume(phase) - _volume_within(readings, lower, upper, phase)
    what = f"volume of {phase or 'liquid'} outside {lower} to {upper} m"
    require_at_most(what, found, at_most, "m3", readings.context())


def assert_dry(source: object, body: str, *, within: float) -> None:
    """Require that no particle's centre lies deeper in a body than `within` [m]; CheckFailed if one does."""
    readings = readings_of(source)
    points = np.concatenate([readings.particles(one.name) for one in readings.run.phases])
    mesh = readings.placed(body)
    near = points[((points > mesh.bounds[0]) & (points < mesh.bounds[1])).all(axis=1)]
    deepest = -float(SignedDistance(mesh).phi(near).min(initial=0.0)) if len(near) else 0.0
    require_at_most(f"deepest particle in {body!r}", deepest, within, "m", readings.context(body), verb="lies in it by")


def assert_oil_contained(
    source: object,
    expected: float,
    *,
    within: float,
    oil: str = "oil",
    inside: tuple[Vector, Vector] | None = None,
    boom: str | None = None,
) -> None:
    """Require that a share `expected` [1] of the oil is contained, to `within` [1]; CheckFailed if not.

    inside: box (lower, upper) [m] that counts as a boom; or boom: name of a boom, whose account a scenario run keeps. Raises ValueError
    unless one of both is given, and for a run without oil.
    """
    readings = readings_of(source)
    if (inside is None) == (boom is None):
        raise ValueError("oil contained: inside and boom are given both or neither, allowed: one of them")
    if boom is not None:
        prefix = f"{boom}/" if f"{boom}/oil_contained" in readings.series else ""  # none in a run with one boom
        held, lost = (float(readings.one_series(f"{prefix}oil_{what}").value[-1]) for what in ("contained", "lost"))
        if not held + lost > 0.0:
            raise ValueError(f"boom {boom!r} has held 0 m3 of oil so far, allowed: above 0")
        found = held / (held + lost)
    else:
        assert inside is not None
        total = readings.volume(oil)
        if not total > 0.0:
            raise ValueError(f"{readings.source} has 0 m3 of {oil!r}, allowed: above 0")
        found = _volume_within(readings, *inside, oil) / total
    require_near(f"share of {oil} contained", found, expected, within, "", readings.context())


def _volume_within(readings: Readings, lower: Vector, upper: Vector, phase: str | None) -> float:
    names = [one.name for one in readings.run.phases] if phase is None else [phase]
    points = np.concatenate([readings.particles(name) for name in names])
    inside = ((points >= np.array(lower)) & (points <= np.array(upper))).all(axis=1)
    return float(np.count_nonzero(inside)) * readings.run.particle_volume


MOST_ALIKE = (
    0.3  # of |sin k l|; Goda and Suzuki advise distances from 0.05 to 0.45 of a wave, whose sines are 0.31 and more
)


def assert_wave_height(
    source: object, gauge: str, expected: float, *, period: float, within: float, since: float = 0.0
) -> None:
    """Require that the regular wave at a gauge is `expected` [m] high, crest to trough, to `within` [m]; CheckFailed if not.

    The height is twice the amplitude of the harmonic of `period` [s] after `since` [s]. gauge: name of a series `probes/GAUGE`.
    """
    readings = readings_of(source)
    found = 2.0 * abs(harmonic(readings.one_series(f"probes/{gauge}"), period, since))
    require_near(f"wave height at gauge {gauge!r}", found, expected, within, "m", readings.context())


def assert_reflection(
    source: object,
    gauges: tuple[str, str],
    expected: float,
    *,
    apart: float,
    depth: float,
    period: float,
    within: float,
    since: float = 0.0,
) -> None:
    """Require that a share `expected` [1] of the height of a regular wave comes back, to `within` [1]; CheckFailed if not.

    gauges: two series `probes/GAUGE`, the second `apart` [m] further along the incident wave, in water of `depth` [m]. With the harmonics
    a_1, a_2 at both (Goda and Suzuki 1976), the incident wave is (a_2 - a_1 e^{i k l}) / (-2 i sin k l), the
    reflected one (a_2 - a_1 e^{-i k l}) / (2 i sin k l).
    Raises ValueError for gauges that are nearly a multiple of half a wave apart, which cannot tell the two waves apart.
    """
    readings = readings_of(source)
    first, second = (harmonic(readings.one_series(f"probes/{gauge}"), period, since) for gauge in gauges)
    phase = wave_number(period, depth) * apart
    if abs(math.sin(phase)) < MOST_ALIKE:
        raise ValueError(
            f"gauges are {apart:g} m apart, {phase / math.pi:.3g} half waves, allowed: well off whole ones"
        )
    incident = abs(second - first * np.exp(1j * phase))
    reflected = abs(second - first * np.exp(-1j * phase))
    found = reflected / incident
    require_near(
        f"reflected share of the wave at {gauges[0]!r}", float(found), expected, within, "", readings.context()
    )


def harmonic(track: Track, period: float, since: float) -> complex:
    """Return the amplitude a of Re(a e^{i w t}), w = 2 pi / period, by least squares with a mean; ValueError for less than a period."""
    chosen = track.time >= since - 1e-9
    time, value = track.time[chosen], track.value[chosen]
    seen = float(time[-1] - time[0]) if len(time) else 0.0
    if seen < 0.99 * period:
        raise ValueError(f"wave: {seen:.3g} s were seen after {since:g} s, allowed: a period, {period:g} s, or more")
    angle = 2.0 * math.pi / period * time
    basis = np.stack([np.cos(angle), -np.sin(angle), np.ones_like(angle)], axis=1)
    real, imaginary, _ = np.linalg.lstsq(basis, value, rcond=None)[0]
    return complex(real, imaginary)


def assert_momentum_conserved(
    source: object, *, steps: int = 1, within: float = 1e-6, angular_within: float | None = None
) -> None:
    """Require that fluid and bodies, without walls and gravity, keep their momentum in each of the next `steps`.

    within [-]: allowed change of linear momentum in a step, relative to sum m |v| of all particles and free bodies. angular_within [-],
    equal to `within` if None: the same for angular momentum, relative to that sum times the largest distance of a particle or body from
    the origin, plus the spin of the bodies. Raises CheckFailed if a change is larger, ValueError for fewer steps than one, and TypeError
    for a recording.
    """
    live, names = _live(source, "momentum", steps)
    limits = within, within if angular_within is None else angular_within
    for _ in range(steps):
        before, earlier = _momentum(live), _turnover(live)
        live.step()
        change, later = _momentum(live) - before, _turnover(live)
        for part, scale, limit, unit, name in (
            (change[:3], max(earlier[0], later[0]), limits[0], "N s", "momentum"),
            (change[3:], max(earlier[1], later[1]), limits[1], "N m s", "angular momentum"),
        ):
            when = f"in the step to {readings_of(source).time:.6g} s"
            what = (
                f"{name} changes by {part.tolist()} {unit} {when}, where {scale:.3g} {unit} move: its largest component"
            )
            context = Context(bodies=names, time=readings_of(source).time)
            require_at_most(what, float(np.abs(part).max()), limit * scale, unit, context)


def assert_energy_not_created(source: object, *, steps: int = 1, within: float = 1e-3) -> None:
    """Require that fluid and free bodies together gain no energy over the next `steps`, if nothing drives them.

    within [-]: allowed gain since the start, relative to the largest kinetic energy seen. Raises CheckFailed if they gain more, ValueError
    for fewer steps than one, and TypeError for a recording.
    """
    live, names = _live(source, "energy", steps)
    start, largest = _energy(live), 0.0
    for _ in range(steps):
        largest = max(largest, live.fluid.energy().kinetic)
        live.step()
        largest = max(largest, live.fluid.energy().kinetic)
        context = Context(bodies=names, time=readings_of(source).time)
        require_at_most(
            "energy of liquid and bodies", _energy(live) - start, within * largest, "J", context, verb="has grown by"
        )


def _live(source: object, need: str, steps: int) -> tuple[Live, tuple[str, ...]]:
    if steps < 1:
        raise ValueError(f"steps is {steps}, allowed: 1 or more")
    readings = readings_of(source)
    return readings.alive(need), tuple(readings.bodies)


def _momentum(live: Live) -> Array:
    liquid = np.concatenate([live.fluid.momentum(), live.fluid.angular_momentum()])
    return np.asarray(liquid + live.momentum())


def _energy(live: Live) -> float:
    liquid = live.fluid.energy()
    return float(liquid.kinetic + liquid.potential + live.energy())


def _turnover(live: Live) -> tuple[float, float]:
    """Return sum m |v| [kg m/s] of particles and free bodies, and that times their reach about the origin plus the spin [kg m2/s]."""
    state, config = live.fluid.particles, live.fluid.config
    mass = config.rest_volume * np.array([phase.rest_density for phase in config.phases])[state.phase]
    moving = float(mass @ np.linalg.norm(state.velocity.astype(np.float64), axis=0))
    reach = float(np.linalg.norm(state.position, axis=0).max(initial=config.particle_spacing))
    own, spin, far = live.turnover()
    return moving + own, (moving + own) * max(reach, far) + spin
