"""Shapes of bodies against formulas, and how fast bodies may start."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.bullet.engine_step import SPEED_LIMIT
from scenarios.schema.bodies import (
    FASTEST,
    BoxBody,
    Fixed,
    RockBody,
    SphereBody,
)
from scenarios.schema.liquid import FluidSettings, PhaseSettings, SlabFill, Tank
from scenarios.setup.solids.placed_solids import body_solid, own_solids, rock
from scenarios.spec.scenario import RunSettings, Scenario


def test_rock_is_closed_has_its_size_and_follows_its_seed() -> None:
    mesh = rock((0.5, 0.4, 0.3), 0.2, 7)
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.extents, [0.5, 0.4, 0.3], rtol=1e-12)
    np.testing.assert_array_equal(mesh.vertices, rock((0.5, 0.4, 0.3), 0.2, 7).vertices)
    assert np.abs(mesh.vertices - rock((0.5, 0.4, 0.3), 0.2, 8).vertices).max() > 0.01


def test_smooth_rock_is_an_ellipsoid() -> None:
    """Volume pi / 6 a b c, less the facets' share, O(1 / triangles) = 0.2 %."""
    body = RockBody(position=(0, 0, 0), size=(0.5, 0.4, 0.3), roughness=0.0, motion=Fixed())
    assert body_solid(body).volume == pytest.approx(np.pi / 6.0 * 0.5 * 0.4 * 0.3, rel=3e-3)


def test_a_body_may_start_no_faster_than_a_run_follows() -> None:
    assert FASTEST < SPEED_LIMIT


def test_body_is_placed_by_the_origin_of_its_shape_and_turned() -> None:
    """Yaw by 90 degrees turns a box's long side from x to y; density gives the mass."""
    scenario = Scenario(
        name="one-box",
        run=RunSettings(duration=1.0),
        fluid=FluidSettings(particle_spacing=0.1),
        phases={"water": PhaseSettings(density=1000.0, dynamic_viscosity=1e-3)},
        tank=Tank(lower=(0, 0, 0), upper=(2, 2, 2)),
        fill={"water": SlabFill(phase="water", bottom=0.0, top=0.5)},
        bodies={
            "box": BoxBody(position=(1.0, 1.0, 0.7), size=(0.6, 0.2, 0.1), density=300.0, rotation=(0, 0, np.pi / 2)),
            "ball": SphereBody(position=(0.5, 0.5, 1.5), radius=0.1, mass=2.0),
        },
    )
    box, ball = own_solids(scenario.bodies, [])
    np.testing.assert_allclose(box.world_mesh().extents, [0.2, 0.6, 0.1], atol=1e-12)
    np.testing.assert_allclose(box.world_mesh().bounds.mean(axis=0), [1.0, 1.0, 0.7], atol=1e-12)
    assert box.placed.mass_properties.mass == pytest.approx(300.0 * 0.012)
    assert ball.placed.mass_properties.mass == pytest.approx(2.0)
