"""Liquid that a body must move along with itself, as it lies about the body now, and how light the body is beside it.

With e_i the direction from the body's surface to particle i, r_i the surface point and the row j_i = (e_i, r_i x e_i),

    A = sum_i m_i j_i j_i^T    over the liquid within the depth l of the surface,

the kinetic energy of liquid that follows the normal velocity of the surface. l = c S^(1/2) with S the body's whole surface, c S in
two dimensions (per metre). For a sphere the exact A needs c = 0.101, for a disc 0.169; in two dimensions a cylinder needs 0.117
and a plate 0.196. What is taken lies between them, so that A is 0.75 to 1.45 of the exact one. Schemes that rely on it need it
within a factor of two, and that it goes as the liquid goes: a film is worth no more than its own mass.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from oilsim.boundary import BoundaryParticles

Array = npt.NDArray[np.float64]

DEPTH = {3: 0.13, 2: 0.15}  # c
PATCH = {3: 4, 2: 2}  # nearest wall particles from whose mean a particle of liquid is seen


class WettedSurface:
    """The wall particles of one body, about which liquid is looked for."""

    def __init__(self, boundary: BoundaryParticles, spacing: float, dimension: int) -> None:
        facing = boundary.area > 0.0
        surface = float(boundary.area.sum())
        self._position = boundary.position[facing]
        self._walls = cKDTree(self._position)
        self._depth = DEPTH[dimension] * (math.sqrt(surface) if dimension == 3 else surface)
        self._spacing, self._patch = spacing, min(PATCH[dimension], len(self._position))

    def added_mass(self, particles: Array, mass: Array) -> Array:
        """A (6, 6) [kg, kg m, kg m2] about the origin; 0 where there is no liquid.

        particles (N, 3) [m] of liquid in the body's frame, and their mass (N,) [kg].
        """
        reach = self._depth + self._spacing
        low, high = self._walls.mins - reach, self._walls.maxes + reach
        near = ((particles > low) & (particles < high)).all(axis=1)
        liquid = particles[near]
        distance, index = self._walls.query(liquid, range(1, self._patch + 1))
        # a particle in the first layer fills the depth from 0 to 1 spacing, seen from wall particles at a distance of 1
        share = np.clip((reach - distance[:, 0]) / self._spacing, 0.0, 1.0)
        away = liquid - self._position[index].mean(axis=1)
        direction = away / np.maximum(np.linalg.norm(away, axis=1), 1e-9 * reach)[:, None]
        surface = liquid - (distance[:, :1] - 0.5 * self._spacing) * direction
        rows = np.hstack([direction, np.cross(surface, direction)])
        return np.asarray(np.einsum("i,ij,ik->jk", mass[near] * share, rows, rows))


def stability_number(added: Array, mass_matrix: Array) -> float:
    """Largest eigenvalue of M^-1 A [1]: a lagged exchange of forces diverges above 1."""
    return float(np.abs(np.linalg.eigvals(np.linalg.solve(mass_matrix, added))).max())
