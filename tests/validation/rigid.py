"""Bodies of the cases: solids in three dimensions and discs in two, held or free, and the tanks they lie in."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from coupling.solids.bodies import mass_properties
from coupling.solids.hydrostatics import waterline_for_volume
from coupling.solids.signed_distance import SignedDistance
from coupling.solids.surface_sampling import PITCH, boundary_particles
from coupling.solids.surface_shape import surface_shape
from oilsim import BoundaryParticles, Fluid, FluidConfig, Phase, block, tank_walls
from tests.validation.case import Bench
from tests.validation.scenes import GRAVITY

Double = NDArray[np.float64]

CLEARANCE = 0.3  # spacings from a body's surface within which no particle is put
DISORDER = 0.3  # spacings by which a particle is put off its lattice at most, along each axis


@dataclass
class Body:
    """A body in a fluid. inverse_inertia (3, 3) along its axes; `freedoms` (6,) 0 or 1: which of its velocities forces may change."""

    fluid: Fluid
    boundary: BoundaryParticles
    mass: float
    inverse_inertia: Double
    position: Double
    freedoms: Double = field(default_factory=lambda: np.zeros(6))
    twist: Double = field(default_factory=lambda: np.zeros(6))
    orientation: Double = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))

    def __post_init__(self) -> None:
        self.handle = self.fluid.add_boundary(self.boundary)

    @property
    def rotation(self) -> Double:
        """(3, 3) from the body's axes to the world's."""
        return Rotation.from_quat(self.orientation).as_matrix()

    def advance(self, bench: Bench, duration: float, pull: Double | None = None) -> Double:
        """Move fluid and body on by `duration` [s], under a `pull` (6,) besides gravity; returns the fluid's wrench (6,) on it [N, N m]."""
        inverse_mass = np.zeros((6, 6))
        inverse_mass[:3, :3] = np.eye(3) / self.mass
        inverse_mass[3:, 3:] = self.rotation @ self.inverse_inertia @ self.rotation.T
        inverse_mass *= np.outer(self.freedoms, self.freedoms)
        fall = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0]) * self.freedoms
        fall += 0.0 if pull is None else inverse_mass @ pull
        self.fluid.set_boundary_motion(
            self.handle, self.position, self.orientation, self.twist[:3], self.twist[3:], inverse_mass, fall
        )
        bench.advance(self.fluid, duration)
        self.position, self.orientation, self.twist = self.fluid.boundary_motion(self.handle)
        return self.fluid.boundary_wrench(self.handle)


def solid_tank(
    bench: Bench, side: float, depth: float, spacing: float, phases: tuple[Phase, ...], **options: object
) -> tuple[Fluid, Double]:
    """A square tank [m], open above, empty; and the lattice of points that fills it to `depth`."""
    room = 4.0 * spacing
    config = FluidConfig(
        particle_spacing=spacing, phases=phases, lower=(-room, -room, -room), upper=(side + room, side + room, 2.0 * depth),
        **options,  # type: ignore[arg-type]
    )  # fmt: skip
    fluid = bench.fluid(config)
    sides = ("-x", "+x", "-y", "+y", "-z")
    fluid.add_boundary(tank_walls((0, 0, 0), (side, side, 1.6 * depth), spacing, sides=sides))
    return fluid, block((0, 0, 0), (side, side, depth), spacing)


def put_solid(fluid: Fluid, mesh: trimesh.Trimesh, density: float, position: Double) -> Body:
    """A solid (its mesh about its centre of mass) of `density` [kg/m3], held until its freedoms are set."""
    properties = mass_properties(mesh, density=density)
    boundary = boundary_particles("solid", mesh, fluid.config.particle_spacing)
    return Body(fluid, boundary, properties.mass, np.linalg.inv(properties.inertia), np.asarray(position, np.float64))


def disordered(points: Double, spacing: float) -> Double:
    """Points (n, 3) of a lattice, each moved at random: a lattice holds a body that does not fit between its layers for seconds."""
    return points + DISORDER * spacing * np.random.default_rng(0).uniform(-1.0, 1.0, points.shape)


def outside(points: Double, mesh: trimesh.Trimesh, position: Double, spacing: float) -> Double:
    """Those of the points (n, 3) that lie outside the mesh at `position`."""
    return points[SignedDistance(mesh).phi(points - position) > CLEARANCE * spacing]


def waterline(body: Body, mesh: trimesh.Trimesh, volume: float) -> float:
    """Height [m] of the water that would make the body, as it lies, displace `volume` [m3]."""
    lying = mesh.copy()
    lying.vertices = lying.vertices @ body.rotation.T + body.position
    return waterline_for_volume(lying, volume)


def disc(radius: float, spacing: float) -> BoundaryParticles:
    """Wall particles of a disc [m] in the plane, about its centre: two rings, each point of its share of a ring one spacing thick."""
    points, volumes, areas = [], [], []
    for layer in range(2):
        outer, inner = radius - layer * spacing, radius - (layer + 1) * spacing
        count = round(math.pi * (outer + inner) / spacing)
        angle = 2.0 * math.pi * np.arange(count) / count
        share = math.pi * (outer**2 - inner**2) / count
        centroid = (
            math.sin(math.pi / count) / (math.pi / count) * 2.0 * (outer**3 - inner**3) / (3.0 * (outer**2 - inner**2))
        )
        points.append(centroid * np.column_stack([np.cos(angle), np.zeros(count), np.sin(angle)]))
        volumes.append(np.full(count, share))
        areas.append(np.full(count, 2.0 * math.pi * radius / count if layer == 0 else 0.0))
    position, area = np.concatenate(points), np.concatenate(areas)
    core = math.pi * max(0.0, radius - 2 * spacing) ** 2
    whole = np.vstack([np.column_stack([position, np.concatenate(volumes)]), [0.0, 0.0, 0.0, core]])
    return BoundaryParticles(
        name="disc",
        position=position,
        volume=np.concatenate(volumes),
        area=area,
        curvature=surface_shape(position, area, spacing, dimension=2),
        turns=np.array([[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]]),
        displaced=whole,
    )


def extruded(section: BoundaryParticles, width: float, spacing: float) -> BoundaryParticles:
    """Wall particles of a prism of `width` [m] along y over plane ones; its slices are as far apart as points of a surface are."""
    count = round(width / (PITCH * spacing))
    share, places = width / count, ((np.arange(count) + 0.5) / count - 0.5) * width
    position = np.tile(section.position, (count, 1))
    position[:, 1] = np.repeat(places, len(section.position))
    whole = np.tile(section.whole * [1.0, 1.0, 1.0, share], (count, 1))
    whole[:, 1] = np.repeat(places, len(section.whole))
    return replace(
        section, position=position, volume=np.tile(section.volume * share, count), area=np.tile(section.area * share, count),
        curvature=None if section.curvature is None else np.tile(section.curvature, (count, 1)), displaced=whole,
    )  # fmt: skip
