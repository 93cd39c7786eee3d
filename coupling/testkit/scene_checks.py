"""Checks of a scene of the test kit against laws of physics; import them from `coupling.testing`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from coupling.testkit.scene import Scene


def assert_draft(scene: Scene, body: str, expected: float, *, within: float) -> None:
    """Require that the body's lowest point lies `expected` [m] below the still-water level, to `within` [m]; AssertionError if not."""
    found = scene.draft(body)
    assert abs(found - expected) <= within, (
        f"draft of {body!r} is {found:.5g} m, expected: {expected:.5g} m within {within:.3g} m"
    )


def assert_momentum_conserved(
    scene: Scene, *, steps: int = 1, within: float = 1e-6, angular_within: float | None = None
) -> None:
    """Require that fluid and bodies, without walls and gravity, keep their momentum in each of the next `steps`.

    within [-]: allowed change of linear momentum in a step, relative to sum m |v| of all particles and free bodies. angular_within [-],
    equal to `within` if None: the same for angular momentum, relative to that sum times the largest distance of one of their points from
    the origin, plus the spin of the bodies. Raises AssertionError if a change is larger, and ValueError for fewer steps than one.
    """
    if steps < 1:
        raise ValueError(f"steps is {steps}, allowed: 1 or more")
    assert scene.simulation.is_running, "scene does not run any more, expected: a run that has not ended"
    limits = within, within if angular_within is None else angular_within
    for _ in range(steps):
        before, earlier = scene.momentum(), _turnover(scene)
        scene.step()
        change, later = scene.momentum() - before, _turnover(scene)
        for part, scale, limit, unit in (
            (change[:3], max(earlier[0], later[0]), limits[0], "N s"),
            (change[3:], max(earlier[1], later[1]), limits[1], "N m s"),
        ):
            worst = float(np.abs(part).max())
            assert worst <= limit * scale, (
                f"momentum changes by {part.tolist()} {unit} in the step to {scene.simulation.communication_point.time:.6g} s, "
                f"where {scale:.3g} {unit} move, expected: {limit:.3g} of that at most"
            )


def _turnover(scene: Scene) -> tuple[float, float]:
    """Return sum m |v| [kg m/s] of particles and free bodies, and that times their reach about the origin plus sum |I omega| [kg m2/s]."""
    state, config = scene.fluid.particles, scene.fluid.config
    mass = config.rest_volume * np.array([phase.rest_density for phase in config.phases])[state.phase]
    moving = float(mass @ np.linalg.norm(state.velocity.astype(np.float64), axis=0))
    reach = float(np.linalg.norm(state.position, axis=0).max(initial=scene.spacing))
    spin = 0.0
    for body in scene.world.free_body_names:
        momentum = scene.world.mass_matrix(body) @ scene.world.twist(body)
        moving += float(np.linalg.norm(momentum[:3]))
        spin += float(np.linalg.norm(momentum[3:]))
        reach = max(reach, float(np.linalg.norm(scene.placed(body).vertices, axis=1).max()))
    return moving, moving * reach + spin


def assert_pressure_hydrostatic(
    scene: Scene, *, at: tuple[float, float], within: float, density: float = 1000.0
) -> None:
    """Require that the pressure below the point `at` (x, y) [m] is rho g (level - z), with rho the `density` [kg/m3].

    The pressure is compared at points one particle spacing apart, from the bottom to two spacings below the level. within [-]: allowed
    error relative to the pressure at the bottom. Raises AssertionError if an error is larger.
    """
    level, bottom, gravity = scene.level(), scene.bottom, abs(scene.fluid.config.gravity[2])
    heights = np.arange(bottom + 0.5 * scene.spacing, level - 2.0 * scene.spacing, scene.spacing)
    assert len(heights), (
        f"water is {level - bottom:.3g} m deep, expected: three spacings, {3 * scene.spacing:.3g} m, or more"
    )
    found = scene.fluid.pressure_at(
        np.column_stack([np.full(len(heights), at[0]), np.full(len(heights), at[1]), heights])
    )
    expected = density * gravity * (level - heights)
    error = np.abs(found - expected) / (density * gravity * (level - bottom))
    worst = int(np.argmax(error))
    assert error[worst] <= within, (
        f"pressure at z = {heights[worst]:.5g} m is {found[worst]:.5g} Pa, expected: {expected[worst]:.5g} Pa within "
        f"{within:.3g} of that at the bottom"
    )
