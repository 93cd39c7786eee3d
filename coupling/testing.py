"""Small scenes and checks for scripted tests of how fluid and bodies act on each other.

    with tank(size=(0.6, 0.6, 0.8), depth=0.3, particle_spacing=0.05) as scene:
        scene.add_body("raft", box((0.3, 0.3, 0.2)), density=500.0, position=(0.3, 0.3, 0.3))
        scene.run(1.5)
        assert_draft(scene, "raft", 0.1, within=0.05)

A check that fails raises AssertionError with what was found and what was expected. `FaultyParticipant` makes any participant
fail at a chosen step, to test what a master or an exercise does then.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import TracebackType
from typing import Literal

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from coupling.bodies import mass_properties
from coupling.body_exchange import BodyExchange, BodyInterface, Scheme
from coupling.co_simulation import CoSimulation
from coupling.connection import Connection
from coupling.exchange_ledger import ENERGY_LIMIT, BodyBond, ExchangeLedger
from coupling.faults import Fault, FaultyParticipant
from coupling.fixed_point import Aitken, Iteration
from coupling.hydrostatics import hydrostatics
from coupling.motion import STILL, UPRIGHT, PrescribedMotion, Quaternion, Vector
from coupling.participant import Array
from coupling.participants.fluid import FluidParticipant
from coupling.participants.rigid_bodies import RigidBodyParticipant, RigidBodyWorld
from coupling.signed_distance import SignedDistance
from coupling.surface_sampling import boundary_particles
from oilsim.boundary import tank_walls
from oilsim.config import FluidConfig
from oilsim.diagnostics import angular_momentum
from oilsim.initial_conditions import block
from oilsim.phases import Phase
from oilsim.solver import Fluid

__all__ = [
    "Fault", "FaultyParticipant", "Scene", "TankScene", "assert_draft", "assert_momentum_conserved",
    "assert_pressure_hydrostatic", "empty_space", "tank",
]  # fmt: skip

WATER = Phase(name="water", rest_density=1000.0)
CLEARANCE = 0.5  # spacings between a body's surface and the nearest particle at the start
STEP = 0.01  # [s]


class Scene:
    """A fluid and rigid bodies under the master: add bodies, then liquid around them, then run.

    fluid, world: the simulators; simulation: the coupled run, made when it is first asked for; exchange, ledger: its coupling
    and accounts from then on; energy_limit: of the ledger (see `exchange_ledger`), to be set before. `scheme` couples all bodies in
    one way, with `iteration` where it iterates; None: inside the pressure solve. Use it in a `with` block, which ends the run.
    """

    def __init__(
        self,
        config: FluidConfig,
        *,
        threads: int | None = 1,
        communication_step: float = STEP,
        scheme: Scheme | None = None,
        iteration: Callable[[float], Iteration] = Aitken,
    ) -> None:
        self.fluid = Fluid(config, threads)
        self.world = RigidBodyWorld(gravity=config.gravity, communication_step=communication_step)
        self.meshes: dict[str, trimesh.Trimesh] = {}
        self._handles: dict[str, int] = {}
        self._step = communication_step
        self._scheme = scheme
        self._iteration = iteration
        self._simulation: CoSimulation | None = None
        self.exchange: BodyExchange | None = None
        self.ledger: ExchangeLedger | None = None
        self.energy_limit = ENERGY_LIMIT
        self._level_area: float | None = None
        self._bottom = config.lower[2]

    def __enter__(self) -> Scene:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the run and give everything back."""
        if self._simulation is not None:
            self._simulation.terminate()
        self.fluid.close()
        self.world.close()

    def add_walls(self, lower: Vector, upper: Vector, *, no_slip: bool = False) -> None:
        """A tank open at the top, whose inside is lower to upper [m]; the still-water level is that in it."""
        sides = ("-x", "+x", "-y", "+y", "-z")
        self.fluid.add_boundary(tank_walls(lower, upper, self.spacing, sides=sides, no_slip=no_slip))
        self._level_area = (upper[0] - lower[0]) * (upper[1] - lower[1])
        self._bottom = lower[2]

    def add_body(
        self,
        name: str,
        mesh: trimesh.Trimesh,
        *,
        density: float,
        position: Vector,
        orientation: Quaternion = UPRIGHT,
        linear_velocity: Vector = STILL,
        angular_velocity: Vector = STILL,
        motion: Literal["free", "fixed"] | PrescribedMotion = "free",
        no_slip: bool = False,
    ) -> None:
        """A body of even `density` [kg/m3]; `mesh` is about its centre of mass, `position` [m] is where that lies."""
        self.world.add_body(
            name,
            mesh,
            mass_properties(mesh, density=density),
            position,
            orientation,
            motion=motion,
            linear_velocity=linear_velocity,
            angular_velocity=angular_velocity,
        )
        surface = boundary_particles(name, mesh, self.spacing, no_slip=no_slip)
        self._handles[name] = self.fluid.add_boundary(surface)
        self.meshes[name] = mesh

    def fill(self, lower: Vector, upper: Vector, *, phase: str = "water", velocity: Vector = STILL) -> int:
        """A block of liquid, lower to upper [m], around the bodies that are there; returns the number of particles."""
        points = block(lower, upper, self.spacing)
        for name in self.meshes:
            clearance = CLEARANCE * self.spacing * (1.0 - 1e-6)
            points = points[SignedDistance(self._placed(name)).phi(points) > clearance]
        self.fluid.add_particles(points, phase=phase, velocity=velocity)
        return len(points)

    @property
    def spacing(self) -> float:
        """Particle spacing [m]."""
        return self.fluid.config.particle_spacing

    @property
    def simulation(self) -> CoSimulation:
        """The coupled run; no bodies can be added once it has been asked for."""
        if self._simulation is None:
            self._simulation = self._coupled()
            self._simulation.initialize()
        return self._simulation

    def run(self, duration: float) -> None:
        """Go on by `duration` [s], in whole communication steps."""
        self.simulation.run(self.simulation.communication_point.time + duration)

    def step(self) -> None:
        """One communication step."""
        self.simulation.step()

    def momentum(self) -> Array:
        """(6,) of fluid and free bodies: linear [kg m/s], angular about the origin [kg m2/s]."""
        fluid = self.fluid
        spin = angular_momentum(fluid.state, fluid.config)
        return np.asarray(np.concatenate([fluid.momentum(), spin]) + self.world.momentum())

    def level(self) -> float:
        """Height [m] at which the water would stand if it lay still in the tank around the bodies as they are.

        A (level - bottom) = V_water + V_displaced(level), by fixed point (the bodies' waterplanes are smaller than the tank).
        """
        if self._level_area is None:
            raise ValueError("scene has no tank, whose level could be told, allowed: after add_walls")
        water = self.fluid.particle_count * self.fluid.config.rest_volume
        level = self._bottom + water / self._level_area
        for _ in range(60):
            displaced = sum(self._displaced(name, level) for name in self.meshes)
            level = self._bottom + (water + displaced) / self._level_area
        return level

    def draft(self, name: str) -> float:
        """Depth [m] of the body's lowest point below the still-water level."""
        return self.level() - float(self._placed(name).bounds[0, 2])

    def _placed(self, name: str) -> trimesh.Trimesh:
        """The body's mesh where it is."""
        pose, mesh = self.world.pose(name), self.meshes[name].copy()
        mesh.vertices = Rotation.from_quat(pose[3:]).apply(mesh.vertices) + pose[:3]
        return mesh

    def _displaced(self, name: str, level: float) -> float:
        mesh = self._placed(name)
        return hydrostatics(mesh, level).displaced_volume if level > mesh.bounds[0, 2] else 0.0

    def _coupled(self) -> CoSimulation:
        fluid = FluidParticipant("fluid", self.fluid, self._handles)
        if not self.meshes:
            return CoSimulation([fluid], [], self._step)
        bodies = RigidBodyParticipant("bodies", self.world)
        tells = ("pose", "twist", "inverse_mass", "free_acceleration") if self._scheme is None else ("pose", "twist")
        there = [
            Connection("bodies", f"{body}.{what}", "fluid", f"{body}.{what}") for body in self.meshes for what in tells
        ]
        back = [Connection("fluid", f"{body}.wrench", "bodies", f"{body}.wrench") for body in self.meshes]
        interfaces = [
            BodyInterface(
                body=body,
                fluid="fluid",
                solver="bodies",
                added_mass=partial(fluid.added_mass, body),
                mass_matrix=partial(self.world.mass_matrix, body),
                gravity=self.fluid.config.gravity,
                scheme=self._scheme,
            )
            for body in self.world.free_body_names
        ]
        exchange = self.exchange = BodyExchange(interfaces, iteration=self._iteration)
        self.ledger = ExchangeLedger(
            [BodyBond(body, "fluid", "bodies") for body in self.world.free_body_names],
            self.spacing,
            energy_limit=self.energy_limit,
            disturbed=lambda: self.world.disturbed,
        )
        return CoSimulation([fluid, bodies], [*there, *back], self._step, algorithm=exchange, ledger=self.ledger)


