"""The length of the arrow that shows a force."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from recordings.frame import MeshDescription

GRAVITY = 9.81  # [m/s2] of the scale that arrows are drawn in; it takes no part in any computation
FULL_LENGTH = 3.0  # body lengths: the arrow of a boom, afloat on a sixth of its volume, must reach out of it


def enclosed_volume(mesh: MeshDescription) -> float:
    """Compute the volume [m3] inside a closed mesh: the sum of signed tetrahedra, V = |sum of v0 . (v1 x v2)| / 6."""
    corner = mesh.vertices[mesh.faces].astype(np.float64)
    return abs(float(np.einsum("ij,ij->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])))) / 6.0


class ForceArrows:
    """The scale of the force arrows: one for each body, constant for the whole run, so twice the length is twice the force.

    A force as large as the body's buoyancy when fully submerged, rho g V, is three body lengths long. Forces on boom segments and ships
    differ by orders of magnitude; a scale by the body's own size shows both.
    """

    def __init__(self, meshes: Mapping[str, MeshDescription] | None = None, rest_density: float = 1000.0) -> None:
        """Compute the scales for fluid of ``rest_density`` [kg/m3]; bodies without a volume get no arrow."""
        self.metres_per_newton: dict[str, float] = {}
        for name, mesh in (meshes or {}).items():
            volume = enclosed_volume(mesh) if len(mesh.faces) else 0.0
            if volume > 0.0:
                size = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
                self.metres_per_newton[name] = FULL_LENGTH * size / (rest_density * GRAVITY * volume)

    def vectors(self, name: str, forces: npt.NDArray[np.float64]) -> npt.NDArray[np.float64] | None:
        """Compute arrows (N, 3) [m] of the forces (N, 3) [N] on one body; None for a body without a scale."""
        scale = self.metres_per_newton.get(name)
        return None if scale is None else scale * forces
