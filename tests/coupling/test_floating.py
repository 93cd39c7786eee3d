"""Fluid and rigid bodies under the master: momentum over a step, floating at the right depth, rollback, clear refusals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from coupling.bodies import box, mass_properties
from coupling.errors import CoSimulationError
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection
from coupling.participant import Participant
from coupling.participants.fluid import FluidParticipant
from coupling.participants.rigid_bodies import RigidBodyParticipant, RigidBodyWorld
from coupling.solids.surface_sampling import boundary_particles
from oilsim.boundaries.boundary_particles import tank_walls
from oilsim.config import FluidConfig
from oilsim.initial_conditions import block
from oilsim.phases import Phase
from oilsim.solver import Fluid
from tests.poison import Poison

WATER = 1000.0
Vector = tuple[float, float, float]
Coupled = tuple[FluidParticipant, RigidBodyParticipant, Sequence[Connection]]


def make_fluid(spacing: float, lower: Vector, upper: Vector, gravity: Vector) -> Fluid:
    phases = (Phase(name="water", rest_density=WATER),)
    return Fluid(
        FluidConfig(particle_spacing=spacing, phases=phases, lower=lower, upper=upper, gravity=gravity), threads=1
    )


def couple(fluid: Fluid, world: RigidBodyWorld, handles: dict[str, int]) -> Coupled:
    quantities = ("pose", "twist", "inverse_mass", "free_acceleration")
    there = [
        Connection("bodies", f"{body}.{what}", "fluid", f"{body}.{what}") for body in handles for what in quantities
    ]
    back = [Connection("fluid", f"{body}.wrench", "bodies", f"{body}.wrench") for body in handles]
    return FluidParticipant("fluid", fluid, handles), RigidBodyParticipant("bodies", world), [*there, *back]


def blob_and_box() -> tuple[Fluid, RigidBodyWorld, Coupled]:
    """A block of water that flies at a resting box of a fifth its density, without gravity and walls."""
    spacing = 0.05
    fluid = make_fluid(spacing, (-3.0, -3.0, -3.0), (3.0, 3.0, 3.0), (0.0, 0.0, 0.0))
    fluid.add_particles(block((-0.5, -0.2, -0.2), (-0.2, 0.2, 0.2), spacing), phase="water", velocity=(2.0, 0.3, 0.0))
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0))
    mesh = box((0.3, 0.3, 0.3))
    world.add_body("box", mesh, mass_properties(mesh, density=200.0), (0.0, 0.05, 0.0))
    handle = fluid.add_boundary(boundary_particles("box", mesh, spacing))
    return fluid, world, couple(fluid, world, {"box": handle})


def begin(coupled: Coupled) -> CoSimulation:
    *participants, connections = coupled
    run = CoSimulation(participants, connections, 0.01)
    run.initialize()
    return run


def carry(participants: Sequence[Participant], source: str, target: str) -> None:
    """What the one tells the other of the box."""
    by_name = {participant.name: participant for participant in participants}
    for what in ("wrench",) if source == "fluid" else ("pose", "twist", "inverse_mass", "free_acceleration"):
        by_name[target].set(f"box.{what}", by_name[source].get(f"box.{what}"))


def total_momentum(fluid: Fluid, world: RigidBodyWorld) -> np.ndarray:
    """Linear and angular momentum about the origin of fluid and bodies together."""
    position = fluid.phase_positions("water").astype(np.float64)
    velocity = fluid.phase_velocities("water").astype(np.float64)
    mass = WATER * fluid.config.rest_volume
    spin = (np.cross(position, velocity) * mass).sum(axis=0)
    return np.concatenate([fluid.momentum(), spin]) + world.momentum()


def test_momentum_of_fluid_and_body_is_kept_step_by_step() -> None:
    fluid, world, coupled = blob_and_box()
    run = begin(coupled)
    momentum = total_momentum(fluid, world)
    scale = np.linalg.norm(momentum[:3])
    for _ in range(30):
        run.step()
        after = total_momentum(fluid, world)
        # the impulse that each boundary particle takes is the one the fluid gave, in float32: 1e-6 of p
        np.testing.assert_allclose(after[:3], momentum[:3], atol=1e-6 * scale)
        # the fluid's moves on curved paths and the body's turn within a step are first order in H: 1e-4 of p times 1 m a step
        np.testing.assert_allclose(after[3:], momentum[3:], atol=1e-4 * scale)
    # and something was exchanged: the box takes along more than half the blob's speed
    assert world.twist("box")[0] > 1.0
    run.terminate()


def test_what_ties_bodies_is_not_saved_as_every_step_is_told_it() -> None:
    """It has 36 numbers for every pair of bodies: for a boom of 200 segments more than all of the water."""
    fluid, world, (participant, _, _) = blob_and_box()
    participant.set("box.pose", world.pose("box"))
    tied = world.inverse_mass("box")
    participant.set("inverse_mass", tied)
    participant.do_step(0.0, 0.05)
    assert fluid.save_state()["tied"] is not None
    saved = participant.save_state()
    wrenches = []
    for _ in range(2):
        participant.set("inverse_mass", tied)
        participant.do_step(0.05, 0.05)
        wrenches.append(participant.get("box.wrench"))
        participant.restore_state(saved)
        assert fluid.save_state()["tied"] is None
    assert wrenches[0].any()
    np.testing.assert_array_equal(wrenches[0], wrenches[1])


def test_rolled_back_steps_repeat() -> None:
    fluid, world, coupled = blob_and_box()
    *participants, _ = coupled
    run = begin(coupled)
    run.run(0.05)
    states = [participant.save_state() for participant in participants]
    results = []
    for _ in range(2):
        for participant, state in zip(participants, states, strict=True):
            participant.restore_state(state)
        for index in range(5, 15):
            for participant, feeds in zip(participants, (("bodies", "fluid"), ("fluid", "bodies")), strict=True):
                carry(participants, *feeds)
                participant.do_step(index * 0.01, 0.01)
        results.append((world.pose("box"), world.twist("box"), fluid.phase_positions("water")))
    for first, second in zip(*results, strict=True):
        np.testing.assert_array_equal(first, second)
    run.terminate()


def test_box_of_half_the_density_floats_half_under() -> None:
    # draft = h rho_b / rho_w; the level follows from the volume of water: A_tank level = N d^3 + A_box draft
    spacing, size, tank, depth = 0.05, (0.3, 0.3, 0.2), 0.6, 0.3
    fluid = make_fluid(spacing, (-0.5, -0.5, -0.3), (0.5, 0.5, 1.0), (0.0, 0.0, -9.81))
    walls = tank_walls((-0.3, -0.3, 0.0), (0.3, 0.3, 0.8), spacing, sides=("-x", "+x", "-y", "+y", "-z"))
    fluid.add_boundary(walls)
    height = depth  # centre of mass at the waterline
    water = block((-0.3, -0.3, 0.0), (0.3, 0.3, depth), spacing)
    beside = (np.abs(water - (0.0, 0.0, height)) > 0.5 * np.array(size) + 0.49 * spacing).any(axis=1)
    fluid.add_particles(water[beside], phase="water")
    world = RigidBodyWorld()
    mesh = box(size)
    world.add_body("raft", mesh, mass_properties(mesh, density=0.5 * WATER), (0.0, 0.0, height))
    handle = fluid.add_boundary(boundary_particles("raft", mesh, spacing))
    run = begin(couple(fluid, world, {"raft": handle}))
    heights, lifts = [], []
    for step in range(150):
        run.step()
        if step >= 50:
            heights.append(world.pose("raft")[2])
            lifts.append(world.wrench("raft")[2])
    draft = 0.5 * size[2]
    level = (fluid.particle_count * spacing**3 + size[0] * size[1] * draft) / tank**2
    assert fluid.particle_count == np.count_nonzero(beside)
    assert level - (np.mean(heights) - 0.5 * size[2]) == pytest.approx(draft, abs=spacing)
    # in the mean it is carried: the lift is its weight, within what its bobbing leaves
    assert np.mean(lifts) == pytest.approx(9.81 * 0.5 * WATER * np.prod(size), rel=0.1)
    run.terminate()


def test_what_the_fluid_cannot_take_is_refused_and_its_failure_named() -> None:
    fluid, _, coupled = blob_and_box()
    run, participant = begin(coupled), coupled[0]
    with pytest.raises(ValueError, match=r"'fluid' has no output 'box\.pose', allowed: box\.wrench"):
        participant.get("box.pose")
    with pytest.raises(ValueError, match=r"'box\.twist' has shape \(3,\), allowed: \(6,\)"):
        participant.set("box.twist", np.zeros(3))
    with pytest.raises(TypeError, match="wants what save_state returned"):
        participant.restore_state(None)
    run.step()
    fluid.add_forcing(Poison())
    with pytest.raises(CoSimulationError, match=r"'fluid' failed at 0\.01 s: error: .* not finite"):
        run.step()
