"""Fluid and bodies under the master, assembled in a few lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Literal

import numpy as np
import trimesh

from coupling.bullet.assembly import MONOLITHIC, ExchangeOptions, couple_world
from coupling.bullet.attachment_warnings import tell_thin_parts
from coupling.bullet.rigid_body_world import FRICTION, RigidBodyWorld
from coupling.master.body_exchange import BodyExchange
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection
from coupling.master.exchange_ledger import ExchangeLedger
from coupling.master.observer_dispatch import CommunicationPoint, Watching
from coupling.master.participant import Participant
from coupling.multibody.prescribed_motion import AT_REST, STILL, UPRIGHT, PrescribedMotion, Quaternion, Twist, Vector
from coupling.solids.bodies import MassProperties, mass_properties
from coupling.solids.signed_distance import SignedDistance
from coupling.solids.solid_mesh import told_solid
from coupling.solids.surface_sampling import particles_of, sample_surface
from coupling.solids.thin_parts import HELD
from coupling.testkit.faults import FaultPlan
from coupling.testkit.readings import Basin, placed, still_level
from coupling.testkit.run import TestRun, body_frame, describe, phase_frames, turnover
from oilsim import Fluid, FluidConfig, block, tank_walls
from oilsim.backend.arrays import Array
from oilsim.fluid.checks import finite
from recordings.model.frame import Frame

CLEARANCE = 0.5  # spacings between a body's surface and the nearest particle at the start
STEP = 0.01  # [s]
OFF_CENTER = 1e-6  # of a mesh's size: distance of its centre of mass from its origin, of meshes from files
TOUCHING = 0.5  # spacings that bodies may lie in each other at the start: rigid shapes of free bodies are convex


class Scene(TestRun):
    """A fluid and rigid bodies under the master: add bodies, then liquid around them, then run.

    fluid, world: the simulators. exchange, ledger: coupling and accounts of the run; None before. faults: what is to fail, see
    `coupling.testkit.faults`.
    """

    def __init__(
        self,
        config: FluidConfig,
        *,
        threads: int | None = 1,
        communication_step: float = STEP,
        exchange: ExchangeOptions = MONOLITHIC,
        name: str = "scene",
    ) -> None:
        super().__init__(name)
        self.fluid = Fluid(config, threads)
        self.world = RigidBodyWorld(gravity=config.gravity, communication_step=communication_step)
        self.meshes: dict[str, trimesh.Trimesh] = {}
        self._handles: dict[str, int] = {}
        self._step = communication_step
        self._options = exchange
        self.exchange: BodyExchange | None = None
        self.ledger: ExchangeLedger | None = None
        self.faults = FaultPlan()
        self._others: list[Participant] = []
        self._connections: list[Connection] = []
        self._gauges: dict[str, tuple[float, float]] = {}
        self._basin: Basin | None = None

    def add_walls(self, lower: Vector, upper: Vector, *, no_slip: bool = False, basin: Basin | None = None) -> None:
        """Add a tank that is open at the top, with its inside from `lower` to `upper` [m].

        `level` then refers to this tank, or to the part `basin` of it that holds the liquid.
        """
        sides = ("-x", "+x", "-y", "+y", "-z")
        self.fluid.add_boundary(tank_walls(lower, upper, self.spacing, sides=sides, no_slip=no_slip))
        self._basin = basin or Basin((upper[0] - lower[0]) * (upper[1] - lower[1]), lower[2])

    def add_body(
        self,
        name: str,
        mesh: trimesh.Trimesh,
        *,
        density: float,
        position: Vector,
        orientation: Quaternion = UPRIGHT,
        twist: Twist = AT_REST,
        motion: Literal["free", "fixed"] | PrescribedMotion = "free",
        no_slip: bool = False,
        touches: bool = True,
    ) -> None:
        """Add a body of even `density` [kg/m3]; `mesh` is about its centre of mass, `position` [m] is where that lies.

        The mesh is read as a solid (`coupling.solids.solid_mesh`): a warning tells what was mended, and sealed hollows stay dry. twist:
        (6,) linear and angular velocity at the start [m/s, rad/s]. no_slip: viscous liquids stick to the body. touches: it runs into
        other bodies and sides. Raises ValueError for a mesh that is no solid or not about its centre of mass, and once the run has begun.
        """
        self._require_not_begun(f"body {name!r}")
        solid = told_solid(mesh, f"scene: mesh of body {name!r}")
        properties, mesh = mass_properties(solid, density=density), solid.outer
        _require_centered(name, mesh, properties)
        least = self.spacing if motion == "free" else HELD * self.spacing
        sampling = sample_surface(mesh, self.spacing, minimum_thickness=least)
        tell_thin_parts(f"body {name!r}", sampling, float(mesh.volume))
        self.world.add_body(
            name,
            mesh,
            properties,
            position,
            orientation,
            motion=motion,
            twist=twist,
            friction=FRICTION if touches else None,
        )
        self._handles[name] = self.fluid.add_boundary(particles_of(name, sampling, no_slip=no_slip))
        self.meshes[name] = mesh

    def fill(self, lower: Vector, upper: Vector, *, phase: str = "water", velocity: Vector = STILL) -> int:
        """Add a block of liquid from `lower` to `upper` [m] around the bodies added so far, and return the number of particles.

        velocity (3,) [m/s]: of the liquid at the start. Raises ValueError for numbers that are not finite.
        """
        corners = (
            finite("scene: lower corner of the liquid", lower, 3),
            finite("scene: upper corner of the liquid", upper, 3),
        )
        finite("scene: velocity of the liquid", velocity, 3)
        points = block(*corners, self.spacing)
        for name in self.meshes:
            clearance = CLEARANCE * self.spacing * (1.0 - 1e-6)
            points = points[SignedDistance(self.placed(name)).phi(points) > clearance]
        self.fluid.add_particles(points, phase=phase, velocity=velocity)
        return len(points)

    @property
    def spacing(self) -> float:
        """Particle spacing [m]."""
        return self.fluid.config.particle_spacing

    def momentum(self) -> Array:
        """Return the momentum (6,) of fluid and free bodies: linear [kg m/s], and angular about the origin [kg m2/s]."""
        liquid = np.concatenate([self.fluid.momentum(), self.fluid.angular_momentum()])
        return np.asarray(liquid + self.world.momentum())

    def level(self) -> float:
        """Compute the height [m] at which the water would stand if it lay still in the tank around the bodies as they are.

        Raises ValueError for a scene without a tank.
        """
        if self._basin is None:
            raise ValueError("scene has no tank, whose level could be told, allowed: after add_walls")
        water = self.fluid.particle_count * self.fluid.config.rest_volume
        names = set(self.meshes) - set(self._basin.without)
        return still_level(self._basin, water, [self.placed(name) for name in sorted(names)])

    def draft(self, name: str) -> float:
        """Return the depth [m] of the body's lowest point below the still-water level; ValueError for a scene without a tank."""
        return self.level() - float(self.placed(name).bounds[0, 2])

    def placed(self, name: str) -> trimesh.Trimesh:
        """Return the body's mesh [m] in the world frame, at its present pose."""
        return placed(self.meshes[name], self.world.pose(name))

    def add_gauge(self, name: str, at: tuple[float, float]) -> None:
        """Measure the height [m] of the surface at (x, y) [m] from now on, the series `probes/NAME`; ValueError once the run has begun."""
        self._require_not_begun(f"gauge {name!r}")
        self._gauges[name] = (float(at[0]), float(at[1]))

    def add_participant(self, participant: Participant, connections: Sequence[Connection] = ()) -> None:
        """Let an FMU, a controller or anything else take part, which steps before fluid and bodies.

        connections: of its variables with others; the bodies are the participant "bodies" (`coupling.bullet`), the fluid
        is "fluid". Raises ValueError once the run has begun.
        """
        self._require_not_begun(f"participant {participant.name!r}")
        self._others.append(participant)
        self._connections += connections

    def _begun_simulation(self) -> CoSimulation:
        self._simulation = simulation = (
            self._coupled()
        )  # known before it begins: where that fails, it is not made again
        simulation.initialize()
        return simulation

    def _terms(self) -> dict[str, Any]:
        world = self.world
        turned = partial(turnover, world, self.meshes)
        return self._fluid_terms(self.fluid, self._basin, momentum=world.momentum, energy=world.energy, turnover=turned)

    def _release(self) -> None:
        self.fluid.close()
        self.world.close()

    def _coupled(self) -> CoSimulation:
        if self.meshes:
            self._refuse_overlaps()
        coupled = couple_world(self.fluid, self._handles, self.world if self.meshes else None, self._options)
        self.exchange, self.ledger = coupled.exchange, coupled.ledger
        others = [*self.faults.clock(self.world), *self._others]
        self.faults.require_met([one.name for one in (*others, *coupled.participants)])
        return coupled.co_simulation(
            self._step,
            others=others,
            connections=self._connections,
            alter=self.faults.applied,
            watching=Watching(
                self.faults.observers([self.history, *self._observers]),
                self._frames(),
                describe(self.name, self.fluid, self.meshes),
            ),
        )

    def _last_frame(self) -> Frame:
        return self._frames()(self.simulation.communication_point)

    def _frames(self) -> SceneFrames:
        return SceneFrames(self.fluid, self.world, self._gauges)

    def _refuse_overlaps(self) -> None:
        """Refuse bodies that lie deep in each other or in a side, since the first step would throw them apart."""
        allowed = TOUCHING * self.spacing
        for one, other, depth in self.world.overlaps():
            if depth > allowed:
                where = f"body {other!r}" if other else "a side of the tank"
                raise ValueError(
                    f"scene: body {one!r} lies {depth:.2g} m deep in {where} at the start, allowed: up to {allowed:.2g} m"
                )


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
            bodies={name: body_frame(world, name, world.wrench(name)) for name in world.body_names},
            scalars=scalars,
            read_phases=lambda: phase_frames(fluid),
        )


def _require_centered(name: str, mesh: trimesh.Trimesh, properties: MassProperties) -> None:
    """Refuse a mesh whose centre of mass is not its origin, about which it would be turned and pushed."""
    if np.linalg.norm(properties.center_of_mass) > OFF_CENTER * np.max(mesh.extents):
        raise ValueError(
            f"scene: mesh of body {name!r} has its centre of mass at {properties.center_of_mass.tolist()} m, allowed: at 0; "
            "coupling.solids.bodies.about_center_of_mass puts it there"
        )
