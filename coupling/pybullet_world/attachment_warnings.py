"""What the fluid meets otherwise than it is, told as a body is attached: parts that are too thin, solids that count twice, and liquid
that lies in a solid.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial import cKDTree

from coupling.solids.signed_distance import SignedDistance
from coupling.solids.surface_sampling import SurfaceSampling
from coupling.solids.thin_parts import TIGHT

Array = npt.NDArray[np.float64]

UNSAID = 0.02  # of a solid's volume, or of what its wall particles stand for: what other errors come to
ENCLOSED = 0.5  # spacings below a surface: as far as particles come that only press on it
DEEP = 0.75  # spacings between wall particles of two solids below which one lies in the other; solids that touch have them 1 apart


@dataclass(frozen=True, eq=False)
class PlacedWalls:
    """Wall particles of one solid where they are: position (M, 3) [m] in the world, volume (M,) [m3]."""

    position: Array
    volume: Array


def swelling(sampling: SurfaceSampling, volume: float) -> float:
    """How many times a solid's `volume` [m3] the fluid meets, since parts thinner than a particle are met as one thick; 1 if that is
    hardly more.
    """
    times = 1.0 + sampling.excess_volume / volume
    return times if times > 1.0 + UNSAID else 1.0


def tell_thin_parts(name: str, sampling: SurfaceSampling, volume: float) -> None:
    """Say it if the fluid meets more than the `volume` [m3] of a solid, or may leak through it."""
    times = swelling(sampling, volume)
    if times > 1.0:
        warnings.warn(
            f"{name} has parts thinner than a particle, and the fluid meets and lifts {times:.3g} times its volume of {volume:.3g} m3; a "
            f"particle_spacing below {sampling.particle_spacing:g} m resolves them",
            stacklevel=4,
        )
    leak = leaking(sampling)
    if leak:
        warnings.warn(f"{name} {leak}", stacklevel=4)


def leaking(sampling: SurfaceSampling) -> str:
    """Say how thin plates are through which liquid may leak; "" if none are."""
    thickness, spacing = sampling.thinnest_plate, sampling.particle_spacing
    if not np.isfinite(thickness):
        return ""
    return (
        f"has plates {thickness:.2g} m thin, {thickness / spacing:.2g} particle spacings: liquid that stands more than two spacings "
        f"higher on one side may leak through; a particle_spacing up to {thickness / TIGHT:.2g} m, or plates of {TIGHT * spacing:.2g} m, "
        "hold it"
    )


def tell_overlaps(
    solids: Mapping[str, PlacedWalls], present: Mapping[str, PlacedWalls], particle_spacing: float
) -> None:
    """Solids about to be added that lie in each other, or in those that are there, count twice to the fluid: it is said once for all."""
    met, found = dict(present), []
    for name, solid in solids.items():
        share, others = _overlap(solid, met, DEEP * particle_spacing)
        if share > UNSAID:
            found.append(f"{name} in {', '.join(others)} with {100.0 * share:.0f} % of its wall particles")
        met[name] = solid
    if found:
        warnings.warn(
            f"solids lie in each other, {'; '.join(found)}: what is in both counts twice to the fluid, in lift and in pressure; solids "
            "that touch do not",
            stacklevel=5,
        )


def tell_liquid_within(name: str, mesh: trimesh.Trimesh, position: Array, particle_spacing: float) -> None:
    """Say it if particles, at `position` (K, 3) [m] in the mesh's coordinates, lie in a solid; not all are pressed out of it in time."""
    near = position[((position > mesh.bounds[0]) & (position < mesh.bounds[1])).all(axis=1)]
    count = int((SignedDistance(mesh).phi(near) < -ENCLOSED * particle_spacing).sum()) if len(near) else 0
    if count:
        warnings.warn(
            f"{name} lies where liquid is: {count} particles, {count * particle_spacing**3:.2g} m3, are in it, some of which will stay and "
            "take from its lift; fill the fluid around bodies, and set none into it",
            stacklevel=4,
        )


def _overlap(solid: PlacedWalls, others: Mapping[str, PlacedWalls], deep: float) -> tuple[float, list[str]]:
    """Which part of a solid's walls lies nearer than `deep` [m] to those of others, and of which."""
    label = np.repeat(np.arange(len(others)), [len(walls.volume) for walls in others.values()])
    if not label.size:
        return 0.0, []
    tree = cKDTree(np.concatenate([walls.position for walls in others.values()]))
    gap, nearest = tree.query(solid.position, distance_upper_bound=deep)
    inside, names = np.isfinite(gap), list(others)
    share = float(solid.volume[inside].sum() / solid.volume.sum())
    return share, [names[index] for index in np.unique(label[nearest[inside]])]
