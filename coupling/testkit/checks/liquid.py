"""Checks of the liquid: hydrostatic pressure, leaks, volumes, oil retained."""

from __future__ import annotations

import numpy as np

from coupling.solids.signed_distance import SignedDistance
from coupling.testkit.readings import Readings
from coupling.testkit.sources import readings_of
from coupling.testkit.verdict import require_at_most, require_near

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


def assert_oil_retained(
    source: object,
    expected: float,
    *,
    within: float,
    oil: str = "oil",
    inside: tuple[Vector, Vector] | None = None,
    boom: str | None = None,
) -> None:
    """Require that a share `expected` [1] of the oil is retained, to `within` [1]; CheckFailed if not.

    inside: box (lower, upper) [m] that counts as retained; or boom: name of a boom, whose account a scenario run keeps. Raises ValueError
    unless one of both is given, and for a run without oil.
    """
    readings = readings_of(source)
    if (inside is None) == (boom is None):
        raise ValueError("oil retained: inside and boom are given both or neither, allowed: one of them")
    if boom is not None:
        prefix = f"{boom}/" if f"{boom}/oil_retained" in readings.series else ""  # none in a run with one boom
        retained, lost = (float(readings.one_series(f"{prefix}oil_{what}").value[-1]) for what in ("retained", "lost"))
        if not retained + lost > 0.0:
            raise ValueError(f"boom {boom!r} has held 0 m3 of oil so far, allowed: above 0")
        found = retained / (retained + lost)
    else:
        assert inside is not None
        total = readings.volume(oil)
        if not total > 0.0:
            raise ValueError(f"{readings.source} has 0 m3 of {oil!r}, allowed: above 0")
        found = _volume_within(readings, *inside, oil) / total
    require_near(f"share of {oil} retained", found, expected, within, "", readings.context())


def _volume_within(readings: Readings, lower: Vector, upper: Vector, phase: str | None) -> float:
    names = [one.name for one in readings.run.phases] if phase is None else [phase]
    points = np.concatenate([readings.particles(name) for name in names])
    inside = ((points >= np.array(lower)) & (points <= np.array(upper))).all(axis=1)
    return float(np.count_nonzero(inside)) * readings.run.particle_volume
