"""Calls of the plugin that cannot be: each has one clear error."""

from __future__ import annotations

from collections.abc import Iterator

import pybullet
import pytest

from coupling.bullet.plugin import attach_fluid
from oilsim import Fluid, FluidConfig, Phase, block


@pytest.fixture
def client() -> Iterator[int]:
    number = pybullet.connect(pybullet.DIRECT)
    yield number
    pybullet.disconnect(number)


def still_water() -> Fluid:
    water = Phase(name="water", rest_density=1000.0)
    fluid = Fluid(FluidConfig(particle_spacing=0.1, phases=(water,), lower=(0, 0, 0), upper=(1, 1, 1)))
    fluid.add_particles(block((0, 0, 0), (0.4, 0.4, 0.4), 0.1), phase="water")
    return fluid


def ball(client: int) -> int:
    shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=0.15, physicsClientId=client)
    return int(pybullet.createMultiBody(1.0, shape, basePosition=(0.7, 0.7, 0.7), physicsClientId=client))


def test_a_detached_world_does_not_step(client: int) -> None:
    fluid, body = still_water(), ball(client)
    world = attach_fluid(client, fluid, [body])
    with pytest.raises(ValueError, match="fluid is in another world already, allowed: one world for each Fluid"):
        attach_fluid(client, fluid, [])
    world.detach()
    world.detach()
    for call in (world.step, lambda: world.add_body(body)):
        with pytest.raises(
            RuntimeError, match="the fluid is detached from this world, allowed: to make another one with attach_fluid"
        ):
            call()
    assert attach_fluid(client, fluid, [body]) is not world


@pytest.mark.parametrize("saved", [b"xx", None, {}])
def test_a_state_is_what_was_saved(saved: object, client: int) -> None:
    with pytest.raises(ValueError, match=r"state is of type \w+, allowed: what save_state\(\) returned"):
        attach_fluid(client, still_water(), []).restore_state(saved)  # type: ignore[arg-type]


def test_parts_of_a_fluid_are_what_they_should_be() -> None:
    with pytest.raises(TypeError, match=r"config is \{\}, allowed: an oilsim.FluidConfig"):
        Fluid({})  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="name is '', allowed: a text of one letter or more"):
        Phase(name="", rest_density=1000.0)
    for spacing in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match=r"spacing is .*, allowed: above 0 m"):
            block((0, 0, 0), (1, 1, 1), spacing)
    with pytest.raises(ValueError, match=r"block has 1e\+12 particles at a spacing of 0.0001 m, allowed: up to 1e\+09"):
        block((0, 0, 0), (1, 1, 1), 1e-4)
