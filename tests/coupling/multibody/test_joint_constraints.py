"""Jointed bodies answer together: formulas for a rod of two, and pybullet's own joints for a chain."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.multibody.joint_constraints import Articulation, Joints, PointJoint
from coupling.multibody.skyline_cholesky import EnvelopeCholesky, first_entries, skyline_of
from coupling.solids.bodies import box, mass_properties


def chain(count, *, anchored, gravity=(0.0, 0.0, -9.81), sub_step=1e-3):
    """Boxes 0.4 m long in a zigzag along x, held together end to end, the first one perhaps to the world."""
    world = RigidBodyWorld(gravity=gravity, sub_step=sub_step, solver_iterations=500)
    mesh = box((0.4, 0.1, 0.1))
    properties = mass_properties(mesh, mass=2.0)
    for n in range(count):
        world.add_body(f"link-{n}", mesh, properties, (0.4 * n + 0.2, 0.0, 1.0), friction=None)
    for n in range(count - 1):
        world.add_joint(f"joint-{n}", f"link-{n}", f"link-{n + 1}", (0.4 * (n + 1), 0.0, 1.0))
    if anchored:
        world.add_joint("anchor", "link-0", None, (0.0, 0.0, 1.0))
    return world


def test_impulse_along_a_rod_moves_both_halves():
    world = chain(2, anchored=False)
    inverse_mass = world.coupled_inverse_mass(("link-0", "link-1"))
    pull = np.zeros(12)
    pull[0] = 3.0
    answer = inverse_mass @ pull
    # two bodies of 2 kg that cannot part along x: 3 N s / 4 kg each
    assert answer[[0, 6]] == pytest.approx([0.75, 0.75], rel=1e-6)
    assert inverse_mass == pytest.approx(inverse_mass.T, abs=1e-12)
    assert np.linalg.eigvalsh(inverse_mass).min() > -1e-9


def test_bodies_without_joints_answer_alone_and_linear_algebra_has_nothing_to_complain_of(capfd):
    world = chain(1, anchored=False)
    inverse_mass = world.coupled_inverse_mass(("link-0",))
    assert inverse_mass[:3, :3] == pytest.approx(np.eye(3) / 2.0)
    assert world.free_acceleration("link-0") == pytest.approx([0.0, 0.0, -9.81, 0.0, 0.0, 0.0])
    assert "".join(capfd.readouterr()) == ""


def test_impulse_across_opens_the_joint_by_the_textbook_rate():
    world = chain(2, anchored=False)
    push = np.zeros(12)
    push[2] = 1.0
    answer = world.coupled_inverse_mass(("link-0", "link-1")) @ push
    # joint impulse R up on the second: v2 - w2 l = R (1/m + l^2/I) must equal v1 + w1 l = (1 - R)/m - ... of the first
    mass, half, inertia = 2.0, 0.2, 2.0 * (0.4**2 + 0.1**2) / 12.0
    joint = (1.0 / mass) / (2.0 / mass + 2.0 * half**2 / inertia)
    assert answer[2] == pytest.approx((1.0 - joint) / mass, rel=1e-6)
    assert answer[8] == pytest.approx(joint / mass, rel=1e-6)
    # linear momentum is that of the push
    assert mass * (answer[2] + answer[8]) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("anchored", [True, False])
def test_free_acceleration_is_what_the_engine_does(anchored):
    world = chain(5, anchored=anchored)
    push = np.array([10.0, -40.0, 90.0, 1.0, 2.0, -3.0])
    world.set_applied_wrench("link-3", push)
    names = world.body_names
    expected = np.array([world.free_acceleration(name) for name in names])
    before = np.array([world.twist(name) for name in names])
    world.advance(1e-3)
    found = (np.array([world.twist(name) for name in names]) - before) / 1e-3
    # pybullet closes joints by iteration; it stops within a hundredth
    assert found == pytest.approx(expected, abs=1e-2 * np.abs(expected).max())


def test_answer_to_an_impulse_is_what_the_engine_does():
    world = chain(4, anchored=True, gravity=(0.0, 0.0, 0.0))
    names = world.body_names
    expected = world.coupled_inverse_mass(names)[:, 6:12] @ np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]) * 0.1
    world.set_wrench("link-1", np.array([0.0, 0.0, 100.0, 0.0, 0.0, 0.0]))
    world.advance(1e-3)
    found = np.concatenate([world.twist(name) for name in names])
    assert found == pytest.approx(expected, abs=1e-2 * np.abs(expected).max())


def test_swing_of_a_pendulum_is_bounded_by_its_own_and_is_that_of_its_joint_when_looked_at():
    # a thin rod under its upper end: omega^2 = 3 g / 2 l; as if free to turn about its middle, under the same pull, 6 g / l.
    # Both of its swings are as fast, which the fourth root of two counts
    length, gravity = 0.8, 9.81
    rod = box((1e-4, 1e-4, length))
    inverse_inertia = np.linalg.inv(mass_properties(rod, mass=2.0).inertia)[None]
    inverse_mass = np.zeros((6, 6))
    inverse_mass[:3, :3], inverse_mass[3:, 3:] = 0.5 * np.eye(3), inverse_inertia[0]
    joints = Joints([PointJoint(0, -1, np.array([0.0, 0.0, 0.5 * length]), np.array([0.0, 0.0, 0.5 * length]))], 1)
    upright = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    held = Articulation(joints, upright, np.zeros((1, 6)), inverse_mass[None])
    fall = np.array([[0.0, 0.0, -gravity, 0.0, 0.0, 0.0]])
    for enough, square in ((100.0, 6.0 * gravity / length), (1.0, 1.5 * gravity / length)):
        assert held.swing(fall, inverse_inertia, enough) == pytest.approx(2.0**0.25 * np.sqrt(square), rel=1e-6)


def test_light_links_of_a_taut_line_swing_without_gain():
    # 30 g and 0.3 m each, 20 kg below: sqrt(12 T / m l) = 516 rad/s at most, which steps above 4 ms would not follow
    count, length = 10, 0.3
    world = RigidBodyWorld()
    link, load = box((0.02, 0.02, length)), box((0.2, 0.2, 0.2))
    for n in range(count):
        there, aside = (0.0, 0.0, -(n + 0.5) * length), (0.01 * (-1.0) ** n, 0.0, 0.0)
        world.add_body(
            f"link-{n}", link, mass_properties(link, mass=0.03), there, twist=(*aside, 0.0, 0.0, 0.0), friction=None
        )
        world.add_joint(f"joint-{n}", f"link-{n}", f"link-{n - 1}" if n else None, (0.0, 0.0, -n * length))
    world.add_body("load", load, mass_properties(load, mass=20.0), (0.0, 0.0, -count * length - 0.1), friction=None)
    world.add_joint("hook", "load", f"link-{count - 1}", (0.0, 0.0, -count * length))
    begun = world.energy()
    for _ in range(100):
        world.advance(0.01)
        assert (
            world.energy() - begun < 1e-4
        )  # J: of 1.5e-5 in the kick; without shorter steps it has 52 after half a second
    assert world.tension("hook") == pytest.approx(20.0 * 9.81, rel=1e-3)
    world.close()


def test_rows_of_a_chain_stay_short_however_its_joints_come():
    points = np.array([0.2, 0.0, 0.0]), np.array([-0.2, 0.0, 0.0])
    links = np.random.default_rng(1).permutation(59)  # joints of a chain of 60 bodies, in no order
    joints = [PointJoint(int(link), int(link) + 1, *points) for link in links]
    held = Joints(joints, 60)
    pose = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (60, 1))
    jacobian = held.jacobian(held.arms(pose))
    system = jacobian @ jacobian.T
    assert (np.arange(len(system)) - first_entries(system)).max() <= 5  # three rows of a joint, three of its neighbour
    found = Articulation(held, pose, np.zeros((60, 6)), np.eye(360)).inverse_mass()
    alone = Articulation(held, pose, np.zeros((60, 6)), np.tile(np.eye(6), (60, 1, 1))).inverse_mass()
    assert alone == pytest.approx(found, abs=1e-10)
    regular = system + 1e-9 * np.trace(system) / len(system) * np.eye(len(system))
    assert found == pytest.approx(np.eye(360) - jacobian.T @ np.linalg.solve(regular, jacobian), abs=1e-10)


def test_envelope_solves_what_is_full_and_refuses_what_is_not_positive():
    root = np.random.default_rng(2).normal(size=(12, 12))
    right = np.arange(36.0).reshape(12, 3)
    matrix = root @ root.T + np.eye(12)
    factor = EnvelopeCholesky(skyline_of(matrix))
    assert matrix @ factor.solved(right[:, 0]) == pytest.approx(right[:, 0], abs=1e-10)
    half = factor.half_solved(right)
    assert half.T @ half == pytest.approx(right.T @ np.linalg.solve(matrix, right), abs=1e-10)
    with pytest.raises(np.linalg.LinAlgError):
        EnvelopeCholesky(skyline_of(-matrix))


def test_parted_joint_lets_go_and_the_rest_holds():
    """Under a fixed point the first half goes on hanging, and the second falls by g t^2 / 2; a state fits where the joint has parted."""
    world, whole, again = (chain(4, anchored=True) for _ in range(3))
    world.advance(0.05)
    momentum = world.momentum()
    world.part_joint("joint-1")
    assert world.momentum() == pytest.approx(momentum)
    assert world.joint_names == ("joint-0", "joint-2", "anchor")
    before = [0.5 * (world.pose(f"link-{n}")[:3] + world.pose(f"link-{n + 1}")[:3]) for n in (0, 2)]
    falling = 0.5 * (world.twist("link-2")[2] + world.twist("link-3")[2])
    world.advance(0.05)
    after = 0.5 * (world.pose("link-2")[2] + world.pose("link-3")[2])
    assert after - before[1][2] == pytest.approx(falling * 0.05 - 0.5 * 9.81 * 0.05**2, rel=0.02)
    assert np.linalg.norm(world.pose("link-0")[:3] - [0.0, 0.0, 1.0]) == pytest.approx(0.2, abs=1e-3)
    assert world.tension("joint-1") == 0.0 < world.tension("anchor")
    again.part_joint("joint-1")
    again.restore_state(world.save_state())
    for each in (world, again):
        each.advance(0.05)
    assert all(np.array_equal(world.pose(name), again.pose(name)) for name in world.body_names)
    with pytest.raises(ValueError, match="state has joints"):
        whole.restore_state(world.save_state())
    with pytest.raises(ValueError, match="'joint-1' does not hold, allowed: joint-0"):
        world.part_joint("joint-1")
