"""The bodies of the [bodies] table with their places and motions, without vessels and booms.

Warnings of bodies that are too thin for their particles are the same from `oilsim check` and at the start of a run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from booms.deployment import PlacedBody
from coupling.bullet.attachment_warnings import leaking, swelling, thinnest_seen
from coupling.multibody.prescribed_motion import OscillatingMotion, PrescribedMotion
from coupling.solids import bodies
from coupling.solids.bodies import about_center_of_mass, mass_properties
from coupling.solids.solid_mesh import SolidMesh
from coupling.solids.surface_sampling import SurfaceSampling, particles_of, sample_surface
from coupling.solids.thin_parts import HELD, plates_of
from oilsim import BoundaryParticles
from oilsim.backend.arrays import Array
from oilsim.core.phases import RIGHT_ANGLE
from recordings.model.frame import Color, MeshDescription
from scenarios.schema.bodies import Body, BoxBody, CylinderBody, Fixed, MeshBody, RockBody, SineMotion, SphereBody
from scenarios.schema.parsing.quantity_fields import Vector
from scenarios.text.problems import Problem, problems_of

ROCK_BUMPS = 24

HELD_DENSITY = 1000.0  # [kg/m3] of a held body, whose mass nobody feels


@dataclass(frozen=True, kw_only=True, eq=False)
class Solid:
    """A body with its place, how it moves, and whether the liquid meets it.

    is_hull: it is a ship with its bow along x, for loads without particles;
    notes: what was mended of its mesh, and what hollows it has, in words; drawn: how pictures show it, None for the mesh of `placed`.
    """

    placed: PlacedBody
    motion: PrescribedMotion | Literal["free", "fixed"] = "free"
    linear_velocity: Vector = (0.0, 0.0, 0.0)
    contact: bool = True
    wetted: bool = True
    is_hull: bool = False
    no_slip: bool = False
    contact_angle: float = RIGHT_ANGLE
    color: Color | None = None
    notes: tuple[str, ...] = ()
    drawn: MeshDescription | None = None

    @property
    def name(self) -> str:
        """Name of the body in the run: ``rock``, ``vessels/port``, ``boom/main/segment-03``."""
        return self.placed.name

    def surface(self, sampling: SurfaceSampling) -> BoundaryParticles:
        """Return the wall particles of a `sampling` of its mesh, in the mesh's coordinates [m]."""
        return particles_of(self.name, sampling, no_slip=self.no_slip, contact_angle=self.contact_angle)

    def least_thickness(self, particle_spacing: float) -> float:
        """Return the thickness [m] as which the fluid meets thinner parts: a body that does not answer to the liquid gets tight plates."""
        return particle_spacing if self.motion == "free" else HELD * particle_spacing

    def world_mesh(self, pose: Array | None = None) -> trimesh.Trimesh:
        """Place the mesh where the body starts, or at a pose (7,) [m, 1]."""
        mesh = self.placed.mesh.copy()
        start = np.concatenate([self.placed.position, self.placed.orientation])
        there = start if pose is None else pose
        transform = np.eye(4)
        transform[:3, :3] = Rotation.from_quat(there[3:]).as_matrix()
        transform[:3, 3] = there[:3]
        mesh.apply_transform(transform)
        return mesh


def vector(array: Array) -> Vector:
    """Convert an array (3,) of any unit [-] to a tuple of floats."""
    x, y, z = (float(part) for part in array)
    return x, y, z


def table_entry(body: str) -> str:
    """Return the table of a body in the scenario: ``bodies.rock``, ``vessels.port``, ``booms.main``."""
    group, _, rest = body.partition("/")
    tables = {"vessels": "vessels", "boom": "booms"}
    return f"{tables[group]}.{rest.partition('/')[0]}" if group in tables and rest else f"bodies.{body}"


