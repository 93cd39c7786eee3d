"""pybullet's defaults that spoil physics, recognised in a world of somebody else: told once, with the call that mends them."""

from __future__ import annotations

import warnings

import numpy as np
import numpy.typing as npt
import trimesh

Array = npt.NDArray[np.float64]

DEFAULT_DAMPING = 0.04  # [1/s] and [1/m]: pybullet's, of every link unless changeDynamics sets another


def tell_damping(body: int, twist: Array, unexplained: Array) -> bool:
    """Recognise default damping, which cannot be asked for: -c v (1 + |v|) is all that is left of a body's acceleration; whether so."""
    speed = float(np.linalg.norm(twist[:3]))
    expected = -DEFAULT_DAMPING * twist[:3] * (1.0 + speed)
    if speed <= 0.05 or np.linalg.norm(unexplained[:3] - expected) >= 0.05 * np.linalg.norm(expected):
        return False
    warnings.warn(
        f"body {body} is braked by pybullet's default damping (a fall ends at 15 m/s); "
        f"changeDynamics({body}, link, linearDamping=0, angularDamping=0, jointDamping=0) for the base (-1) "
        f"and every link takes it off",
        stacklevel=4,
    )
    return True


def tell_inertia(body: int, link: int, mesh: trimesh.Trimesh, mass: float, inertia: Array) -> None:
    """Recognise an inertia (3,) that is the bounding box's and not the solid's."""
    if not mesh.is_watertight or mesh.body_count > 1:
        return
    size2 = np.asarray(mesh.extents) ** 2
    of_box = mass / 12.0 * (size2.sum() - size2)
    of_solid = np.diag(mesh.moment_inertia) * mass / (float(mesh.volume) * float(mesh.density))
    if np.allclose(inertia, of_box, rtol=0.1) and not np.allclose(inertia, of_solid, rtol=0.2):
        warnings.warn(
            f"body {body}, link {link} has the inertia of its bounding box; changeDynamics({body}, {link}, "
            f"localInertiaDiagonal={[float(f'{value:.4g}') for value in of_solid]}) gives it its own, if it is solid "
            f"throughout",
            stacklevel=5,
        )
