"""Random pybullet worlds with a fluid in them, each from its seed: bodies as a user of the plugin makes, loads and ties them.

Bodies of every kind (`random_bodies`), motors and constraints; time steps and sub-steps as a client may have them; bodies that come, go
and are pushed on the way. Lengths and speeds go with the spacing and the tank as in `random_scenes`.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
import pybullet
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from coupling.bullet.plugin import FluidWorld, attach_fluid
from oilsim import AdvanceReport, Fluid, FluidConfig, Phase, block, tank_walls
from oilsim.fluid.views import Particles
from tests.stress.random_bodies import DATA, REACH, drive, loose_body, placed
from tests.stress.random_scenes import GRAVITY, LENGTH, Dice

Array = NDArray[np.float64]

MOST_STEPS = 200
SIDES = ("-x", "+x", "-y", "+y", "-z")


@dataclass
class RandomWorld:
    """A client of its own, its fluid and what a run does to them; `speed` [m/s] of what drives it, `is_driven` by more than gravity."""

    dice: Dice
    client: int
    fluid: Fluid
    coupled: FluidWorld
    size: Array
    gravity: float
    speed: float
    steps: int
    loose: list[int] = field(default_factory=list)
    is_driven: bool = False
    _over: set[int] = field(default_factory=set)  # particles that have been above the rim
    _through: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._all = set(self.fluid.particles.id.tolist())

    def step(self) -> AdvanceReport:
        """Take a step; a few times in a run something happens before it."""
        if self.dice.chance(3.0 / self.steps):
            self._happening()
        return self.coupled.step()

    def _happening(self) -> None:
        """A body falls in, is taken away or pushed."""
        kind = self.dice.choice("remove", "add", "push")
        if kind == "add":
            self.is_driven = True  # what falls in brings energy
            body = loose_body(self.dice, self.client, self.fluid.config.particle_spacing, self.size)
            if placed(
                self.dice, self.client, body, self.loose, self.size, self.fluid.config.particle_spacing, above=1.0
            ):
                try:
                    self.coupled.add_body(body)
                except ValueError:  # all its links are smaller than a particle
                    pybullet.removeBody(body, physicsClientId=self.client)
                else:
                    self.loose.append(body)
        elif self.loose and kind == "remove":
            body = self.loose.pop(int(self.dice.random.integers(len(self.loose))))
            self.coupled.remove_body(body)
            pybullet.removeBody(body, physicsClientId=self.client)
        elif self.loose:
            self.is_driven = True
            body = self.dice.choice(*self.loose)
            step = pybullet.getPhysicsEngineParameters(physicsClientId=self.client)["fixedTimeStep"]
            mass = pybullet.getDynamicsInfo(body, -1, physicsClientId=self.client)[0]
            push = self.dice.vector(0.3 * self.speed * mass / step)
            pybullet.applyExternalForce(body, -1, push, (0, 0, 0), pybullet.LINK_FRAME, physicsClientId=self.client)

    def energy(self) -> float:
        """Of liquid and loose bodies [J]."""
        fluid = self.fluid.energy()
        return fluid.kinetic + fluid.potential + sum(self._body_energy(body) for body in self.loose)

    def count_leaked(self, seen: Particles | None = None) -> int:
        """Particles that have come out through a side or the floor by a spacing, or are gone, as `seen` after every step, None: now.

        Over the rim, twice as high as the tank, they may.
        """
        particles = self.fluid.particles if seen is None else seen
        place, number = particles.position, particles.id
        self._over |= set(number[place[2] > 2.0 * self.size[2]].tolist()) - self._through
        behind = np.maximum(-place, place - np.array([*self.size[:2], np.inf])[:, None]).max(axis=0)
        inside = set(number[behind <= self.fluid.config.particle_spacing].tolist())
        self._through |= self._all - inside - self._over
        return len(self._through)

    def fastest_body(self) -> float:
        """[m/s]"""
        speeds = [np.linalg.norm(twist[:3]) for body in self.loose for _, _, twist in self._links(body)]
        return float(max(speeds, default=0.0))

    def furthest_turn(self) -> float:
        """Largest angle [rad] by which a link turns in a step of the client."""
        step = pybullet.getPhysicsEngineParameters(physicsClientId=self.client)["fixedTimeStep"]
        spins = [np.linalg.norm(twist[3:]) for body in self.loose for _, _, twist in self._links(body)]
        return float(step * max(spins, default=0.0))

    def _body_energy(self, body: int) -> float:
        total = 0.0
        for link, pose, twist in self._links(body):
            mass, _, moments, *_ = pybullet.getDynamicsInfo(body, link, physicsClientId=self.client)
            spin = Rotation.from_quat(pose[3:]).inv().apply(twist[3:])
            total += mass * self.gravity * pose[2] + 0.5 * mass * twist[:3] @ twist[:3] + 0.5 * (moments * spin) @ spin
        return float(total)

    def _links(self, body: int) -> list[tuple[int, Array, Array]]:
        """Index, pose (7,) and twist (6,) of every link."""
        base = pybullet.getBasePositionAndOrientation(body, physicsClientId=self.client)
        velocity = pybullet.getBaseVelocity(body, physicsClientId=self.client)
        rows = [(-1, np.concatenate(base), np.concatenate(velocity))]
        for link in range(pybullet.getNumJoints(body, physicsClientId=self.client)):
            state = pybullet.getLinkState(body, link, 1, 1, physicsClientId=self.client)
            rows.append((link, np.concatenate(state[:2]), np.concatenate(state[6:8])))
        return rows

    def mass(self) -> float:
        """Of liquid and loose bodies [kg]."""
        densities = np.array([phase.rest_density for phase in self.fluid.config.phases])
        liquid = self.fluid.config.rest_volume * float(densities[self.fluid.particles.phase].sum())
        links = ((body, link) for body in self.loose for link, _, _ in self._links(body))
        return liquid + sum(pybullet.getDynamicsInfo(*key, physicsClientId=self.client)[0] for key in links)

    def close(self) -> None:
        """End both."""
        self.fluid.close()
        pybullet.disconnect(self.client)


def random_world(seed: int, threads: int = 1) -> RandomWorld:
    """The world of a seed, not stepped yet."""
    dice = Dice(seed)
    spacing = dice.scale(0.01, 0.2)
    size = dice.random.integers((10, 9, 10), (20, 16, 20)) * spacing
    gravity = dice.choice(GRAVITY, GRAVITY, GRAVITY, dice.scale(0.3, 50.0))
    unit, speed = math.sqrt(spacing / gravity), math.sqrt(gravity * float(size[2]))
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setAdditionalSearchPath(str(DATA), physicsClientId=client)
    pybullet.setGravity(0.0, 0.0, -gravity, physicsClientId=client)
    step = min(dice.choice(0.1, 0.25, 0.5, 1.0) * unit, 1.0 / 60.0)
    pybullet.setTimeStep(step, physicsClientId=client)
    pybullet.setPhysicsEngineParameter(numSubSteps=dice.choice(0, 0, 1, 4), physicsClientId=client)
    held = _sides(client, size, 5.0 * spacing)
    loose = _bodies(dice, client, spacing, size, speed)
    driven = _tie(dice, client, loose)
    fluid = _sea(dice, client, spacing, size, gravity, loose, threads)
    if dice.chance(0.75):
        high = (float(size[0]), float(size[1]), 2.0 * float(size[2]))
        fluid.add_boundary(tank_walls((0.0, 0.0, 0.0), high, spacing, sides=SIDES))
        held = []
    try:
        coupled = attach_fluid(client, fluid, [*held, *loose], no_slip=dice.chance(0.3))
    except ValueError:
        pybullet.disconnect(client)
        raise
    reference = math.sqrt(4.0 * gravity * float(np.linalg.norm(size)) + 2.0 * speed**2)
    steps = min(math.ceil(LENGTH * unit / step), MOST_STEPS)
    return RandomWorld(dice, client, fluid, coupled, size, gravity, reference, steps, loose, driven)


def _sides(client: int, size: Array, thick: float) -> list[int]:
    """Floor and four walls, twice as high as the tank, as held boxes around the inside from the origin to `size`."""
    x, y, z = (float(length) for length in size)
    slabs = (
        ((0.5 * x, 0.5 * y, -0.5 * thick), (0.5 * x + thick, 0.5 * y + thick, 0.5 * thick)),
        ((-0.5 * thick, 0.5 * y, z), (0.5 * thick, 0.5 * y + thick, z)),
        ((x + 0.5 * thick, 0.5 * y, z), (0.5 * thick, 0.5 * y + thick, z)),
        ((0.5 * x, -0.5 * thick, z), (0.5 * x, 0.5 * thick, z)),
        ((0.5 * x, y + 0.5 * thick, z), (0.5 * x, 0.5 * thick, z)),
    )
    bodies = []
    for place, half in slabs:
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
        bodies.append(pybullet.createMultiBody(0.0, shape, basePosition=place, physicsClientId=client))
    return bodies


def _bodies(dice: Dice, client: int, spacing: float, size: Array, speed: float) -> list[int]:
    """Up to four loose bodies within the tank or above it, none in another, some thrown."""
    bodies: list[int] = []
    for _ in range(dice.choice(1, 2, 3, 4)):
        body = loose_body(dice, client, spacing, size)
        if not placed(dice, client, body, bodies, size, spacing):
            continue
        bodies.append(body)
        if dice.chance(0.4):
            thrown = dice.vector(speed * dice.choice(0.1, 0.3))
            pybullet.resetBaseVelocity(
                body, thrown, dice.vector(min(0.1 * speed / spacing, 10.0)), physicsClientId=client
            )
    return bodies


def _tie(dice: Dice, client: int, bodies: list[int]) -> bool:
    """Let joints be free, held or driven by their motors, and tie two bodies to each other; returns whether anything is driven."""
    driven = False
    for body in bodies:
        for joint in range(pybullet.getNumJoints(body, physicsClientId=client)):
            kind = pybullet.getJointInfo(body, joint, physicsClientId=client)[2]
            motor = dice.choice("none", "none", "default", "rate", "servo")
            if kind == pybullet.JOINT_SPHERICAL and motor == "none":
                pybullet.setJointMotorControlMultiDof(
                    body, joint, pybullet.POSITION_CONTROL, [0, 0, 0, 1], positionGain=0, velocityGain=0, force=[0, 0, 0],
                    physicsClientId=client,
                )  # fmt: skip
            elif kind in REACH and motor != "default":
                driven |= motor != "none"
                drive(dice, client, body, joint, motor, REACH[kind])
    if len(bodies) > 1 and dice.chance(0.25):
        first, second = bodies[:2]
        places = [
            np.array(pybullet.getBasePositionAndOrientation(body, physicsClientId=client)[0])
            for body in (first, second)
        ]
        turns = [
            Rotation.from_quat(pybullet.getBasePositionAndOrientation(body, physicsClientId=client)[1])
            for body in (first, second)
        ]
        middle = 0.5 * (places[0] + places[1])
        arms = [turn.inv().apply(middle - place).tolist() for turn, place in zip(turns, places, strict=True)]
        pybullet.createConstraint(
            first, -1, second, -1, pybullet.JOINT_POINT2POINT, (0, 0, 0), arms[0], arms[1], physicsClientId=client
        )
    return driven


def _sea(
    dice: Dice, client: int, spacing: float, size: Array, gravity: float, bodies: list[int], threads: int
) -> Fluid:
    """One liquid or two, from the floor to a third or two of the tank's height, around the bodies."""
    phases = tuple(
        Phase(
            name=f"liquid-{n}",
            rest_density=1000.0 if n == 0 else dice.scale(300.0, 1500.0),
            dynamic_viscosity=dice.choice(0.0, 1e-3, dice.scale(1e-3, 100.0)),
        )
        for n in range(dice.choice(1, 1, 2))
    )
    margin = 12.0 * spacing
    config = FluidConfig(
        particle_spacing=spacing, phases=phases, lower=(-margin, -margin, -margin),
        upper=(float(size[0]) + margin, float(size[1]) + margin, 2.0 * float(size[2]) + margin),
        gravity=(0.0, 0.0, -gravity),
    )  # fmt: skip
    fluid = Fluid(config, threads=threads)
    depth = 0.0
    for phase in phases:
        top = depth + round(dice.between(0.2, 0.45) * float(size[2]) / spacing) * spacing
        points = block((0.0, 0.0, depth), (float(size[0]), float(size[1]), top), spacing)
        fluid.add_particles(points[_outside(client, points, bodies, 0.5 * spacing)], phase=phase.name)
        depth = top
    return fluid


def _outside(client: int, points: Array, bodies: list[int], clearance: float) -> NDArray[np.bool_]:
    """Which points lie in no link's bounding box."""
    free = np.ones(len(points), bool)
    links = ((body, range(-1, pybullet.getNumJoints(body, physicsClientId=client))) for body in bodies)
    for body, link in itertools.chain.from_iterable(((body, n) for n in numbers) for body, numbers in links):
        lower, upper = pybullet.getAABB(body, link, physicsClientId=client)
        free &= ((points < np.subtract(lower, clearance)) | (points > np.add(upper, clearance))).any(axis=1)
    return free
