"""The bodies of the [bodies] table with their places and motions, without vessels and booms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from booms.deployment import PlacedBody
from coupling.bodies import about_center_of_mass, mass_properties
from coupling.rigid.prescribed_motion import PrescribedMotion
from recordings.frame import Color
from scenarios.problems import Problem
from scenarios.scenario import Scenario
from scenarios.schema.bodies import Body, Fixed
from scenarios.schema.quantity_fields import Vector
from scenarios.setup.body_motions import prescribed_motion
from scenarios.setup.body_shapes import body_mesh

Array = NDArray[np.float64]

HELD_DENSITY = 1000.0  # [kg/m3], density of a fixed body, whose mass has no effect


@dataclass(frozen=True, kw_only=True, eq=False)
class Solid:
    """A body with its place, its motion, and whether the liquid meets it."""

    placed: PlacedBody
    motion: PrescribedMotion | Literal["free", "fixed"] = "free"
    linear_velocity: Vector = (0.0, 0.0, 0.0)
    angular_velocity: Vector = (0.0, 0.0, 0.0)
    contact: bool = True
    wetted: bool = True
    no_slip: bool = False
    color: Color | None = None

    @property
    def name(self) -> str:
        """Name of the body in the run: ``rock``, ``vessels/port``, ``boom/main/segment-03``."""
        return self.placed.name

    def world_mesh(self) -> trimesh.Trimesh:
        """Return the mesh at the body's place at the start."""
        mesh = self.placed.mesh.copy()
        transform = np.eye(4)
        transform[:3, :3] = Rotation.from_quat(self.placed.orientation).as_matrix()
        transform[:3, 3] = self.placed.position
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


def own_solids(scenario: Scenario, problems: list[Problem]) -> tuple[Solid, ...]:
    """Build the valid bodies of the [bodies] table; those whose meshes cannot be used are added to `problems`."""
    solids: list[Solid] = []
    for name, body in scenario.bodies.items():
        try:
            solids.append(_solid(name, body))
        except (ValueError, OSError) as error:
            problems.append(Problem(f"bodies.{name}", f"cannot be built: {error}"))
    return tuple(solids)


def _solid(name: str, body: Body) -> Solid:
    """Turn the shape about its centre of mass, and put it in its place."""
    shape = body_mesh(body)
    density = HELD_DENSITY if body.mass is None and body.density is None else body.density
    properties = mass_properties(shape, density=density, mass=body.mass)
    rotation = Rotation.from_euler("xyz", body.rotation)
    position = np.array(body.position) + rotation.apply(properties.center_of_mass)
    x, y, z, w = (float(part) for part in rotation.as_quat())
    placed = PlacedBody(
        name=name,
        mesh=about_center_of_mass(shape, properties),
        mass_properties=properties,
        position=position,
        orientation=np.array([x, y, z, w]),
    )
    held: Literal["free", "fixed"] = "fixed" if isinstance(body.motion, Fixed) else "free"
    return Solid(
        placed=placed,
        motion=prescribed_motion(body, vector(position), (x, y, z, w)) or held,
        linear_velocity=body.velocity,
        angular_velocity=body.angular_velocity,
        contact=body.contact,
        no_slip=body.no_slip,
        color=body.color,
    )
