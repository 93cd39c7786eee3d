"""Shapes and prescribed motions of bodies, against formulas."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.bullet.engine_step import SPEED_LIMIT
from scenarios.schema.bodies import (
    FASTEST,
    BoxBody,
    Fixed,
    PolygonBody,
    RampMotion,
    RockBody,
    RotationMotion,
    SphereBody,
    TableMotion,
)
from scenarios.schema.liquid import FluidSettings, PhaseSettings, SlabFill, Tank
from scenarios.setup.solids.body_motions import TowingMotion, prescribed_motion
from scenarios.setup.solids.body_shapes import body_solid, prism, rock
from scenarios.setup.solids.placed_solids import own_solids
from scenarios.spec.scenario import RunSettings, Scenario
from scenarios.text.problems import ScenarioError


def test_towing_velocity_is_the_derivative_of_the_position() -> None:
    """Central differences of x(t) over 1e-5 s: error O(1e-10) away from the instants where the law changes."""
    motion = TowingMotion(position=(1.0, 2.0, 3.0), velocity=(0.5, 0.0, -0.2), start=0.5, rise_time=1.0, end=3.0)
    h = 1e-5
    for time in (0.2, 0.7, 1.1, 1.49, 2.0, 2.9, 3.5):
        slope = (motion.at(time + h).position - motion.at(time - h).position) / (2.0 * h)
        np.testing.assert_allclose(motion.at(time).linear_velocity, slope, atol=1e-8)


def test_towing_distance() -> None:
    """V (tau - t_r / 2) once risen, and no more after the end: 0.5 (2.5 - 0.5) = 1 m."""
    motion = TowingMotion(position=(0.0, 0.0, 0.0), velocity=(0.5, 0.0, 0.0), start=0.5, rise_time=1.0, end=3.0)
    assert motion.at(3.0).position[0] == pytest.approx(1.0, rel=1e-12)
    assert motion.at(9.0).position[0] == pytest.approx(1.0, rel=1e-12)
    assert not motion.at(9.0).linear_velocity.any()


@pytest.mark.parametrize(
    "motion",
    [
        RotationMotion(axis=(0.0, 1.0, 0.0), center=(0.0, 0.0, 1.0), rate=2.0, start=0.5, rise_time=1.0),
        RotationMotion(axis=(1.0, 2.0, 0.5), center=(0.3, 0.0, 0.0), amplitude=0.4, period=1.3, rise_time=2.0),
        RotationMotion(axis=(0.0, 0.0, 1.0), rate=-3.0),
    ],
)
def test_the_twist_of_a_turn_is_the_derivative_of_its_pose(motion: RotationMotion) -> None:
    body = BoxBody(position=(0, 0, 0), size=(1, 1, 1), motion=motion)
    tilted = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_quat()
    turning = prescribed_motion(body, (1.0, 2.0, 3.0), tuple(tilted.tolist()))
    assert turning is not None
    center = np.array(motion.center or (1.0, 2.0, 3.0))
    h = 1e-5
    for time in (0.2, 0.8, 1.4, 2.7, 4.0):
        before, now, after = (turning.at(time + step) for step in (-h, 0.0, h))
        np.testing.assert_allclose(now.linear_velocity, (after.position - before.position) / (2.0 * h), atol=1e-7)
        turn = Rotation.from_quat(after.orientation) * Rotation.from_quat(before.orientation).inv()
        np.testing.assert_allclose(now.angular_velocity, turn.as_rotvec() / (2.0 * h), atol=1e-7)
        assert np.linalg.norm(now.position - center) == pytest.approx(
            np.linalg.norm(np.array((1.0, 2.0, 3.0)) - center)
        )


def test_a_steady_turn_and_a_swing_have_their_angles() -> None:
    rotor = prescribed_motion(
        BoxBody(position=(0, 0, 0), size=(1, 1, 1), motion=RotationMotion(axis=(0.0, 0.0, 1.0), center=(0.0, 0.0, 0.0), rate=1.0)),
        (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0),
    )  # fmt: skip
    assert rotor is not None
    np.testing.assert_allclose(rotor.at(0.5 * np.pi).position, [0.0, 1.0, 0.0], atol=1e-12)
    for wrong in ({}, {"rate": 1.0, "amplitude": 1.0, "period": 1.0}, {"amplitude": 1.0}, {"rate": 1.0, "period": 2.0}):
        with pytest.raises(ScenarioError, match="allowed"):
            RotationMotion(axis=(0.0, 0.0, 1.0), **wrong)


@pytest.mark.parametrize("step", [1, -1])
def test_a_prism_has_the_volume_of_its_outline_in_either_sense(step: int) -> None:
    outline = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 0.2), (0.0, 1.0))[::step]  # concave
    mesh = prism(outline, 0.5)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(0.5 * (2.0 - 0.5 * 2.0 * 0.8))
    np.testing.assert_allclose(mesh.bounds, [[0.0, -0.25, 0.0], [2.0, 0.25, 1.0]])
    body = PolygonBody(position=(0, 0, 0), outline=outline, width=0.5, motion=Fixed())
    assert body_solid(body).mesh.volume == pytest.approx(mesh.volume)


def test_an_outline_without_area_or_that_crosses_itself_is_refused() -> None:
    with pytest.raises(ScenarioError, match="has no area"):
        PolygonBody(position=(0, 0, 0), outline=((0, 0), (1, 1), (2, 2)), width=1.0, motion=Fixed())
    crossing = ((0, 0), (2, 0), (0.5, 1), (1.5, 1)), ((0, 0), (2, 0), (0.5, 1.0), (1.5, 1.0), (1.0, -1.0))
    touching = ((0, 0), (2, 0), (2, 1), (1, 0), (0, 1)), ((0, 0), (1, 0), (2, 0), (1, 0), (0, 1))
    for outline in (*crossing, *touching):
        with pytest.raises(ScenarioError, match=r"crosses or touches itself|has no area"):
            PolygonBody(position=(0, 0, 0), outline=outline, width=1.0, motion=Fixed())


def test_motions_of_bodies_start_where_the_body_is() -> None:
    ramp = BoxBody(position=(0, 0, 0), size=(1, 1, 1), motion=RampMotion(velocity=(1.0, 0.0, 0.0)))
    table = BoxBody(
        position=(0, 0, 0), size=(1, 1, 1), motion=TableMotion(time=(0.0, 2.0), displacement=((0, 0, 0), (0, 0, 1)))
    )
    fixed = BoxBody(position=(0, 0, 0), size=(1, 1, 1), motion=Fixed())
    place, upright = (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)
    moved = prescribed_motion(ramp, place, upright)
    assert moved is not None
    np.testing.assert_allclose(moved.at(2.0).position, [3.0, 2.0, 3.0])
    lifted = prescribed_motion(table, place, upright)
    assert lifted is not None
    np.testing.assert_allclose(lifted.at(1.0).position, [1.0, 2.0, 3.5])
    assert prescribed_motion(fixed, place, upright) is None


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
    box, ball = own_solids(scenario, [])
    np.testing.assert_allclose(box.world_mesh().extents, [0.2, 0.6, 0.1], atol=1e-12)
    np.testing.assert_allclose(box.world_mesh().bounds.mean(axis=0), [1.0, 1.0, 0.7], atol=1e-12)
    assert box.placed.mass_properties.mass == pytest.approx(300.0 * 0.012)
    assert ball.placed.mass_properties.mass == pytest.approx(2.0)
