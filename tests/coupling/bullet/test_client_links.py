"""Links of somebody else's client as a participant: what it tells, what it takes, and that its owner's hand is seen in every step."""

from __future__ import annotations

import numpy as np
import pybullet
import pytest

from coupling.bullet.client_links import ClientLinks
from coupling.bullet.client_links_participant import ClientLinksParticipant, link_name
from coupling.bullet.links import LinkedBody
from coupling.bullet.plugin import attach_fluid
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection
from coupling.master.errors import CoSimulationError
from coupling.master.participant import Causality, Participant, Status, StepResult, Variable
from coupling.participants.fluid import FluidParticipant
from oilsim import FluidError
from tests.coupling.pools import pool
from tests.poison import Poison

STEP, MASS = 1.0 / 240.0, 2.0


def cube(client: int, height: float = 1.0) -> int:
    """A cube that nothing brakes, in a client without gravity."""
    pybullet.setTimeStep(STEP, physicsClientId=client)
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.15] * 3, physicsClientId=client)
    body: int = pybullet.createMultiBody(MASS, shape, basePosition=(0, 0, height), physicsClientId=client)
    pybullet.changeDynamics(body, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
    return body


def participant(client: int, *bodies: int) -> ClientLinksParticipant:
    links = ClientLinks(client)
    for body in bodies:
        linked = LinkedBody(client, body)
        links.add(linked, linked.keys)
    return ClientLinksParticipant("bodies", links)


class Recorder(Participant):
    """Takes a twist, gives a wrench of 1 N along x, and writes down every twist that it steps with."""

    def __init__(self) -> None:
        super().__init__(
            "recorder",
            [
                Variable("twist", "m/s, rad/s", (6,), Causality.INPUT),
                Variable("wrench", "N, N m", (6,), Causality.OUTPUT),
            ],
        )
        self.twist, self.seen = np.zeros(6), []

    def get(self, name: str) -> np.ndarray:
        return np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])

    def set(self, name: str, value: np.ndarray) -> None:
        self.twist = value.copy()

    def do_step(self, time: float, step_size: float) -> StepResult:
        self.seen.append(self.twist[0])
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        raise NotImplementedError("it has none")

    def restore_state(self, state: object) -> None:
        raise NotImplementedError("it has none")


def coupled(client: int, body: int, step: float = STEP) -> tuple[CoSimulation, Recorder]:
    recorder, link = Recorder(), link_name((body, -1))
    connections = [
        Connection("bodies", f"{link}.twist", "recorder", "twist"),
        Connection("recorder", "wrench", "bodies", f"{link}.wrench"),
    ]
    run = CoSimulation([recorder, participant(client, body)], connections, step)
    run.initialize()
    return run, recorder


def test_links_tell_where_they_are_and_how_they_answer(pybullet_client: int) -> None:
    body = cube(pybullet_client)
    pybullet.resetBaseVelocity(body, (0.1, 0.2, 0.3), (0.0, 0.0, 0.4), physicsClientId=pybullet_client)
    bodies, link = participant(pybullet_client, body), link_name((body, -1))
    assert bodies.observe()
    bodies.enter_initialization_mode(0.0)
    np.testing.assert_allclose(bodies.get(f"{link}.pose"), (0, 0, 1, 0, 0, 0, 1))
    np.testing.assert_allclose(bodies.get(f"{link}.twist"), (0.1, 0.2, 0.3, 0, 0, 0.4))
    np.testing.assert_allclose(bodies.get(f"{link}.free_acceleration"), (0, 0, -9.81, 0, 0, 0), atol=1e-12)
    np.testing.assert_allclose(bodies.get("inverse_mass")[:3, :3], np.eye(3) / MASS, atol=1e-12)
    bodies.get("inverse_mass")[:] = 0.0  # a copy
    assert bodies.get("inverse_mass").any()
    bodies.do_step(0.0, STEP)
    place, _ = pybullet.getBasePositionAndOrientation(body, physicsClientId=pybullet_client)
    np.testing.assert_array_equal(bodies.get(f"{link}.pose")[:3], place)
    np.testing.assert_allclose(bodies.get(f"{link}.twist")[2], 0.3 - 9.81 * STEP, rtol=1e-9)
    with pytest.raises(ValueError, match=rf"'bodies' has no output '{link}\.wrench', allowed: {link}\.pose"):
        bodies.get(f"{link}.wrench")
    with pytest.raises(NotImplementedError, match=r"pybullet\.saveState"):
        bodies.save_state()


