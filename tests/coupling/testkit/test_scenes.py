"""The test kit: what its checks measure is so, and they fail where they should; every fault ends or mends as it is meant to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError
from coupling.master.participant import Status, StepResult
from coupling.solids.bodies import box, sphere
from coupling.testkit import (
    Fault,
    FaultyParticipant,
    Scene,
    assert_draft,
    assert_force,
    assert_momentum_conserved,
    assert_pressure_hydrostatic,
    empty_space,
    tank,
)
from oilsim import Phase
from oilsim.core.physical_constants import GRAVITY
from tests.coupling.accumulator import Accumulator

SPACING = 0.05
DRY = Phase(name="water", rest_density=1000.0)
STICKY = Phase(name="water", rest_density=1000.0, adhesion=5.0)
SYRUP = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1.0)
BITUMEN = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1e3)


def collision(phase: Phase, *, no_slip: bool = False, communication_step: float = 1.0 / 240.0) -> Scene:
    """A block of liquid that flies, turns and stirs past the side of a resting box of a fifth its density."""
    scene = empty_space(
        size=(6.0, 6.0, 6.0), particle_spacing=SPACING, phases=(phase,), communication_step=communication_step
    )
    scene.add_body("box", box((0.3, 0.3, 0.3)), density=200.0, position=(0.0, 0.05, 0.0), no_slip=no_slip)
    scene.fill((-0.5, -0.2, -0.2), (-0.2, 0.2, 0.2), velocity=(2.0, 0.3, 0.0))
    position, velocity = scene.fluid.particles.position, scene.fluid.particles.velocity.copy()
    velocity += np.cross([3.0, -5.0, 8.0], position.T - np.array([-0.35, 0.0, 0.0])).T.astype(np.float32)
    velocity += np.random.default_rng(1).normal(0.0, 0.2, velocity.shape).astype(np.float32)
    scene.fluid.set_velocities(velocity)
    return scene


@pytest.mark.parametrize(("phase", "no_slip"), [(DRY, False), (SYRUP, True), (BITUMEN, True), (STICKY, False)])
def test_momentum_is_conserved_whatever_acts(phase: Phase, no_slip: bool) -> None:
    # pair by pair in float32; angular momentum that position corrections and pairs off their line of centres take is given back
    with collision(phase, no_slip=no_slip) as scene:
        assert_momentum_conserved(scene, steps=70, within=1e-7)
        assert np.linalg.norm(scene.world.twist("box")) > 1.0  # something was exchanged


def test_angular_momentum_where_bodies_make_steps_of_their_own() -> None:
    # an impulse J in the step H acts on a body of velocity v at places that differ by a part of v H: 1e-5 of m |v| r here
    with collision(DRY, communication_step=0.01) as scene:
        assert_momentum_conserved(scene, steps=30, within=1e-7, angular_within=5e-5)


def test_exchange_itself_conserves_angular_momentum_where_steps_agree() -> None:
    # with one step of the fluid and of the bodies in each communication step, bodies turn by what the fluid counts
    with collision(DRY) as scene:
        budget = scene.fluid.watch()
        for _ in range(40):
            before = scene.world.momentum()
            scene.step()
            assert budget.last is not None
            given = budget.last.part(*budget.last.parts).impulse_on_bodies
            np.testing.assert_allclose(scene.world.momentum() - before, given, atol=1e-9)
        assert np.linalg.norm(scene.world.momentum()[3:]) > 0.1


THICK = Phase(name="water", rest_density=1000.0, dynamic_viscosity=20.0)
LAYER, THICKNESS, TIME = 0.2, 0.05, 0.2


def drag(density: float, no_slip: bool) -> float:
    """Speed of a plate after TIME between two layers of liquid that move at 1 m/s."""
    with empty_space(size=(6.0, 6.0, 6.0), particle_spacing=SPACING, phases=(THICK,)) as scene:
        scene.add_body("plate", box((0.5, 0.5, THICKNESS)), density=density, position=(0.0, 0.0, 0.0), no_slip=no_slip)
        for low, high in ((0.5 * THICKNESS, LAYER + 0.5 * THICKNESS), (-LAYER - 0.5 * THICKNESS, -0.5 * THICKNESS)):
            scene.fill((-0.25, -0.25, low), (0.25, 0.25, high), velocity=(1.0, 0.0, 0.0))
        scene.run(TIME)
        return float(scene.world.twist("plate")[0])


def diffused(density: float) -> float:
    """The same in one dimension: rho du/dt = mu d2u/dz2 above half of the plate, no stress at the outer surface."""
    cells = 400
    width, half = LAYER / cells, 0.5 * THICKNESS * density / THICK.rest_density
    rate = np.zeros((cells + 1, cells + 1))  # the plate, then the layer's cells
    distances, masses = [0.5 * width, *[width] * (cells - 1)], [half, *[width] * cells]
    for index, distance in enumerate(distances):
        exchange = THICK.dynamic_viscosity / THICK.rest_density / distance
        for own, other in ((index, index + 1), (index + 1, index)):
            rate[own, own] -= exchange / masses[own]
            rate[own, other] += exchange / masses[own]
    start = np.ones(cells + 1)
    start[0] = 0.0
    return float((expm(TIME * rate) @ start)[0])


@pytest.mark.parametrize(("density", "within"), [(1000.0, 0.25), (20.0, 0.02)])
def test_viscous_liquid_drags_a_body_that_it_sticks_to(density: float, within: float) -> None:
    # half a spacing lies between the plate and the first particles, where the gradient is a quarter too small at first; the light plate
    # goes with the liquid at once: a drag a step late, of 14 times its momentum a step, would throw it out
    assert drag(density, no_slip=True) == pytest.approx(diffused(density), rel=within)


def test_liquid_slips_along_a_body_without_friction() -> None:
    # but for what pressure finds rough in a surface made of points
    assert abs(drag(1000.0, no_slip=False)) < 0.03


def test_adhesion_pulls_a_body_to_the_liquid() -> None:
    for phase, pulls in ((STICKY, True), (DRY, False)):
        with empty_space(size=(6.0, 6.0, 6.0), particle_spacing=SPACING, phases=(phase,)) as scene:
            scene.add_body("plate", box((0.3, 0.3, 0.1)), density=500.0, position=(0.0, 0.0, 0.0))
            scene.fill((-0.15, -0.15, 0.05), (0.15, 0.15, 0.15))
            assert_momentum_conserved(scene, steps=10) if pulls else scene.run(0.1)
            speed = scene.world.twist("plate")[2]
            assert speed > 1e-3 if pulls else abs(speed) < 1e-6


# checks


def test_draft_and_lift() -> None:
    with tank(size=(0.6, 0.6, 0.8), depth=0.3, particle_spacing=SPACING) as scene:
        scene.add_body("raft", box((0.3, 0.3, 0.2)), density=500.0, position=(0.3, 0.3, 0.3))
        scene.run(1.0)
        weight = GRAVITY * 500.0 * 0.3 * 0.3 * 0.2
        assert_force(scene, "raft", weight, along="z", within=0.1 * weight, since=0.4)  # in the mean it is carried
        assert_draft(scene, "raft", 0.1, within=0.3 * SPACING)
        with pytest.raises(AssertionError, match=r"draft of 'raft' is 0\.\d+ m, expected: 0\.15 m within 0\.01 m"):
            assert_draft(scene, "raft", 0.15, within=0.01)


def test_hydrostatic_pressure() -> None:
    with tank(size=(0.5, 0.5, 0.6), depth=0.4, particle_spacing=SPACING) as scene:
        scene.run(0.5)
        assert_pressure_hydrostatic(scene, at=(0.25, 0.25), within=0.03)
        with pytest.raises(
            AssertionError, match=r"pressure at z = .* m is .* Pa, expected: .* Pa within 141 Pa at 0\.5 s"
        ):
            assert_pressure_hydrostatic(scene, at=(0.25, 0.25), within=0.03, density=1200.0)


def test_level_counts_what_bodies_displace() -> None:
    with tank(size=(0.5, 0.5, 0.8), depth=0.4, particle_spacing=SPACING) as scene:
        scene.add_body("ball", sphere(0.1), density=900.0, position=(0.25, 0.25, 0.2), motion="fixed")
        assert scene.simulation.is_running
        water = scene.fluid.particle_count * SPACING**3
        assert scene.level() == pytest.approx((water + 4.0 / 3.0 * np.pi * 0.1**3) / 0.25, rel=1e-3)
        assert scene.draft("ball") == pytest.approx(scene.level() - 0.1, abs=1e-3)


def test_momentum_that_is_not_conserved_is_found() -> None:
    with collision(DRY, communication_step=0.01) as scene:
        scene.world.set_applied_wrench("box", np.array([50.0, 0, 0, 0, 0, 0]))
        with pytest.raises(AssertionError, match=r"momentum changes by \[0\.\d+, .* N s in the step to 0\.01 s"):
            assert_momentum_conserved(scene)


# faults


def run_with(fault: Fault) -> tuple[CoSimulation, Accumulator]:
    inner = Accumulator("pump", [])
    inner.input = np.array(1.0)
    run = CoSimulation([FaultyParticipant(inner, fault, at_time=0.25)], [], 0.1)
    run.initialize()
    return run, inner


@pytest.mark.parametrize("fault", [Fault.EARLY_RETURN, Fault.DISCARD])
def test_faults_that_a_master_mends(fault: Fault) -> None:
    run, inner = run_with(fault)
    run.run(0.5)
    assert float(inner.output) == pytest.approx(1.5, abs=1e-14)
    assert len([entry for entry in inner.log if entry[1] == "step"]) == 6


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (Fault.ERROR, r"failed at 0\.2 s: error: error injected at 0\.25 s"),
        (Fault.EXCEPTION, r"failed at 0\.2 s: exception injected at 0\.25 s"),
        (Fault.NAN, r"failed at 0\.3 s: the output 'y' is nan"),
        (Fault.LATE, r"failed at 0\.2 s: reached 0\.4"),
    ],
)
def test_faults_that_end_a_run(fault: Fault, message: str) -> None:
    run, _ = run_with(fault)
    with pytest.raises(CoSimulationError, match=r"participant 'pump' " + message):
        run.run(0.5)
    assert not run.is_running


def test_events_of_a_participant_with_a_fault_are_its_own() -> None:
    class Valve(Accumulator):
        rounds = 0

        def update_discrete_states(self) -> bool:
            self.rounds += 1
            return False

    valve = Valve("valve", [])
    valve.on_step = lambda time, step: StepResult(Status.OK, time + step, event_handling_needed=True)
    run = CoSimulation([FaultyParticipant(valve, Fault.DISCARD, at_time=0.15)], [], 0.1)
    run.initialize()
    run.run(0.3)
    assert valve.rounds == 4


@pytest.mark.parametrize(
    ("fault", "at_time", "message"),
    [("nan", 0.1, "fault is 'nan', allowed: Fault"), (Fault.NAN, np.nan, "at_time .* has nan")],
)
def test_faults_that_would_never_come_are_refused(fault: Any, at_time: float, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        FaultyParticipant(Accumulator("pump", []), fault, at_time=at_time)
