"""The fluid as a participant: it repeats bit for bit after a restart, saves what it must, and says what it cannot take."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.participants.fluid import FluidParticipant
from coupling.solids.bodies import box, mass_properties
from coupling.solids.surface_sampling import boundary_particles
from coupling.testkit import Scene, assert_restarts_exactly, empty_space, fails_in_order
from oilsim import Fluid
from tests.poison import Poison

SPACING, SIDE, PLACE = 0.05, 0.3, (0.0, 0.05, 0.0)


def flying_water() -> Scene:
    """A block of water that flies at where a box may rest, without gravity and walls."""
    scene = empty_space(size=(6.0, 6.0, 6.0), particle_spacing=SPACING)
    scene.fill((-0.5, -0.2, -0.2), (-0.2, 0.2, 0.2), velocity=(2.0, 0.3, 0.0))
    return scene


def collision() -> Scene:
    """The same and a box of a fifth its density."""
    scene = flying_water()
    scene.add_body("box", box((SIDE, SIDE, SIDE)), density=200.0, position=PLACE)
    return scene


def own_participant(fluid: Fluid) -> tuple[FluidParticipant, RigidBodyWorld]:
    """The fluid with that box as a participant without a master, and the world that says how the box answers."""
    world, mesh = RigidBodyWorld(gravity=(0.0, 0.0, 0.0)), box((SIDE, SIDE, SIDE))
    world.add_body("box", mesh, mass_properties(mesh, density=200.0), PLACE)
    handle = fluid.add_boundary(boundary_particles("box", mesh, SPACING))
    return FluidParticipant("fluid", fluid, {"box": handle}), world


def test_particles_that_left_are_counted_once_whatever_step_is_taken_back() -> None:
    """A block of water flies out of the domain: all that was there is still there, or counted as gone."""
    with empty_space(size=(0.8, 1.0, 1.0), particle_spacing=SPACING) as scene:
        scene.fill((-0.2, -0.2, -0.2), (0.2, 0.2, 0.2), velocity=(2.0, 0.0, 0.0))
        fluid, participant = scene.fluid, FluidParticipant("fluid", scene.fluid, {})
        whole, counts = fluid.particle_count, []
        for k in range(6):
            saved = participant.save_state()
            participant.do_step(0.05 * k, 0.05)  # discarded, and made again in two halves
            participant.restore_state(saved)
            for half in range(2):
                participant.do_step(0.05 * k + 0.025 * half, 0.025)
            counts.append(participant.left["water"])
            assert fluid.particle_count + counts[-1] == whole
        assert 0 < counts[3] < counts[-1]


def test_collision_goes_on_exactly_after_a_restart() -> None:
    assert_restarts_exactly(collision, at=5, steps=10)


def test_what_ties_bodies_is_not_saved_as_every_step_is_told_it() -> None:
    """It has 36 numbers for every pair of bodies: for a boom of 200 segments more than all of the water."""
    with flying_water() as scene:
        participant, world = own_participant(scene.fluid)
        participant.set("box.pose", world.pose("box"))
        tied = world.inverse_mass("box")
        participant.set("inverse_mass", tied)
        participant.do_step(0.0, 0.05)
        assert scene.fluid.save_state()["tied"] is not None
        saved = participant.save_state()
        wrenches = []
        for _ in range(2):
            participant.set("inverse_mass", tied)
            participant.do_step(0.05, 0.05)
            wrenches.append(participant.get("box.wrench"))
            participant.restore_state(saved)
            assert scene.fluid.save_state()["tied"] is None
        assert wrenches[0].any()
        np.testing.assert_array_equal(wrenches[0], wrenches[1])
        world.close()


def test_what_the_fluid_cannot_take_is_refused() -> None:
    with flying_water() as scene:
        participant, world = own_participant(scene.fluid)
        with pytest.raises(ValueError, match=r"'fluid' has no output 'box\.pose', allowed: box\.wrench"):
            participant.get("box.pose")
        with pytest.raises(ValueError, match=r"'box\.twist' has shape \(3,\), allowed: \(6,\)"):
            participant.set("box.twist", np.zeros(3))
        with pytest.raises(TypeError, match="allowed: a state that save_state returned"):
            participant.restore_state(None)
        world.close()


def test_failure_of_the_fluid_is_named() -> None:
    with collision() as scene:
        scene.step()
        scene.fluid.add_forcing(Poison())
        with fails_in_order(scene, participant="fluid", at=0.01, match="not finite"):
            scene.step()
