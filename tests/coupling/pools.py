"""A square pool of water for pybullet worlds of tests."""

from __future__ import annotations

from coupling.testkit import pool as make_pool
from oilsim import Fluid


def pool(spacing: float, side: float, depth: float, client: int = 0, bodies: tuple[int, ...] = ()) -> Fluid:
    """A tank on the ground, centred on the z axis and twice as high as wide, with water around these bodies of a client.

    The domain is twice as wide as the tank, so that water thrown out of it is kept.
    """
    half = 0.5 * side
    lower, upper = (-half, -half, 0.0), (half, half, 2.0 * side)
    domain = ((-side, -side, -side), (side, side, 3.0 * side))
    return make_pool(client, bodies, lower=lower, upper=upper, depth=depth, particle_spacing=spacing, domain=domain)[0]