def own_solids(bodies: Mapping[str, Body], problems: list[Problem]) -> tuple[Solid, ...]:
    """Build the valid bodies of the [bodies] table; those whose meshes cannot be used are added to `problems`."""
    solids: list[Solid] = []
    for name, body in bodies.items():
        try:
            solids.append(_solid(name, body, body_solid(body)))
        except (ValueError, OSError) as error:
            problems.append(Problem(f"bodies.{name}", f"cannot be built: {error}"))
    return tuple(solids)


def _solid(name: str, body: Body, shape: SolidMesh) -> Solid:
    """Turn the shape about its centre of mass and put it in its place; a sealed hollow is dry, and no wall."""
    density = HELD_DENSITY if body.mass is None and body.density is None else body.density
    properties = mass_properties(shape, density=density, mass=body.mass)
    rotation = Rotation.from_euler("xyz", body.rotation)
    position = np.array(body.position) + rotation.apply(properties.center_of_mass)
    x, y, z, w = (float(part) for part in rotation.as_quat())
    placed = PlacedBody(
        name=name,
        mesh=about_center_of_mass(shape.outer, properties),
        mass_properties=properties,
        position=position,
        orientation=np.array([x, y, z, w]),
    )
    return Solid(
        placed=placed,
        motion=_motion(body, vector(position), (x, y, z, w)),
        linear_velocity=body.velocity,
        contact=body.contact,
        is_hull=isinstance(body, MeshBody) and body.hull,
        no_slip=body.no_slip,
        contact_angle=body.contact_angle,
        color=body.color,
        notes=_notes(name, body, shape),
    )


def _motion(
    body: Body, position: Vector, orientation: tuple[float, float, float, float]
) -> PrescribedMotion | Literal["free", "fixed"]:
    """Return how a body moves whose centre of mass starts at `position` [m]."""
    motion = body.motion
    if isinstance(motion, SineMotion):
        return OscillatingMotion(
            position=position,
            orientation=orientation,
            direction=motion.direction,
            amplitude=motion.amplitude,
            period=motion.period,
            ramp_time=motion.rise_time,
        )
    return "fixed" if isinstance(motion, Fixed) else "free"


def _notes(name: str, body: Body, shape: SolidMesh) -> tuple[str, ...]:
    """Say what was mended of a body's mesh, and how much of it are hollows."""
    where = f"bodies.{name}.file {body.file!r}" if isinstance(body, MeshBody) else f"bodies.{name}"
    notes = [f"{where}: {note}" for note in shape.notes]
    if shape.has_hollow:
        hollow = shape.displaced_volume - shape.volume
        notes.append(f"{where}: {hollow:.3g} m3 of sealed hollow stay dry and hold no mass")
    return tuple(notes)


def sampled(solids: Sequence[Solid], particle_spacing: float) -> dict[int, SurfaceSampling]:
    """Sample the surfaces of wetted solids, by the id of their mesh; a boom's segments share one."""
    samplings: dict[int, SurfaceSampling] = {}
    for solid in solids:
        mesh = solid.placed.mesh
        if id(mesh) not in samplings:
            with problems_of(table_entry(solid.name), "cannot be sampled with particles"):
                samplings[id(mesh)] = sample_surface(
                    mesh, particle_spacing, minimum_thickness=solid.least_thickness(particle_spacing)
                )
    return samplings


def body_solid(body: Body) -> SolidMesh:
    """Return the solid of a body about the origin of its shape; errors name the file where there is one."""
    if isinstance(body, MeshBody):
        return bodies.load_solid(body.file, body.scale)
    mesh = _MESHES[type(body)](body)
    return SolidMesh(mesh=mesh, outer=mesh)