def tank(
    *,
    size: Vector,
    depth: float,
    particle_spacing: float,
    phase: Phase = WATER,
    sleep_speed: float = 0.0,
    scheme: Scheme | None = None,
    iteration: Callable[[float], Iteration] = Aitken,
) -> TankScene:
    """A tank from the origin to `size` [m], open at the top, to be filled to `depth` [m] around the bodies added to it.

    Regions that move at less than `sleep_speed` [m/s] fall asleep (`oilsim.sleeping_regions`).
    """
    margin = 4.0 * particle_spacing
    config = FluidConfig(
        particle_spacing=particle_spacing,
        phases=(phase,),
        lower=(-margin, -margin, -margin),
        upper=(size[0] + margin, size[1] + margin, size[2] + margin),
        divergence_iterations=400,
        sleep_speed=sleep_speed,
    )
    return TankScene(config, size, depth, scheme=scheme, iteration=iteration)


class TankScene(Scene):
    """A scene in a tank that fills itself when its run begins."""

    def __init__(
        self,
        config: FluidConfig,
        size: Vector,
        depth: float,
        *,
        scheme: Scheme | None,
        iteration: Callable[[float], Iteration],
    ) -> None:
        super().__init__(config, scheme=scheme, iteration=iteration)
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
    scheme: Scheme | None = None,
) -> Scene:
    """No walls and no gravity within `size` [m] about the origin: momentum is constant whatever happens.

    Angular momentum is constant to rounding where fluid and bodies make one step of their own in each `communication_step` [s]; bodies
    make one in 1/240 s or less. Otherwise an impulse acts on a moving body at other places on the one side than on the other.
    """
    x, y, z = (0.5 * length for length in size)
    config = FluidConfig(
        particle_spacing=particle_spacing, phases=phases, lower=(-x, -y, -z), upper=(x, y, z), gravity=(0.0, 0.0, 0.0)
    )
    return Scene(config, communication_step=communication_step, scheme=scheme)


