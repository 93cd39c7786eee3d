"""Steps without the engine move bodies as steps with it, and are left where bodies could touch."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.multibody.broad_phase import BroadPhase
from coupling.solids.bodies import mass_properties
from oilsim.loads.load_model import LoadModel, Part
from oilsim.loads.morison import FloatingBodies
from tests.seas import steady_sea

SIZE = np.array((2.0, 1.0, 0.5))
MESH = trimesh.creation.box(SIZE)
STILL = np.zeros((2, 6))


def chain_afloat(gap: float = 0.0) -> RigidBodyWorld:
    """Two boxes joined end to end and a third one by itself, all turning and pulled, in a sea that carries them; gap [m] to the third."""
    part = Part(
        triangles=np.array(MESH.triangles, dtype=np.float64),
        added_mass=np.array((0.0, 100.0, 300.0)),
        wave_damping=np.array((0.0, 0.0, 50.0)),
        design_volume=0.5,
    )
    world = RigidBodyWorld(sub_step=0.02)
    for n, x in enumerate((0.0, 2.0, 4.5 + gap)):
        spin = (0.05, -0.1, 0.2, 0.3, 0.2, -0.1)
        world.add_body(f"box {n}", MESH, mass_properties(MESH, density=500.0), (x, 0.0, 0.02), twist=spin)
        world.set_applied_wrench(f"box {n}", np.array((50.0, 20.0 * n, 0.0, 10.0, 0.0, 30.0)))
    world.add_joint("joint", "box 0", "box 1", (1.0, 0.0, 0.0))
    names = list(world.body_names)
    world.set_environment(FloatingBodies([LoadModel(parts=(part,))] * 3, steady_sea(density=1000.0)), names)
    return world


def motion_of(world: RigidBodyWorld) -> np.ndarray:
    return np.array([np.concatenate([world.pose(name), world.twist(name)]) for name in world.body_names])


def test_bodies_move_as_with_the_engine(monkeypatch):
    """The same equations; the engine closes the drift of joints once more, by a fifth in a step, which leaves 0.1 mm in 2 s."""
    worlds = [chain_afloat(gap=3.0), chain_afloat(gap=3.0)]
    for world, forced in zip(worlds, (True, False), strict=True):
        with monkeypatch.context() as patch:
            if forced:
                patch.setattr(BroadPhase, "any_near", lambda *arguments: True)
            for _ in range(100):
                world.advance(0.02)
    with_engine, without = (motion_of(world) for world in worlds)
    assert without[2] == pytest.approx(with_engine[2], abs=1e-8)  # free of joints
    assert without == pytest.approx(with_engine, abs=2e-4)
    for world in worlds:
        world.close()


def test_engine_follows_where_bodies_touch():
    """Two boxes that drift into each other do not pass: the engine takes over before they touch, from where they then are."""
    world = chain_afloat(gap=0.5)
    for name in world.body_names:
        world.set_applied_wrench(name, np.array((-400.0 if name == "box 2" else 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    touched = False
    for _ in range(400):
        world.advance(0.02)
        touched |= "box 2" in world.disturbed
    gap = world.pose("box 2")[0] - world.pose("box 1")[0]
    world.close()
    assert touched
    assert gap > 0.9  # half a box's breadth each, at any turn


def test_saved_world_goes_on_bit_for_bit_after_steps_without_the_engine():
    world = chain_afloat(gap=0.3)
    for _ in range(20):
        world.advance(0.02)
    state = world.save_state()
    ends = []
    for _ in range(2):
        for _ in range(60):
            world.advance(0.02)
        ends.append(motion_of(world))
        world.restore_state(state)
    world.close()
    assert np.array_equal(*ends)


@pytest.mark.parametrize(
    ("place", "near"),
    [((2.05, 0.0, 0.0), True), ((2.15, 0.0, 0.0), False), ((0.0, 1.05, 0.0), True), ((0.0, 1.15, 0.0), False)],
)
def test_boxes_are_near_within_a_tenth_of_a_metre(place, near):
    broad_phase = BroadPhase()
    for _ in range(2):
        broad_phase.add_body(MESH.bounds, is_free=True, touches=True)
    pose = np.array([(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), (*place, 0.0, 0.0, 0.0, 1.0)])
    assert broad_phase.any_near(pose, STILL, 0.02) is near
    broad_phase.keep_apart(0, 1)
    assert not broad_phase.any_near(pose, STILL, 0.02)


@pytest.mark.parametrize(("height", "near"), [(0.3, True), (0.4, False)])
def test_box_is_near_a_half_space_within_a_tenth_of_a_metre(height, near):
    broad_phase = BroadPhase()
    broad_phase.add_body(MESH.bounds, is_free=True, touches=True)
    broad_phase.add_half_space(np.zeros(3), np.array((0.0, 0.0, 1.0)))
    assert broad_phase.any_near(np.array([(0.0, 0.0, height, 0.0, 0.0, 0.0, 1.0)]), STILL[:1], 0.02) is near
    falling = np.array([(0.0, 0.0, -6.0, 0.0, 0.0, 0.0)])
    assert broad_phase.any_near(np.array([(0.0, 0.0, height, 0.0, 0.0, 0.0, 1.0)]), falling, 0.02)
