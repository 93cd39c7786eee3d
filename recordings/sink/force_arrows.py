"""How long the arrow of a force is drawn."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from recordings.frame import MeshDescription

GRAVITY = 9.81  # [m/s2] of the scale that arrows are drawn in; it takes no part in any computation
FULL_LENGTH = 3.0  # body lengths: the arrow of a boom, afloat on a sixth of its volume, must reach out of it


def enclosed_volume(mesh: MeshDescription) -> float:
    """Volume inside a closed mesh [m3]: the sum of signed tetrahedra, V = |sum of v0 . (v1 x v2)| / 6."""
    corner = mesh.vertices[mesh.faces].astype(np.float64)
    return abs(float(np.einsum("ij,ij->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])))) / 6.0


class ForceArrows:
    """One scale per body, fixed for the whole run, so that an arrow twice as long is a force twice as large.

    A force as large as the full displacement of the body, rho g V, is drawn three times as long as the body. Boom segments and
    ships differ by orders of magnitude in force; scaled by their own size both can be seen.
    """

    def __init__(self, meshes: Mapping[str, MeshDescription] | None = None, rest_density: float = 1000.0) -> None:
        """Scale for fluid of ``rest_density`` [kg/m3]; bodies without a volume get no arrow."""
        self.metres_per_newton: dict[str, float] = {}
        for name, mesh in (meshes or {}).items():
            volume = enclosed_volume(mesh) if len(mesh.faces) else 0.0
            if volume > 0.0:
                size = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
                self.metres_per_newton[name] = FULL_LENGTH * size / (rest_density * GRAVITY * volume)

    def vectors(self, name: str, forces: npt.NDArray[np.float64]) -> npt.NDArray[np.float64] | None:
        """Arrows (N, 3) [m] of the forces (N, 3) [N] on one body, or None for a body that has no scale."""
        scale = self.metres_per_newton.get(name)
        return None if scale is None else scale * forces
