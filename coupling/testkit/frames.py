"""Descriptions and frames of runs that no scenario describes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import trimesh

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.observer_dispatch import CommunicationPoint
from oilsim import Fluid
from recordings.model.frame import BodyFrame, Frame, MeshDescription, PhaseDescription, PhaseFrame, RunDescription

Array = npt.NDArray[np.float64]


def describe(name: str, fluid: Fluid, meshes: Mapping[str, trimesh.Trimesh]) -> RunDescription:
    """Describe a run of a fluid and bodies with these meshes [m], about their centres of mass.

    Walls are all boundaries that stand still.
    """
    moving = set(fluid.moving_boundaries)
    walls = [fluid.boundary_positions(handle) for handle in fluid.boundaries if handle not in moving]
    phases = fluid.config.phases
    return RunDescription(
        name=name,
        particle_spacing=fluid.config.particle_spacing,
        dimension=fluid.config.dimension,
        phases=tuple(
            PhaseDescription(
                name=phase.name,
                rest_density=phase.rest_density,
                dynamic_viscosity=phase.dynamic_viscosity,
                is_oil="oil" in phase.name,
            )
            for phase in phases
        ),
        meshes={one: MeshDescription(vertices=mesh.vertices, faces=mesh.faces) for one, mesh in meshes.items()},
        boundaries={"tank": np.concatenate(walls).astype(np.float32)} if walls else {},
    )


def particles_of(fluid: Fluid) -> dict[str, PhaseFrame]:
    """Return a copy of the particles of each phase."""
    return {
        phase.name: PhaseFrame(position=fluid.phase_positions(phase.name), id=fluid.phase_ids(phase.name))
        for phase in fluid.config.phases
    }


def with_particles(frame: Frame) -> Frame:
    """Return the frame after its particles have been read."""
    frame.read_particles()
    return frame


class SceneFrames:
    """Makes the frames of a scene: bodies, gauges and tensions at once, particles on request.

    gauges: places (x, y) [m] of wave gauges by name, the series `probes/NAME` [m].
    """

    def __init__(self, fluid: Fluid, world: RigidBodyWorld, gauges: Mapping[str, tuple[float, float]]) -> None:
        self._fluid, self._world = fluid, world
        self._gauges = tuple(gauges)
        self._places = np.array(list(gauges.values()), dtype=np.float64).reshape(-1, 2)

    def __call__(self, point: CommunicationPoint) -> Frame:
        """Return the frame at a communication point."""
        fluid, world = self._fluid, self._world
        scalars = {f"tension/{name}": world.tension(name) for name in (*world.joint_names, *world.lines.names)}
        if self._gauges:
            heights = fluid.surface_height_at(self._places).tolist()
            scalars |= {f"probes/{name}": height for name, height in zip(self._gauges, heights, strict=True)}
        return Frame(
            index=point.index,
            time=point.time,
            bodies={name: self._body(name) for name in world.body_names},
            scalars=scalars,
            read_phases=lambda: particles_of(fluid),
        )

    def _body(self, name: str) -> BodyFrame:
        world = self._world
        pose, twist = world.pose(name), world.twist(name)
        return BodyFrame(
            position=pose[:3],
            orientation=pose[3:],
            linear_velocity=twist[:3],
            angular_velocity=twist[3:],
            wrench=world.wrench(name),
        )


def turnover(world: RigidBodyWorld, meshes: Mapping[str, trimesh.Trimesh]) -> tuple[float, float, float]:
    """Return sum m |v| [kg m/s] and sum |I omega| [kg m2/s] of free bodies, and how far [m] the furthest reaches from the origin.

    meshes: by body, about its centre of mass [m].
    """
    moving = spin = far = 0.0
    for body in world.free_body_names:
        momentum = world.mass_matrix(body) @ world.twist(body)
        moving += float(np.linalg.norm(momentum[:3]))
        spin += float(np.linalg.norm(momentum[3:]))
        extent = float(np.linalg.norm(meshes[body].vertices, axis=1).max())
        far = max(far, float(np.linalg.norm(world.pose(body)[:3])) + extent)
    return moving, spin, far
