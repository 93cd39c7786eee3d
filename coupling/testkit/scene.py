"""Fluid and bodies under the master, assembled in a few lines: a tank of water, or empty space."""

from __future__ import annotations

import math
from types import TracebackType
from typing import Literal

import numpy as np
import trimesh
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from coupling.assembly import MONOLITHIC, ExchangeOptions, couple_world
from coupling.bodies import MassProperties, mass_properties
from coupling.master.body_exchange import BodyExchange
from coupling.master.co_simulation import CoSimulation
from coupling.master.exchange_ledger import ExchangeLedger
from coupling.participant import Array
from coupling.pybullet_world.attachment_warnings import tell_thin_parts
from coupling.rigid.prescribed_motion import AT_REST, STILL, UPRIGHT, PrescribedMotion, Quaternion, Twist, Vector
from coupling.rigid.rigid_body_world import RigidBodyWorld
from coupling.solids.hydrostatics import hydrostatics
from coupling.solids.signed_distance import SignedDistance
from coupling.solids.solid_mesh import told_solid
from coupling.solids.surface_sampling import particles_of, sample_surface
from coupling.solids.thin_parts import HELD
from oilsim.boundaries.boundary_particles import tank_walls
from oilsim.checks import finite
from oilsim.config import FluidConfig
from oilsim.initial_conditions import block
from oilsim.phases import Phase
from oilsim.solver import Fluid

WATER = Phase(name="water", rest_density=1000.0)
CLEARANCE = 0.5  # spacings between a body's surface and the nearest particle at the start
STEP = 0.01  # [s]
OFF_CENTER = 1e-6  # of a mesh's size: distance of its centre of mass from its origin, of meshes from files
TOUCHING = 0.5  # spacings that bodies may lie in each other at the start: rigid shapes of free bodies are convex


class Scene:
    """A fluid and rigid bodies under the master: add bodies, then liquid around them, then run.

    fluid, world: the simulators. simulation: the coupled run, made at the first access. exchange, ledger: coupling and accounts of the run;
    None before. bottom: height [m] of the tank's floor, or of the domain's. Use a scene in a `with` block, which ends the run.
    """

    def __init__(
        self,
        config: FluidConfig,
        *,
        threads: int | None = 1,
        communication_step: float = STEP,
        exchange: ExchangeOptions = MONOLITHIC,
    ) -> None:
        self.fluid = Fluid(config, threads)
        self.world = RigidBodyWorld(gravity=config.gravity, communication_step=communication_step)
        self.meshes: dict[str, trimesh.Trimesh] = {}
        self._handles: dict[str, int] = {}
        self._step = communication_step
        self._options = exchange
        self._simulation: CoSimulation | None = None
        self.exchange: BodyExchange | None = None
        self.ledger: ExchangeLedger | None = None
        self._level_area: float | None = None
        self.bottom = config.lower[2]

    def __enter__(self) -> Scene:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the run and release the fluid and the world."""
        if self._simulation is not None:
            self._simulation.terminate()
        self.fluid.close()
        self.world.close()

    def add_walls(self, lower: Vector, upper: Vector, *, no_slip: bool = False) -> None:
        """Add a tank that is open at the top, with its inside from `lower` to `upper` [m]; `level` then refers to this tank."""
        sides = ("-x", "+x", "-y", "+y", "-z")
        self.fluid.add_boundary(tank_walls(lower, upper, self.spacing, sides=sides, no_slip=no_slip))
        self._level_area = (upper[0] - lower[0]) * (upper[1] - lower[1])
        self.bottom = lower[2]

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
    ) -> None:
        """Add a body of even `density` [kg/m3]; `mesh` is about its centre of mass, `position` [m] is where that lies.

        The mesh is read as a solid (`coupling.solids.solid_mesh`): a warning tells what was mended, and sealed hollows stay dry. twist:
        (6,) linear and angular velocity at the start [m/s, rad/s]. no_slip: viscous liquids stick to the body. Raises ValueError for a mesh
        that is no solid or not about its centre of mass, and once the run has begun.
        """
        if self._simulation is not None:
            raise ValueError(f"scene: body {name!r} is added after the run has begun, allowed: before")
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

    @property
    def simulation(self) -> CoSimulation:
        """The coupled run, made at the first access; no bodies can be added afterwards."""
        if self._simulation is None:
            self._simulation = self._coupled()
            self._simulation.initialize()
        return self._simulation

    def run(self, duration: float) -> None:
        """Run for `duration` [s], in whole communication steps; ValueError for a duration that is not above 0."""
        if not (math.isfinite(duration) and duration > 0.0):
            raise ValueError(f"scene: duration of the run is {duration} s, allowed: above 0")
        self.simulation.run(self.simulation.communication_point.time + duration)

    def step(self) -> None:
        """Make one communication step."""
        self.simulation.step()

    def momentum(self) -> Array:
        """Return the momentum (6,) of fluid and free bodies: linear [kg m/s], and angular about the origin [kg m2/s]."""
        liquid = np.concatenate([self.fluid.momentum(), self.fluid.angular_momentum()])
        return np.asarray(liquid + self.world.momentum())

    def level(self) -> float:
        """Compute the height [m] at which the water would stand if it lay still in the tank around the bodies as they are.

        Solves A (level - bottom) = V_water + V_displaced(level), between the levels with all bodies dry and with all submerged. Raises
        ValueError for a scene without a tank.
        """
        if self._level_area is None:
            raise ValueError("scene has no tank, whose level could be told, allowed: after add_walls")
        area, water = self._level_area, self.fluid.particle_count * self.fluid.config.rest_volume
        bodies = [self.placed(name) for name in self.meshes]
        lowest = self.bottom + water / area
        highest = lowest + sum(float(mesh.volume) for mesh in bodies) / area

        def missing(level: float) -> float:
            return area * (level - self.bottom) - water - sum(_displaced(mesh, level) for mesh in bodies)

        return float(brentq(missing, lowest, highest)) if missing(lowest) < 0.0 else lowest

    def draft(self, name: str) -> float:
        """Return the depth [m] of the body's lowest point below the still-water level; ValueError for a scene without a tank."""
        return self.level() - float(self.placed(name).bounds[0, 2])

    def placed(self, name: str) -> trimesh.Trimesh:
        """Return the body's mesh in the world frame, at its present pose."""
        pose, mesh = self.world.pose(name), self.meshes[name].copy()
        mesh.vertices = Rotation.from_quat(pose[3:]).apply(mesh.vertices) + pose[:3]
        return mesh

    def _coupled(self) -> CoSimulation:
        if self.meshes:
            self._refuse_overlaps()
        coupled = couple_world(self.fluid, self._handles, self.world if self.meshes else None, self._options)
        self.exchange, self.ledger = coupled.exchange, coupled.ledger
        return coupled.co_simulation(self._step)

    def _refuse_overlaps(self) -> None:
        """Refuse bodies that lie deep in each other or in a side, since the first step would throw them apart."""
        allowed = TOUCHING * self.spacing
        for one, other, depth in self.world.overlaps():
            if depth > allowed:
                where = f"body {other!r}" if other else "a side of the tank"
                raise ValueError(
                    f"scene: body {one!r} lies {depth:.2g} m deep in {where} at the start, allowed: up to {allowed:.2g} m"
                )