def test_each_step_begins_from_what_the_owner_did_to_the_client(pybullet_client: int) -> None:
    body = cube(pybullet_client)
    run, recorder = coupled(pybullet_client, body)
    gain = STEP / MASS  # [m/s] a step, by 1 N
    run.step()
    run.step()
    pybullet.resetBaseVelocity(body, (5.0, 0.0, 0.0), physicsClientId=pybullet_client)
    run.step()
    run.step()
    np.testing.assert_allclose(recorder.seen, (0.0, gain, 5.0, 5.0 + gain), rtol=1e-6)
    assert run.outputs("bodies")[f"{link_name((body, -1))}.twist"][0] == pytest.approx(5.0 + 2.0 * gain, rel=1e-6)
    run.terminate()


def test_another_step_than_the_clients_own_is_refused(pybullet_client: int) -> None:
    body = cube(pybullet_client)
    run, _ = coupled(pybullet_client, body, step=0.01)
    with pytest.raises(CoSimulationError, match=r"'bodies': step is 0\.01 s, allowed: 0\.00416\d* s, the time step of"):
        run.step()


def test_a_body_that_is_lost_fails_under_the_participants_name(pybullet_client: int) -> None:
    body = cube(pybullet_client)
    run, _ = coupled(pybullet_client, body)
    run.step()
    pybullet.removeBody(body, physicsClientId=pybullet_client)
    with pytest.raises(CoSimulationError, match=f"'bodies' failed at .*: body {body} is no longer in the client"):
        run.step()


def test_a_fluid_of_somebody_else_keeps_its_clock_and_its_threads() -> None:
    fluid = pool(0.1, 1.0, 0.2)
    fluid.time = 7.0
    own = FluidParticipant("fluid", fluid, {}, own_step=0.02)
    own.enter_initialization_mode(0.0)
    own.do_step(0.0, 0.1 - 0.08)  # 0.02 but for rounding
    assert fluid.time == 7.02
    with pytest.raises(ValueError, match=r"'fluid': step is 0\.03 s, allowed: 0\.02 s, that of its bodies"):
        own.do_step(0.02, 0.03)
    own.terminate()
    fluid.advance(0.02)


def test_what_fails_in_a_step_reaches_the_user_as_it_is_and_the_world_goes_on(pybullet_client: int) -> None:
    world = attach_fluid(pybullet_client, pool(0.1, 1.0, 0.2), [cube(pybullet_client)])
    saved = world.save_state()
    world.fluid.add_forcing(Poison())
    with pytest.raises(FluidError, match=r"velocity of .* is not finite"):
        world.step()
    world.fluid.forcings.clear()
    world.restore_state(saved)
    report = world.step()
    assert report.sub_steps >= 1 and np.isfinite(world.fluid.particles.velocity).all()


def test_bodies_come_and_go_and_the_time_step_changes_between_steps(pybullet_client: int) -> None:
    first = cube(pybullet_client, 0.3)
    world = attach_fluid(pybullet_client, pool(0.1, 1.0, 0.3, pybullet_client, (first,)), [first])
    world.step()
    held = world.wrench(first)
    assert held.any()
    second = cube(pybullet_client, 2.0)
    world.add_body(second)
    np.testing.assert_array_equal(world.wrench(first), held)
    assert not world.wrench(second).any()
    pybullet.setTimeStep(0.01, physicsClientId=pybullet_client)
    world.step()
    assert world.fluid.time == STEP + 0.01 and world.fluid.moving_boundaries == tuple(world.fluid.boundaries)[1:]
    world.remove_body(first)
    world.step()
    with pytest.raises(ValueError, match=rf"link -1 of body {first} .* allowed \(body/link\): {second}/-1"):
        world.wrench(first)
