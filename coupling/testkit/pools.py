"""Water for pybullet worlds, filled around the bodies that are in them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.bullet.pybullet_import import pybullet
from coupling.bullet.shapes import link_mesh, link_pose
from coupling.multibody.prescribed_motion import Vector
from coupling.solids.signed_distance import SignedDistance
from coupling.testkit.readings import Basin
from coupling.testkit.scene import CLEARANCE
from coupling.testkit.tanks import MARGIN, WATER
from oilsim import Fluid, FluidConfig, Phase, block, tank_walls


def pool(
    client: int, bodies: Iterable[int], *, lower: Vector, upper: Vector, depth: float, particle_spacing: float,
    phase: Phase = WATER, domain: tuple[Vector, Vector] | None = None,
) -> tuple[Fluid, Basin]:  # fmt: skip
    """Create a tank from `lower` to `upper` [m], open at the top and filled to `depth` [m] around the bodies of a pybullet client.

    The fluid runs on one thread. The tank's walls are the fluid's only, and do not stop bodies. Liquid beyond `domain`, the lower
    and upper corner [m], is lost; without it the domain ends 4 spacings beyond the tank, and one that reaches farther keeps what
    splashes out. Attach the fluid by `coupling.bullet.plugin.attach_fluid`. Returns the fluid, and the tank for `watch`. Raises ValueError
    for numbers that are not allowed.
    """
    if domain is None:
        margin = MARGIN * particle_spacing
        domain = (
            (lower[0] - margin, lower[1] - margin, lower[2] - margin),
            (upper[0] + margin, upper[1] + margin, upper[2] + margin),
        )
    config = FluidConfig(particle_spacing=particle_spacing, phases=(phase,), lower=domain[0], upper=domain[1])
    if not 0.0 < depth <= upper[2] - lower[2]:
        raise ValueError(f"pool: depth is {depth} m, allowed: above 0, to its height of {upper[2] - lower[2]:g} m")
    fluid = Fluid(config, threads=1)
    fluid.add_boundary(tank_walls(lower, upper, particle_spacing, sides=("-x", "+x", "-y", "+y", "-z")))
    points = block(lower, (upper[0], upper[1], lower[2] + depth), particle_spacing)
    for body in bodies:
        for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
            mesh = link_mesh(client, body, link)
            if mesh is not None:
                place, orientation = link_pose(client, body, link)
                own = Rotation.from_quat(orientation).inv().apply(points - place)
                points = points[np.asarray(SignedDistance(mesh).phi(own)) > CLEARANCE * particle_spacing * (1.0 - 1e-6)]
    fluid.add_particles(points, phase=phase.name)
    return fluid, Basin((upper[0] - lower[0]) * (upper[1] - lower[1]), lower[2])
