"""Oil and water for a pybullet world that already exists.

    fluid = Fluid(config)
    fluid.add_particles(...)
    world = attach_fluid(client, fluid, [boat, rock])
    while ...:
        world.step()                      # instead of pybullet.stepSimulation()

Every link with a collision shape is sampled as it is. One step: the fluid takes poses, velocities and inverse masses of the
links and advances by the client's own time step; the wrenches go to the links as external forces; pybullet steps. Nothing of
the client is changed: not its gravity, damping, time step or sub-steps. Where pybullet's defaults spoil physics, a warning
says so once, with the call that mends it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial.transform import Rotation

from coupling.errors import UnresolvedSolidError
from coupling.pybullet_shapes import link_mesh
from coupling.quiet_pybullet import pybullet
from coupling.rigid_state import steady
from coupling.surface_sampling import particles_of, sample_surface
from oilsim.solver import AdvanceReport, Fluid

Array = npt.NDArray[np.float64]

DEFAULT_DAMPING = 0.04  # [1/s] and [1/m]: pybullet's, of every link unless changeDynamics sets another


@dataclass(eq=False)
class _Link:
    """One sampled link and what the last step told about it."""

    body: int
    link: int
    handle: int
    local_inertia: Array
    mass: float
    residuals: tuple[Array, Array] = field(default_factory=lambda: (np.zeros(6), np.zeros(6)))
    wrench: Array = field(default_factory=lambda: np.zeros(6))


class FluidWorld:
    """A pybullet client with a fluid in it; made by `attach_fluid`."""

    def __init__(self, client: int, fluid: Fluid) -> None:
        self.fluid = fluid
        self._client = client
        self._links: dict[tuple[int, int], _Link] = {}
        self._damping_told = False

    def add_body(self, body: int, *, no_slip: bool = False) -> None:
        """Let a body meet the fluid from now on. Links smaller than a particle are left out with a warning; ValueError if
        no link is left.
        """
        joints = pybullet.getNumJoints(body, physicsClientId=self._client)
        before = len(self._links)
        for link in range(-1, joints):
            mesh = link_mesh(self._client, body, link)
            if mesh is None:
                continue
            try:
                self._add_link(body, link, mesh, no_slip)
            except UnresolvedSolidError as cause:
                warnings.warn(f"body {body}, link {link} does not meet the fluid: {cause}", stacklevel=3)
        if len(self._links) == before:
            raise ValueError(f"body {body} has no collision shape that the fluid can see, allowed: one link at least")

    def remove_body(self, body: int) -> None:
        """Take a body out of the fluid; call it before or after it is removed from the client."""
        for key in [key for key in self._links if key[0] == body]:
            self.fluid.remove_boundary(self._links.pop(key).handle)

    def wrench(self, body: int, link: int = -1) -> Array:
        """(6,) of the fluid on a link, mean over the last step: force [N], torque about its centre of mass [N m]."""
        return self._links[body, link].wrench.copy()

    def step(self) -> AdvanceReport:
        """One step of the client's own time step, fluid first; replaces `pybullet.stepSimulation`."""
        parameters = pybullet.getPhysicsEngineParameters(physicsClientId=self._client)
        duration = float(parameters["fixedTimeStep"])
        gravity = np.array([parameters[f"gravityAcceleration{axis}"] for axis in "XYZ"])
        before = {key: self._place(link, gravity) for key, link in self._links.items()}
        report = self.fluid.advance(duration)
        for link in self._links.values():
            link.wrench = self.fluid.boundary_wrench(link.handle)
            if link.mass > 0.0:
                self._push(link)
        pybullet.stepSimulation(physicsClientId=self._client)
        for key, link in self._links.items():
            if link.mass > 0.0:
                self._learn(link, *before[key], gravity, duration)
        return report

    def _add_link(self, body: int, link: int, mesh: trimesh.Trimesh, no_slip: bool) -> None:
        information = pybullet.getDynamicsInfo(body, link, physicsClientId=self._client)
        mass, inertia = float(information[0]), np.array(information[2], dtype=np.float64)
        if mass > 0.0:
            self._tell_inertia(body, link, mesh, mass, inertia)
        particles = particles_of(
            f"{body}/{link}", sample_surface(mesh, self.fluid.config.particle_spacing), no_slip=no_slip
        )
        self._links[body, link] = _Link(body, link, self.fluid.add_boundary(particles), inertia, mass)

    def _motion(self, link: _Link) -> tuple[Array, Array, Array]:
        """Position (3,), orientation (4,) and twist (6,) of the link's centre of mass."""
        if link.link < 0:
            position, orientation = pybullet.getBasePositionAndOrientation(link.body, physicsClientId=self._client)
            velocity = pybullet.getBaseVelocity(link.body, physicsClientId=self._client)
        else:
            state = pybullet.getLinkState(
                link.body, link.link, computeLinkVelocity=1, computeForwardKinematics=1, physicsClientId=self._client
            )
            position, orientation, velocity = state[0], state[1], state[6:8]
        return np.array(position), np.array(orientation), np.concatenate(velocity)

    def _place(self, link: _Link, gravity: Array) -> tuple[Array, Array]:
        """Tell the fluid where the link is and how it answers; returns its twist and inverse mass."""
        position, orientation, twist = self._motion(link)
        inverse_mass, acceleration = np.zeros((6, 6)), np.zeros(6)
        if link.mass > 0.0:
            rotation = Rotation.from_quat(orientation).as_matrix()
            inverse_mass[:3, :3] = np.eye(3) / link.mass
            inverse_mass[3:, 3:] = rotation @ np.diag(1.0 / np.maximum(link.local_inertia, 1e-12)) @ rotation.T
            acceleration = steady(*link.residuals)
            acceleration[:3] += gravity
        self.fluid.set_boundary_motion(
            link.handle, position, orientation, twist[:3], twist[3:], inverse_mass, acceleration
        )
        return twist, inverse_mass

    def _push(self, link: _Link) -> None:
        """Let the wrench act over the coming step and all its sub-steps."""
        position = self._motion(link)[0].tolist()
        force, torque, frame = link.wrench[:3].tolist(), link.wrench[3:].tolist(), pybullet.WORLD_FRAME
        client = self._client
        pybullet.applyExternalForce(link.body, link.link, force, position, frame, physicsClientId=client)
        pybullet.applyExternalTorque(link.body, link.link, torque, frame, physicsClientId=client)

    def _learn(self, link: _Link, twist: Array, inverse_mass: Array, gravity: Array, duration: float) -> None:
        """What of the last acceleration neither fluid nor gravity explains: joints, contacts, the user's own forces."""
        residual = (self._motion(link)[2] - twist) / duration - inverse_mass @ link.wrench
        residual[:3] -= gravity
        link.residuals = (link.residuals[1], residual)
        if not self._damping_told and link.link < 0:
            self._tell_damping(link, twist, residual)

    def _tell_damping(self, link: _Link, twist: Array, residual: Array) -> None:
        """Recognise pybullet's default damping, which cannot be asked for: -c v (1 + |v|) is all that is left over."""
        speed = float(np.linalg.norm(twist[:3]))
        expected = -DEFAULT_DAMPING * twist[:3] * (1.0 + speed)
        if speed > 0.05 and np.linalg.norm(residual[:3] - expected) < 0.05 * np.linalg.norm(expected):
            self._damping_told = True
            warnings.warn(
                f"body {link.body} is braked by pybullet's default damping (a fall ends at 15 m/s); "
                f"changeDynamics({link.body}, link, linearDamping=0, angularDamping=0, jointDamping=0) for the base (-1) "
                f"and every link takes it off",
                stacklevel=4,
            )

    @staticmethod
    def _tell_inertia(body: int, link: int, mesh: trimesh.Trimesh, mass: float, inertia: Array) -> None:
        """Recognise an inertia that is the bounding box's and not the solid's."""
        if not mesh.is_watertight or mesh.body_count > 1:
            return
        size2 = np.asarray(mesh.extents) ** 2
        of_box = mass / 12.0 * (size2.sum() - size2)
        of_solid = np.diag(mesh.moment_inertia) * mass / (float(mesh.volume) * float(mesh.density))
        if np.allclose(inertia, of_box, rtol=0.1) and not np.allclose(inertia, of_solid, rtol=0.2):
            warnings.warn(
                f"body {body}, link {link} has the inertia of its bounding box; changeDynamics({body}, {link}, "
                f"localInertiaDiagonal={[float(f'{value:.4g}') for value in of_solid]}) gives it its own, if it is solid "
                f"throughout",
                stacklevel=5,
            )


def attach_fluid(client: int, fluid: Fluid, bodies: Iterable[int], *, no_slip: bool = False) -> FluidWorld:
    """Put `fluid` into the pybullet client `client`, to meet the bodies with these unique ids.

    Particles inside a body are not looked for: fill the fluid around the bodies. A plane has no inside; give the fluid a
    tank instead (`oilsim.boundary.tank_walls`).
    """
    world = FluidWorld(client, fluid)
    for body in bodies:
        world.add_body(body, no_slip=no_slip)
    return world
