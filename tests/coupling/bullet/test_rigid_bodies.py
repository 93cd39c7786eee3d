"""Rigid bodies against mechanics: flight, spin, pendulum, chains, contact, prescribed motion, repeatable states."""

from __future__ import annotations

import itertools
import math
import os
import pickle
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from coupling.bullet.pybullet_import import pybullet
from coupling.bullet.rigid_body_participant import RigidBodyParticipant, RigidBodyWorld
from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError
from coupling.master.participant import Causality
from coupling.multibody.prescribed_motion import OscillatingMotion
from coupling.solids.bodies import MassProperties, box, cylinder, mass_properties
from tests.coupling.motions import UniformMotion, WaypointMotion

GRAVITY = 9.81


@pytest.fixture
def world() -> Iterator[RigidBodyWorld]:
    made = RigidBodyWorld()
    yield made
    made.close()


@pytest.fixture
def space() -> Iterator[RigidBodyWorld]:
    made = RigidBodyWorld(gravity=(0.0, 0.0, 0.0))
    yield made
    made.close()


def add_box(world: RigidBodyWorld, name: str, size: tuple[float, float, float] = (1.0, 0.6, 0.3), **options) -> None:
    mesh = box(size)
    world.add_body(name, mesh, mass_properties(mesh, density=options.pop("density", 500.0)), **options)


def test_free_fall_is_exact(world: RigidBodyWorld) -> None:
    # symplectic Euler with step h: v_n = -g n h, z_n = -g h^2 n (n + 1) / 2; no damping takes anything off
    add_box(world, "stone", twist=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0))
    world.advance(5.0)
    step, count = 0.01, 500
    np.testing.assert_allclose(world.twist("stone"), (0.1, 0, -GRAVITY * 5.0, 0, 0, 0), rtol=1e-12, atol=1e-12)
    drop = GRAVITY * step**2 * count * (count + 1) / 2.0
    np.testing.assert_allclose(world.pose("stone")[:3], (0.5, 0.0, -drop), rtol=1e-12, atol=1e-12)


def test_tumbling_keeps_momentum_exactly_and_energy_nearly(space: RigidBodyWorld) -> None:
    # spin about the middle axis is unstable: the box turns over and over. L is constant; the turn is second order
    # in h, so that 10 s at 5 rad/s cost (omega h)^2 ~ 4e-4 of the energy at most
    turned = Rotation.from_euler("xyz", (0.4, 0.2, -0.9)).as_quat()
    add_box(space, "box", orientation=tuple(turned), twist=(0.1, 0.2, 0.3, 1.0, 5.0, 0.2))
    momentum, energy = space.momentum(), space.energy()
    space.advance(10.0)
    np.testing.assert_allclose(space.momentum(), momentum, rtol=1e-12, atol=1e-9)
    assert space.energy() == pytest.approx(energy, rel=4e-4)