def assert_draft(scene: Scene, body: str, expected: float, *, within: float) -> None:
    """The body's lowest point lies `expected` [m] below the still-water level, give or take `within` [m]."""
    found = scene.draft(body)
    assert abs(found - expected) <= within, (
        f"draft of {body!r} is {found:.5g} m, expected: {expected:.5g} m within {within:.3g} m"
    )


def assert_momentum_conserved(
    scene: Scene, *, steps: int = 1, within: float = 1e-6, angular_within: float | None = None
) -> None:
    """Fluid and bodies, without walls and gravity, keep their momentum over each of the next `steps`.

    `within` is relative to sum m |v| of all that moves, `angular_within` (`within` if None) to that times the largest distance
    of a particle from the origin.
    """
    assert scene.simulation.is_running, "scene does not run any more, expected: a run that has not ended"
    limits = within, within if angular_within is None else angular_within
    for _ in range(steps):
        before, earlier = scene.momentum(), _turnover(scene)
        scene.step()
        change, later = scene.momentum() - before, _turnover(scene)
        turnover, reach = max(earlier[0], later[0]), max(earlier[1], later[1])
        for part, scale, limit, unit in (
            (change[:3], turnover, limits[0], "N s"),
            (change[3:], turnover * reach, limits[1], "N m s"),
        ):
            worst = float(np.abs(part).max())
            assert worst <= limit * scale, (
                f"momentum changes by {part.tolist()} {unit} in the step to {scene.simulation.communication_point.time:.6g} s, "
                f"where {scale:.3g} {unit} move, expected: {limit:.3g} of that at most"
            )


def _turnover(scene: Scene) -> tuple[float, float]:
    """sum m |v| [kg m/s] of fluid and bodies, and the reach [m] of the fluid about the origin."""
    state, config = scene.fluid.state, scene.fluid.config
    mass = config.rest_volume * np.array([phase.rest_density for phase in config.phases])[state.phase]
    speed = np.linalg.norm(state.velocity.astype(np.float64), axis=0)
    moving = float(mass @ speed) + float(np.linalg.norm(scene.world.momentum()[:3]))
    return moving, float(np.linalg.norm(state.position, axis=0).max(initial=scene.spacing))


def assert_pressure_hydrostatic(
    scene: Scene, *, at: tuple[float, float], within: float, density: float = 1000.0
) -> None:
    """Below the point `at` (x, y) [m] pressure is rho g (level - z), within the part `within` of that at the bottom.

    Compared from the bottom to two spacings below the level, a spacing apart.
    """
    level, bottom, gravity = scene.level(), scene._bottom, abs(scene.fluid.config.gravity[2])
    heights = np.arange(bottom + 0.5 * scene.spacing, level - 2.0 * scene.spacing, scene.spacing)
    assert len(heights), (
        f"water is {level - bottom:.3g} m deep, expected: three spacings, {3 * scene.spacing:.3g} m, or more"
    )
    found = scene.fluid.pressure_at(
        np.column_stack([np.full(len(heights), at[0]), np.full(len(heights), at[1]), heights])
    )
    expected = density * gravity * (level - heights)
    error = np.abs(found - expected) / (density * gravity * (level - bottom))
    worst = int(np.argmax(error))
    assert error[worst] <= within, (
        f"pressure at z = {heights[worst]:.5g} m is {found[worst]:.5g} Pa, expected: {expected[worst]:.5g} Pa within "
        f"{within:.3g} of that at the bottom"
    )