def _require_centered(name: str, mesh: trimesh.Trimesh, properties: MassProperties) -> None:
    """Refuse a mesh whose centre of mass is not its origin, about which it would be turned and pushed."""
    if np.linalg.norm(properties.center_of_mass) > OFF_CENTER * np.max(mesh.extents):
        raise ValueError(
            f"scene: mesh of body {name!r} has its centre of mass at {properties.center_of_mass.tolist()} m, allowed: at 0; "
            "coupling.bodies.about_center_of_mass puts it there"
        )


def _displaced(mesh: trimesh.Trimesh, level: float) -> float:
    """Return the volume [m3] of a mesh below a level [m]."""
    return hydrostatics(mesh, level).displaced_volume if level > mesh.bounds[0, 2] else 0.0


def tank(
    *,
    size: Vector,
    depth: float,
    particle_spacing: float,
    phase: Phase = WATER,
    sleep_speed: float = 0.0,
    exchange: ExchangeOptions = MONOLITHIC,
) -> TankScene:
    """Create a tank from the origin to `size` [m], open at the top, which fills to `depth` [m] around its bodies when the run begins.

    Regions that move at less than `sleep_speed` [m/s] fall asleep (`oilsim.step.sleeping_regions`). Raises ValueError for a size that is
    not above 0, and for a depth that is not above 0 or exceeds the tank's height.
    """
    if not (finite("tank: size", size, 3) > 0.0).all():
        raise ValueError(f"tank: size is {size} m, allowed: above 0")
    if not 0.0 < depth <= size[2]:
        raise ValueError(f"tank: depth is {depth} m, allowed: above 0, to its height of {size[2]} m")
    margin = 4.0 * particle_spacing
    config = FluidConfig(
        particle_spacing=particle_spacing,
        phases=(phase,),
        lower=(-margin, -margin, -margin),
        upper=(size[0] + margin, size[1] + margin, size[2] + margin),
        divergence_iterations=400,
        sleep_speed=sleep_speed,
    )
    return TankScene(config, size, depth, exchange)


class TankScene(Scene):
    """A scene in a tank that fills itself when its run begins."""

    def __init__(
        self,
        config: FluidConfig,
        size: Vector,
        depth: float,
        exchange: ExchangeOptions = MONOLITHIC,
    ) -> None:
        super().__init__(config, exchange=exchange)
        self._size, self._depth = size, depth
        self.add_walls((0.0, 0.0, 0.0), size)
        for corner, inward in (((0.0, 0.0, 0.0), np.eye(3)), (size, -np.eye(3)[:2])):
            for x, y, z in inward.tolist():
                self.world.add_half_space(corner, (x, y, z))

    def _coupled(self) -> CoSimulation:
        width, length, _ = self._size
        self.fill((0.0, 0.0, 0.0), (width, length, self._depth), phase=self.fluid.config.phases[0].name)
        return super()._coupled()


def empty_space(
    *,
    size: Vector,
    particle_spacing: float,
    phases: tuple[Phase, ...] = (WATER,),
    communication_step: float = STEP,
    exchange: ExchangeOptions = MONOLITHIC,
) -> Scene:
    """Create a scene without walls and gravity in a domain of `size` [m] about the origin, in which momentum is constant.

    Angular momentum is constant up to rounding if fluid and bodies each make one step of their own in each `communication_step` [s]; a
    step of the bodies is 1/240 s or less. With more steps, the fluid and the moving body count one impulse at different places.
    """
    x, y, z = (0.5 * length for length in size)
    config = FluidConfig(
        particle_spacing=particle_spacing, phases=phases, lower=(-x, -y, -z), upper=(x, y, z), gravity=(0.0, 0.0, 0.0)
    )
    return Scene(config, communication_step=communication_step, exchange=exchange)