def rock(size: tuple[float, float, float], roughness: float, seed: int) -> trimesh.Trimesh:
    """Build a boulder: a sphere whose radius varies by random plane waves, stretched to the extents `size` [m].

    radius(e) = 1 + roughness s(e) / max |s| with s(e) = sum_k a_k cos(w_k . e + p_k) for directions e. Wave vectors have lengths of 2 to 6
    and a_k = 1 / |w_k|: long bumps are high, short ones low.
    """
    random = np.random.default_rng(seed)
    mesh = trimesh.creation.icosphere(subdivisions=4)
    direction = np.asarray(mesh.vertices, np.float64)
    wave = random.normal(size=(ROCK_BUMPS, 3))
    wave *= random.uniform(2.0, 6.0, size=(ROCK_BUMPS, 1)) / np.linalg.norm(wave, axis=1, keepdims=True)
    phase = random.uniform(0.0, 2.0 * np.pi, size=ROCK_BUMPS)
    bumps = np.cos(direction @ wave.T + phase) @ (1.0 / np.linalg.norm(wave, axis=1))
    vertices = direction * (1.0 + roughness * bumps / np.abs(bumps).max())[:, None]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    mesh.vertices = (vertices - 0.5 * (low + high)) / (high - low) * np.array(size)
    return mesh


_MESHES: dict[type, Callable[[Any], trimesh.Trimesh]] = {
    BoxBody: lambda body: bodies.box(body.size),
    CylinderBody: lambda body: bodies.cylinder(body.radius, body.height),
    SphereBody: lambda body: bodies.sphere(body.radius),
    RockBody: lambda body: rock(body.size, body.roughness, body.seed),
}


def thin_samplings(solids: Sequence[Solid], particle_spacing: float) -> dict[int, SurfaceSampling]:
    """Sample the bodies that have thin plates, and return the samplings by the id of their mesh; other bodies need no warning."""
    meshes = {id(solid.placed.mesh): solid for solid in solids if solid.wetted}
    thin = {
        key: solid for key, solid in meshes.items() if math.isfinite(plates_of(solid.placed.mesh, particle_spacing))
    }
    return {
        key: sample_surface(
            solid.placed.mesh, particle_spacing, minimum_thickness=solid.least_thickness(particle_spacing)
        )
        for key, solid in thin.items()
    }


def thin_bodies(
    solids: Sequence[Solid], samplings: Mapping[int, SurfaceSampling], particle_spacing: float
) -> dict[str, str]:
    """List the warnings of thin bodies, whose samplings are given by the id of their mesh; keys are ``thin rock`` or ``leak rock``."""
    sampled = {
        solid.name: (samplings[id(solid.placed.mesh)], float(solid.placed.mesh.volume))
        for solid in solids
        if solid.wetted and id(solid.placed.mesh) in samplings
    }
    least = {name: thinnest_seen(own[0]) for name, own in sampled.items()}
    told = swollen_bodies({name: swelling(*own) for name, own in sampled.items()}, least, particle_spacing)
    for name, (sampling, _) in sampled.items():
        text = leaking(sampling)
        if text and table_entry(name).startswith("bodies."):  # the skirt of a boom has liquid on both sides
            told[f"leak {name}"] = f"{name} {text}"
    return told


def swollen_bodies(times: Mapping[str, float], least: Mapping[str, str], particle_spacing: float) -> dict[str, str]:
    """List the warnings of bodies that the fluid meets with `times` their volume; the segments of a boom share one warning.

    least: in words, the thickness of the thinnest part that the fluid sees of each body as it is.
    """
    entries: dict[str, dict[str, float]] = {}
    for name, value in times.items():
        if value > 1.0:
            entries.setdefault(table_entry(name), {})[name] = value
    told: dict[str, str] = {}
    for swollen in entries.values():
        first, *others = swollen
        which, have, its = (f"{first} and {len(others)} more", "have", "their") if others else (first, "has", "its")
        text = f"the fluid meets and lifts {max(swollen.values()):.2g} times {its} volume"
        resolved = f"fluid.particle_spacing below {particle_spacing:g} m resolves them"
        told[f"thin {first}"] = f"{which} {have} parts thinner than {least[first]}: {text}; {resolved}"
    return told
