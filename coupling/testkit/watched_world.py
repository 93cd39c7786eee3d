"""A fluid in a pybullet world of the user's own, watched for checks and recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.bullet.plugin import FluidWorld
from coupling.bullet.pybullet_import import pybullet
from coupling.bullet.shapes import link_mesh, link_pose
from coupling.master.observer_dispatch import CommunicationPoint, Observer
from coupling.testkit.readings import Basin
from coupling.testkit.run import TestRun, describe, phase_frames
from oilsim.backend.arrays import Array
from recordings.model.frame import BodyFrame, Frame

LinkKey = tuple[int, int]


def watch(
    world: FluidWorld,
    bodies: Mapping[str, int | LinkKey],
    *,
    basin: Basin | None = None,
    name: str = "pybullet world",
) -> WatchedWorld:
    """Watch the named bodies of a `FluidWorld`: unique ids, or pairs of id and link; one that does not meet the fluid has a wrench of 0.

    basin: the tank, from which the still level follows; None if checks state the level. Step the result instead of the world. Raises
    ValueError for a body that does not exist or has no collision shape.
    """
    return WatchedWorld(world, bodies, basin=basin, name=name)


class WatchedWorld(TestRun):
    """Steps a `FluidWorld` and keeps its history; made by `watch`. ValueError for a body without a collision shape."""

    def __init__(
        self, world: FluidWorld, bodies: Mapping[str, int | LinkKey], *, basin: Basin | None, name: str
    ) -> None:
        super().__init__(name)
        self.world = world
        self._keys: dict[str, LinkKey] = {
            one: key if isinstance(key, tuple) else (key, -1) for one, key in bodies.items()
        }
        self._basin, self._index, self._has_begun = basin, 0, False
        self._meshes = {}
        for one, (body, link) in self._keys.items():
            mesh = link_mesh(world.client, body, link)
            if mesh is None:
                raise ValueError(f"{one!r}: link {link} of body {body} has no collision shape, allowed: links with one")
            self._meshes[one] = mesh

    def step(self) -> None:
        """Make one step of fluid and client."""
        self._begin()
        self.world.step()
        self._index += 1
        self._show()

    def run(self, duration: float) -> None:
        """Run for `duration` [s], in whole steps of the client; ValueError for a duration that is not above 0."""
        if not duration > 0.0:
            raise ValueError(f"{self.name}: duration of the run is {duration} s, allowed: above 0")
        for _ in range(max(1, round(duration / self._step_size()))):
            self.step()

    def _terms(self) -> dict[str, Any]:
        terms = {"momentum": self._momentum, "energy": self._energy, "turnover": self._turnover}
        return self._fluid_terms(self.world.fluid, self._basin, **terms)

    def close(self) -> None:
        """Tell observers of the end; fluid and client stay their owner's."""
        for observer in self._everybody() if self._has_begun else ():
            observer.terminated("finished")
        self._has_begun = False

    def _begin(self) -> None:
        if not self._has_begun:
            self._has_begun = True
            run = describe(self.name, self.world.fluid, self._meshes)
            for observer in self._everybody():
                observer.initialized(run)
            self._show()

    def _require_not_begun(self, what: str) -> None:
        if self._has_begun:
            raise ValueError(f"{self.name}: {what} is added after the run has begun, allowed: before")

    def _everybody(self) -> Sequence[Observer]:
        return (self.history, *self._observers)

    def _step_size(self) -> float:
        return float(pybullet.getPhysicsEngineParameters(physicsClientId=self.world.client)["fixedTimeStep"])

    def _show(self) -> None:
        frame = self._last_frame()
        for observer in self._everybody():
            observer.step_completed(frame)

    def _last_frame(self) -> Frame:
        fluid = self.world.fluid
        point = CommunicationPoint(self._index, self._index * self._step_size(), self._step_size())
        return Frame(
            index=point.index,
            time=point.time,
            bodies={name: self._body(key) for name, key in self._keys.items()},
            read_phases=lambda: phase_frames(fluid),
        )

    def _body(self, key: LinkKey) -> BodyFrame:
        position, orientation = link_pose(self.world.client, *key)
        linear, angular = self._velocity(key)
        return BodyFrame(
            position=np.array(position),
            orientation=np.array(orientation),
            linear_velocity=linear,
            angular_velocity=angular,
            wrench=self.world.wrench(*key) if self.world.meets(*key) else np.zeros(6),
        )

    def _velocity(self, key: LinkKey) -> tuple[Array, Array]:
        client = self.world.client
        if key[1] < 0:
            found = pybullet.getBaseVelocity(key[0], physicsClientId=client)
        else:
            found = pybullet.getLinkState(*key, computeLinkVelocity=1, physicsClientId=client)[6:8]
        return np.array(found[0]), np.array(found[1])

    def _momenta(self) -> tuple[Array, Array, Array, Array]:
        """Return mass (B,) [kg], place (B, 3) [m], momentum (B, 3) [kg m/s] and spin about the centre of mass (B, 3) [kg m2/s]."""
        rows = []
        for key in self._keys.values():
            mass, _, inertia = pybullet.getDynamicsInfo(*key, physicsClientId=self.world.client)[:3]
            position, orientation = link_pose(self.world.client, *key)
            turn, (velocity, rate) = Rotation.from_quat(orientation).as_matrix(), self._velocity(key)
            rows.append((mass, *position, *(mass * velocity), *(turn @ (np.array(inertia) * (turn.T @ rate)))))
        table = np.array(rows, dtype=np.float64).reshape(-1, 10)
        return table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7:]

    def _momentum(self) -> Array:
        _, place, linear, spin = self._momenta()
        return np.concatenate([linear.sum(axis=0), (np.cross(place, linear) + spin).sum(axis=0)])

    def _energy(self) -> float:
        masses, place, linear, spin = self._momenta()
        rates = np.array([self._velocity(key)[1] for key in self._keys.values()]).reshape(-1, 3)
        moving = 0.5 * (linear**2).sum(axis=1)[masses > 0.0] / masses[masses > 0.0]
        height = place @ np.array(self.world.fluid.config.gravity)
        return float(moving.sum() + 0.5 * (spin * rates).sum() - masses @ height)

    def _turnover(self) -> tuple[float, float, float]:
        _, place, linear, spin = self._momenta()
        sizes = [float(np.linalg.norm(mesh.vertices, axis=1).max()) for mesh in self._meshes.values()]
        far = float((np.linalg.norm(place, axis=1) + sizes).max(initial=0.0))
        return float(np.linalg.norm(linear, axis=1).sum()), float(np.linalg.norm(spin, axis=1).sum()), far