def test_axes_of_a_turned_inertia_are_respected(space: RigidBodyWorld) -> None:
    # the same solid described in axes turned by Q against its principal ones moves the same way
    mesh = box((1.0, 0.6, 0.3))
    properties = mass_properties(mesh, density=500.0)
    turn = Rotation.from_euler("xyz", (0.5, -0.3, 0.8))
    tilted = mesh.copy()
    tilted.apply_transform(np.block([[turn.as_matrix(), np.zeros((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]]))
    inertia = turn.as_matrix() @ properties.inertia @ turn.as_matrix().T
    other = MassProperties(mass=properties.mass, center_of_mass=np.zeros(3), inertia=inertia)
    spin = (0.3, 2.0, -1.0)
    space.add_body("straight", mesh, properties, twist=(0.0, 0.0, 0.0, *spin), friction=None)
    back = tuple(turn.inv().as_quat())
    space.add_body("tilted", tilted, other, orientation=back, twist=(0.0, 0.0, 0.0, *spin), friction=None)
    space.advance(2.0)
    np.testing.assert_allclose(space.twist("tilted"), space.twist("straight"), atol=1e-9)
    straight, tilted_pose = (Rotation.from_quat(space.pose(name)[3:]) for name in ("straight", "tilted"))
    np.testing.assert_allclose((tilted_pose * turn).as_matrix(), straight.as_matrix(), atol=1e-9)


def test_collision_shape_lies_along_the_mesh_and_not_along_principal_axes(world: RigidBodyWorld) -> None:
    # a long box at 45 degrees in its own frame stands with its lower corners on the ground
    mesh = box((0.2, 0.2, 1.0))
    mesh.apply_transform(np.block([[Rotation.from_euler("y", 90, True).as_matrix(), np.zeros((3, 1))], [np.eye(4)[3]]]))
    world.add_body(
        "ground", box((10.0, 10.0, 1.0)), mass_properties(box((10, 10, 1)), mass=1.0), (0, 0, -0.5), motion="fixed"
    )
    world.add_body("pole", mesh, mass_properties(mesh, density=500.0), (0.0, 0.0, 0.1))
    world.advance(0.5)
    np.testing.assert_allclose(world.pose("pole")[:3], (0.0, 0.0, 0.1), atol=3e-3)


def test_wrench_adds_its_impulse_exactly(space: RigidBodyWorld) -> None:
    # delta p = F H, delta L = T H, about a body that is spinning already; F is the mean over H and acts all through it
    add_box(space, "hull", twist=(1.0, 0.0, 0.0, 0.5, -1.0, 2.0))
    before = space.momentum()
    space.set_wrench("hull", np.array([10.0, -20.0, 30.0, 1.0, 2.0, -3.0]))
    space.set_applied_wrench("hull", np.array([5.0, 0.0, 0.0, 0.0, 0.5, 0.0]))
    origin_torque = np.zeros(3)
    for _ in range(10):  # the force turns about the origin as the body moves: sum r x F h at the sub-step's start
        origin_torque += np.cross(space.pose("hull")[:3], (15.0, -20.0, 30.0)) / 240.0
        space.advance(1.0 / 240.0)
    change = space.momentum() - before
    np.testing.assert_allclose(change[:3], np.array((15.0, -20.0, 30.0)) * 10.0 / 240.0, rtol=1e-11)
    # x_1 x p_1 = (x_0 + h v_1) x (p_0 + h F) = x_0 x p_0 + h x_0 x F, since v_1 x p_1 = 0
    np.testing.assert_allclose(change[3:], np.array((1.0, 2.5, -3.0)) * 10.0 / 240.0 + origin_torque, rtol=1e-10)


def test_inverse_mass_answers_an_impulse(space: RigidBodyWorld) -> None:
    turned = Rotation.from_euler("xyz", (0.4, 0.2, -0.9)).as_quat()
    add_box(space, "hull", orientation=tuple(turned))
    impulse = np.array([10.0, -20.0, 30.0, 1.0, 2.0, -3.0])
    expected = space.inverse_mass("hull") @ impulse
    space.set_wrench("hull", impulse * 240.0)
    space.advance(1.0 / 240.0)
    # omega_1 = I_1^-1 L, and I_1 has turned by less than omega h
    np.testing.assert_allclose(space.twist("hull"), expected, atol=2e-4)
    np.testing.assert_allclose(space.inverse_mass("hull"), space.inverse_mass("hull").T, atol=1e-15)


def test_free_acceleration_is_what_the_body_does_without_the_fluid(world: RigidBodyWorld) -> None:
    add_box(world, "hull", twist=(0.0, 0.0, 0.0, 0.5, -1.0, 2.0))
    world.set_applied_wrench("hull", np.array([100.0, 0.0, 50.0, 3.0, 0.0, -7.0]))
    expected, before = world.free_acceleration("hull"), world.twist("hull")
    world.advance(1e-4)
    np.testing.assert_allclose((world.twist("hull") - before) / 1e-4, expected, rtol=2e-3, atol=2e-3)


def test_bodies_apart_accelerate_as_each_alone(world: RigidBodyWorld, space: RigidBodyWorld) -> None:
    spins = {"one": (3.0, 2.0, -1.0), "held": (0.0, 0.0, 0.0), "other": (-1.0, 4.0, 2.0)}
    for place, (name, spin) in enumerate(spins.items()):
        add_box(
            world,
            name,
            position=(5.0 * place, 0, 5),
            twist=(0.0, 0.0, 0.0, *spin),
            motion="fixed" if name == "held" else "free",
        )
        world.set_wrench(name, np.arange(6.0))
    add_box(space, "other", position=(0, 0, 5), twist=(0.0, 0.0, 0.0, *spins["other"]))  # as in space, without weight
    alone = np.add(space.free_acceleration("other"), [0.0, 0.0, -9.81, 0.0, 0.0, 0.0])
    assert np.abs(alone[3:]).max() > 1.0
    np.testing.assert_allclose(world.free_acceleration("other"), alone, rtol=1e-14)
    assert not world.free_acceleration("held").any()


@pytest.mark.slow
def test_pendulum_period(world: RigidBodyWorld) -> None:
    # physical pendulum, small swing: T = 2 pi sqrt((I + m l^2) / (m g l)) (1 + theta^2 / 16)
    size, arm, swing = (0.1, 0.1, 0.4), 1.0, 0.1
    inertia = (0.1**2 + 0.4**2) / 12.0
    turned = Rotation.from_euler("y", -swing)
    start = turned.apply((0.0, 0.0, -arm))
    add_box(world, "bob", size, position=tuple(start), orientation=tuple(turned.as_quat()))
    world.add_joint("pivot", "bob", None, (0.0, 0.0, 0.0))
    period = 2.0 * math.pi * math.sqrt((inertia + arm**2) / (GRAVITY * arm)) * (1.0 + swing**2 / 16.0)
    crossings = []
    for index in range(3 * 480):
        before = world.pose("bob")[0]
        world.advance(1.0 / 240.0)
        after = world.pose("bob")[0]
        if before < 0.0 <= after or after < 0.0 <= before:
            crossings.append((index + before / (before - after)) / 240.0)
    assert (crossings[-1] - crossings[0]) * 2.0 / (len(crossings) - 1) == pytest.approx(period, rel=2e-3)


def test_tension_of_a_hanging_chain(world: RigidBodyWorld) -> None:
    # a joint carries the weight of all that hangs below it: T_i = (n - i) m g, far above pybullet's own 120 kN limit
    count = 5
    for index in range(count):
        add_box(world, f"link{index}", (1.0, 1.0, 1.0), density=20000.0, position=(0.0, 0.0, -0.5 - index))
        world.add_joint(f"joint{index}", f"link{index}", f"link{index - 1}" if index else None, (0.0, 0.0, -index))
    for _ in range(240):
        world.advance(1.0 / 60.0)
    tensions = [world.tension(f"joint{index}") for index in range(count)]
    np.testing.assert_allclose(tensions, [(count - i) * 20000.0 * GRAVITY for i in range(count)], rtol=1e-3)
    # the reaction carries the weight, so that nothing is left to accelerate a link
    assert np.abs(world.free_acceleration("link2")).max() < 0.02 * GRAVITY


def test_joints_that_hold_great_loads_lose_no_impulse(space: RigidBodyWorld) -> None:
    # without its joint each of the two would come to 190 m/s in a sub-step, where pybullet clips at 100
    mass, loads = 20.0 * 1e-3, np.array([900.0, -882.0])
    for name, x in (("left", -0.06), ("right", 0.06)):
        add_box(space, name, (0.1, 0.1, 0.1), density=20.0, position=(x, 0.0, 0.0))
    space.add_joint("joint", "left", "right", (0.0, 0.0, 0.0))
    for name, load in zip(("left", "right"), loads, strict=True):
        space.set_wrench(name, np.array([load, 0.0, 0.0, 0.0, 0.0, 0.0]))
    step = 1.0 / 240.0
    space.advance(step)
    momentum = mass * sum(space.twist(name)[0] for name in ("left", "right"))
    assert momentum == pytest.approx(loads.sum() * step, rel=1e-6)


def test_tension_of_a_whirling_stone(space: RigidBodyWorld) -> None:
    # T = m v^2 / r, whatever way the body has turned
    add_box(space, "stone", (0.1, 0.1, 0.1), density=1000.0, position=(2.0, 0.0, 0.0),
            twist=(0.0, 3.0, 0.0, 0.0, 0.0, 1.5))  # fmt: skip
    space.add_joint("string", "stone", None, (0.0, 0.0, 0.0))
    space.advance(1.0)
    speed = np.linalg.norm(space.twist("stone")[:3])
    assert speed == pytest.approx(3.0, rel=1e-2)
    assert space.tension("string") == pytest.approx(speed**2 / 2.0, rel=1e-2)


@pytest.mark.parametrize("count", [20, 60])
def test_long_chains_keep_together(count: int) -> None:
    # a boom of one-metre segments laid out with slack between two held ends and dropped under half a weight
    world = RigidBodyWorld(gravity=(0.0, 0.0, -0.5 * GRAVITY))
    for index in range(count):
        add_box(world, f"segment{index}", (0.9, 0.1, 0.5), density=100.0, position=(index + 0.5, 0.0, 0.0))
        before = f"segment{index - 1}" if index else None
        world.add_joint(f"joint{index}", f"segment{index}", before, (index, 0.0, 0.0))
    for _ in range(120):
        world.advance(1.0 / 60.0)
    ends = [world.pose(f"segment{index}") for index in range(count)]
    left = [pose[:3] + Rotation.from_quat(pose[3:]).apply((-0.5, 0.0, 0.0)) for pose in ends]
    right = [pose[:3] + Rotation.from_quat(pose[3:]).apply((0.5, 0.0, 0.0)) for pose in ends]
    gaps = np.linalg.norm(np.array(left[1:]) - np.array(right[:-1]), axis=1)
    assert gaps.max() < 0.01
    assert left[-1][2] < -1.0
    world.close()


def test_long_steps_see_what_comes_up_on_the_way(world: RigidBodyWorld) -> None:
    # a sheet 1 cm above the ground has 0.4 m/s when it arrives, and in steps chosen for its rest it was thrown up with 40 times its energy
    world.add_half_space((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    add_box(world, "sheet", (0.1, 0.1, 0.002), position=(0.0, 0.0, 0.011))
    begun = world.energy()
    for _ in range(6):
        world.advance(0.05)
        assert world.energy() < begun
    assert world.pose("sheet")[2] == pytest.approx(0.002, abs=1e-3)


def test_a_slack_chain_that_snaps_taut_in_a_long_step_gains_nothing(space: RigidBodyWorld) -> None:
    # eight links in a zigzag, and 1 kN on the last: they swing faster than steps of 10 ms follow as soon as they are taut
    length, pull = 0.3, 1e3
    mesh = box((length, 0.05, 0.05))
    ends = length * np.array([(n * math.sqrt(0.91), 0.3 * (n % 2), 0.0) for n in range(9)])
    for n, (start, end) in enumerate(itertools.pairwise(ends)):
        turn = Rotation.align_vectors([end - start], [(1.0, 0.0, 0.0)])[0].as_quat()
        properties = mass_properties(mesh, mass=(1.0, 5.0)[n % 2])
        space.add_body(f"link{n}", mesh, properties, 0.5 * (start + end), turn, friction=None)
        space.add_joint(f"joint{n}", f"link{n}", f"link{n - 1}" if n else None, start)
    space.set_applied_wrench("link7", np.array([pull, 0.0, 0.0, 0.0, 0.0, 0.0]))
    begun = space.pose("link7")[0]
    for _ in range(6):
        space.advance(0.05)
        # 4.7 times the work with steps chosen for its rest
        assert space.energy() < pull * (space.pose("link7")[0] - begun)


def test_body_at_rest_on_the_ground(world: RigidBodyWorld) -> None:
    add_box(world, "ground", (10.0, 10.0, 1.0), position=(0.0, 0.0, -0.5), motion="fixed")
    add_box(world, "crate", (1.0, 1.0, 1.0), position=(0.0, 0.0, 0.5))
    add_box(world, "ghost", (1.0, 1.0, 1.0), position=(3.0, 0.0, 0.5), friction=None)
    for _ in range(60):
        world.advance(1.0 / 60.0)
    assert world.pose("crate")[2] == pytest.approx(0.5, abs=5e-3)
    assert abs(world.free_acceleration("crate")[2]) < 0.01 * GRAVITY
    assert world.pose("ghost")[2] < -3.0
    np.testing.assert_array_equal(world.pose("ground")[:3], (0.0, 0.0, -0.5))
    assert not world.inverse_mass("ground").any()
    assert not world.free_acceleration("ground").any()


def test_a_half_space_has_no_end(world: RigidBodyWorld) -> None:
    world.add_half_space((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_half_space((5.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
    for name, x, speed in (("near", -0.5, 0.0), ("far", -500.0, 0.0), ("thrown", 3.0, 8.0)):
        add_box(world, name, (0.5, 0.5, 0.5), position=(x, 0.0, 2.0), twist=(speed, 0.0, -4.0, 0.0, 0.0, 0.0))
    for _ in range(120):
        world.advance(1.0 / 60.0)
        assert world.pose("thrown")[0] < 4.8
    for name in ("near", "far", "thrown"):
        assert world.pose(name)[2] == pytest.approx(0.25, abs=0.01)
    assert set(world.body_names) == {"near", "far", "thrown"}


def test_a_small_body_thrown_at_a_wall_does_not_go_half_into_it(space: RigidBodyWorld) -> None:
    """At 6 m/s it goes 2.5 cm in a 240th of a second, more than it is thick."""
    space.add_half_space((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    add_box(space, "chip", (0.02, 0.02, 0.02), position=(0.1, 0.0, 0.0), twist=(-6.0, 0.3, 0.2, 0.0, 0.0, 0.0))
    places = []
    for _ in range(20):
        space.advance(1.0 / 240.0)
        places.append(space.pose("chip")[0])
    assert min(places) > 0.5 * 0.01
    assert places[-1] > 0.01


def test_bodies_that_run_into_something_are_told_with_those_that_hang_on_them(world: RigidBodyWorld) -> None:
    world.add_half_space((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    for name, height in (("lower", 0.2), ("upper", 1.2), ("alone", 5.0)):
        add_box(world, name, (0.2, 0.2, 0.2), position=(1.0 if name == "alone" else 0.0, 0.0, height))
    world.add_joint("link", "lower", "upper", (0.0, 0.0, 0.7))
    assert world.disturbed == ()
    told = []
    for _ in range(20):
        world.advance(1.0 / 60.0)
        told.append(world.disturbed)
    assert told[0] == ()
    assert told[-1] == ("lower", "upper")


def test_overlaps_are_found_with_their_depth(world: RigidBodyWorld) -> None:
    world.add_half_space((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    for name, x, height in (("low", 0.0, 0.4), ("beside", 0.9, 0.5), ("free", 5.0, 2.0)):
        add_box(world, name, (1.0, 1.0, 1.0), position=(x, 0.0, height))
    found = {(one, other): depth for one, other, depth in world.overlaps()}
    assert found[("low", "")] == pytest.approx(0.1, abs=0.01)
    pair = ("low", "beside") if ("low", "beside") in found else ("beside", "low")
    assert found[pair] == pytest.approx(0.1, abs=0.02)
    assert not any("free" in pair for pair in found)


def test_a_jerk_is_told_as_the_mean_of_the_step_to_come() -> None:
    jerk = WaypointMotion(times=(0.0, 0.001, 1.0), positions=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.5, 0.0, 0.0)))
    world = RigidBodyWorld(communication_step=0.05)
    add_box(world, "piston", motion=jerk)
    # taken over a 240th of a second, a fluid that steps by 0.05 s would see it go off at 6 m/s
    assert world.free_acceleration("piston")[0] * 0.05 == pytest.approx(jerk.at(0.05).linear_velocity[0], rel=1e-9)
    world.close()


def test_prescribed_motion_is_followed_exactly_and_tows(world: RigidBodyWorld) -> None:
    motion = UniformMotion(position=(0.0, 0.0, 0.0), linear_velocity=(0.5, 0.0, 0.0), angular_velocity=(0.0, 0.0, 0.1))
    add_box(world, "tug", motion=motion, friction=None)
    add_box(
        world, "barge", (1.0, 1.0, 1.0), density=100.0, position=(0.0, 0.0, -2.0), twist=(0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    )
    world.add_joint("line", "barge", "tug", (0.0, 0.0, 0.0))
    for _ in range(120):
        world.advance(1.0 / 60.0)
    np.testing.assert_allclose(world.pose("tug")[:3], (1.0, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(world.pose("tug")[3:], (0.0, 0.0, math.sin(0.1), math.cos(0.1)), atol=1e-12)
    np.testing.assert_allclose(world.twist("tug"), (0.5, 0.0, 0.0, 0.0, 0.0, 0.1), atol=1e-12)
    # the barge hangs below, carried along at the tug's speed without lag
    np.testing.assert_allclose(world.pose("barge")[:3], (1.0, 0.0, -2.0), atol=1e-3)
    assert world.tension("line") == pytest.approx(100.0 * GRAVITY, rel=1e-3)


MOTIONS = [
    UniformMotion(position=(1.0, 2.0, 3.0), linear_velocity=(0.3, 0.0, -0.1), angular_velocity=(0.2, 0.5, -0.4)),
    OscillatingMotion(position=(0.0, 0.0, 1.0), direction=(1.0, 1.0, 0.0), amplitude=0.3, period=1.7, ramp_time=2.0),
    WaypointMotion(times=(0.0, 1.5, 3.0), positions=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 0.0))),
]


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("time", [-1.0, 0.7, 2.2, 4.0])
def test_twist_of_a_motion_is_the_derivative_of_its_pose(motion: UniformMotion, time: float) -> None:
    step = 1e-5
    before, now, after = (motion.at(time + shift) for shift in (-step, 0.0, step))
    np.testing.assert_allclose(now.linear_velocity, (after.position - before.position) / (2 * step), atol=1e-8)
    turn = Rotation.from_quat(after.orientation) * Rotation.from_quat(before.orientation).inv()
    np.testing.assert_allclose(now.angular_velocity, turn.as_rotvec() / (2 * step), atol=1e-8)


def test_impossible_motions_are_refused() -> None:
    with pytest.raises(ValueError, match=r"period is 0\.0 s, allowed: above 0"):
        OscillatingMotion(position=(0, 0, 0), direction=(1, 0, 0), amplitude=1.0, period=0.0)


def test_state_repeats_bit_for_bit(world: RigidBodyWorld) -> None:
    # a crate and a drum that land on a slope, and a chain: contacts, joints, spin
    add_box(
        world, "slope", (10.0, 10.0, 1.0), orientation=tuple(Rotation.from_euler("y", 0.2).as_quat()), motion="fixed"
    )
    add_box(world, "crate", (0.5, 0.4, 0.3), position=(0.0, 0.0, 0.9), twist=(0.0, 0.0, 0.0, 1.0, 2.0, 3.0))
    drum = cylinder(0.2, 0.5)
    world.add_body("drum", drum, mass_properties(drum, density=300.0), (0.3, 0.1, 1.5))
    add_box(world, "link", (1.0, 0.1, 0.1), position=(0.5, 3.0, 4.0))
    world.add_joint("hook", "link", None, (0.0, 3.0, 4.0))
    world.set_applied_wrench("drum", np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    world.advance(0.3)
    state = pickle.loads(pickle.dumps(world.save_state()))

    def go_on() -> list[np.ndarray]:
        for _ in range(30):
            world.advance(1.0 / 60.0)
        moved = [array for name in world.body_names for array in (world.pose(name), world.twist(name))]
        return [*moved, np.array([world.tension("hook"), world.time])]

    first = go_on()
    world.restore_state(state)
    for again, once in zip(go_on(), first, strict=True):
        np.testing.assert_array_equal(again, once)


def resident() -> float:
    """Memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the system does not tell how much memory is in use")
def test_going_back_many_times_takes_no_memory(world: RigidBodyWorld) -> None:
    add_box(world, "hull")
    mesh = trimesh.creation.icosphere(5)  # the engine's own file has its 20,000 faces
    world.add_body("rock", mesh, mass_properties(mesh, density=2500.0), motion="fixed", position=(5.0, 0.0, 0.0))
    state = world.save_state()
    size = len(world._client._file()) / 2**20
    assert len(state["bullet"]) < 2000
    world.restore_state(state)
    before = resident()
    for _ in range(20):
        world.advance(0.01)
        world.restore_state(state)
    assert size > 1.0 and resident() - before < 5.0 * size


def test_a_runaway_is_an_error_with_a_name(space: RigidBodyWorld) -> None:
    add_box(space, "calm", position=(5.0, 0.0, 0.0))
    add_box(space, "shot")
    participant = RigidBodyParticipant("bodies", space)
    run = CoSimulation([participant], [], 0.01)
    run.initialize()
    space.set_wrench("shot", np.array([1e7, 0, 0, 0, 0, 0]))
    with pytest.raises(CoSimulationError, match=r"'bodies' failed at 0 s: body 'shot' moves at .* allowed: below 100"):
        run.step()


def test_spin_is_followed_up_to_a_radian_in_a_step(space: RigidBodyWorld) -> None:
    # 150 rad/s of a body of 2 cm are 1.5 m/s; what turns fast takes steps of half a millisecond
    add_box(space, "top", (0.02, 0.02, 0.02), twist=(0.0, 0.0, 0.0, 0.0, 0.0, 150.0))
    space.advance(0.5)
    np.testing.assert_allclose(space.twist("top"), (0, 0, 0, 0, 0, 150.0), rtol=1e-9, atol=1e-9)
    space.set_wrench("top", np.array([0, 0, 0, 0, 0, 1.0]))
    with pytest.raises(FloatingPointError, match=r"'top' moves at .* allowed: below 100 m/s and 2e\+03 rad/s"):
        space.advance(0.5)


def test_participant_offers_what_it_says(world: RigidBodyWorld) -> None:
    add_box(world, "boom/segment-01", position=(0.0, 0.0, 2.0))
    world.add_joint("boom/end", "boom/segment-01", None, (0.5, 0.0, 2.0))
    participant = RigidBodyParticipant("bodies", world)
    outputs = {name for name, variable in participant.variables.items() if variable.causality is Causality.OUTPUT}
    body = "boom/segment-01"
    assert outputs == {
        *(f"{body}.{quantity}" for quantity in ("pose", "twist", "inverse_mass", "free_acceleration")),
        "boom/end.tension",
    }
    for name in outputs:
        assert participant.get(name).shape == participant.variables[name].shape
    participant.set(f"{body}.wrench", np.arange(6.0))
    np.testing.assert_array_equal(world.wrench(body), np.arange(6.0))
    with pytest.raises(ValueError, match=r"has no output 'hull\.pose'"):
        participant.get("hull.pose")
    kept = participant.get(f"{body}.pose")
    state = participant.save_state()
    participant.do_step(0.0, 0.1)
    np.testing.assert_array_equal(kept[:3], (0.0, 0.0, 2.0))
    participant.restore_state(state)
    np.testing.assert_array_equal(participant.get(f"{body}.pose"), kept)


def test_wrong_descriptions_are_refused(world: RigidBodyWorld) -> None:
    add_box(world, "hull")
    with pytest.raises(ValueError, match="body 'hull' is added twice"):
        add_box(world, "hull")
    with pytest.raises(ValueError, match="motion of 'raft' is 'floating', allowed: 'free', 'fixed' or a motion"):
        add_box(world, "raft", motion="floating")
    with pytest.raises(ValueError, match="allowed: a unit quaternion"):
        add_box(world, "raft", orientation=(0.0, 0.0, 0.0, 2.0))
    with pytest.raises(ValueError, match="body 'ship' does not exist, allowed: hull"):
        world.add_joint("line", "ship", "hull", (0.0, 0.0, 0.0))
    assert world.joint_names == ()
    world.add_joint("line", "hull", None, (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"sub_step is 0\.0 s, allowed: above 0"):
        RigidBodyWorld(sub_step=0.0)


def test_worlds_do_not_touch_each_other(world: RigidBodyWorld, space: RigidBodyWorld) -> None:
    for each in (world, space):
        add_box(each, "box")
    world.advance(0.1)
    assert space.pose("box")[2] == 0.0
    space.advance(0.1)
    assert space.pose("box")[2] == 0.0


def test_force_that_somebody_else_left_pending_is_found(space: RigidBodyWorld) -> None:
    add_box(space, "hull")
    space.set_wrench("hull", np.array([10.0, 0.0, 0.0, 0.0, 1.0, 0.0]))
    space.advance(0.05)
    bullet, world_frame = space._bodies["hull"].bullet.unique_id, pybullet.WORLD_FRAME
    where = space.pose("hull")[:3].tolist()
    space._client._call(pybullet.applyExternalForce, bullet, -1, (0.0, 0.0, 5.0), where, world_frame)
    with pytest.raises(RuntimeError, match=r"body 'hull' gets an impulse of \[.*\] N s and N m s that no wrench"):
        space.advance(0.05)


def test_step_that_is_broken_off_leaves_no_force_behind_after_a_restore(space: RigidBodyWorld) -> None:
    class Broken(UniformMotion):
        def at(self, time: float):
            if time > 0.02:
                raise ZeroDivisionError("no such time")
            return super().at(time)

    add_box(space, "hull")
    mesh = box((0.1, 0.1, 0.1))
    broken = Broken(position=(5.0, 0.0, 0.0))
    space.add_body("led", mesh, mass_properties(mesh, density=1.0), motion=broken)
    space.set_wrench("hull", np.array([10.0, 0.0, 0.0, 0.0, 1.0, 0.0]))
    state = space.save_state()
    space.advance(0.01)
    expected = space.twist("hull")
    with pytest.raises(ZeroDivisionError):
        space.advance(0.05)
    space.restore_state(state)
    space.advance(0.01)
    np.testing.assert_array_equal(space.twist("hull"), expected)


def test_world_without_free_bodies_takes_no_step_of_the_engine(
    world: RigidBodyWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = []
    monkeypatch.setattr(
        "coupling.bullet.bullet_client.pybullet.stepSimulation", lambda **options: steps.append(options)
    )
    mesh = box((0.1, 0.1, 0.1))
    world.add_body("rock", mesh, mass_properties(mesh, density=1.0), motion="fixed")
    led = UniformMotion(position=(0.0, 0.0, 0.0), linear_velocity=(1.0, 0.0, 0.0))
    world.add_body("piston", mesh, mass_properties(mesh, density=1.0), motion=led)
    world.advance(0.5)
    assert not steps
    np.testing.assert_allclose(world.pose("piston")[:3], (0.5, 0.0, 0.0), atol=1e-12)


def test_tow_line_of_a_few_grams_between_heavy_bodies_does_not_give_way():
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0))
    for name, mass, x in (("vessel", 90.0, 0.0), ("line", 0.03, 0.4), ("boom", 3.0, 0.8)):
        mesh = box((0.4, 0.1, 0.1))
        world.add_body(name, mesh, mass_properties(mesh, mass=mass), (x, 0.0, 0.0), friction=None)
    world.add_joint("at the vessel", "vessel", "line", (0.2, 0.0, 0.0))
    world.add_joint("at the boom", "line", "boom", (0.6, 0.0, 0.0))
    world.set_applied_wrench("vessel", np.array([-200.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    world.set_applied_wrench("boom", np.array([200.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    world.advance(1.0)
    # both are pulled by 200 N, and so is the line between them: it stays as long as it is, 0.4 m from joint to joint
    apart = world.pose("boom")[0] - world.pose("vessel")[0]
    assert apart == pytest.approx(0.8, abs=1e-5)
    assert world.tension("at the boom") == pytest.approx(200.0, rel=1e-3)
    assert world.tension("at the vessel") == pytest.approx(200.0, rel=1e-3)
