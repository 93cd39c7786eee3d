"""Checks of conserved quantities over the next steps of a live run: momentum and energy."""

from __future__ import annotations

import numpy as np

from coupling.testkit.readings import Array, Live
from coupling.testkit.sources import readings_of
from coupling.testkit.verdict import Context, require_at_most


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
