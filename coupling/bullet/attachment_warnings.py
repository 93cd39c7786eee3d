"""Warnings at attachment, where the fluid sees another shape than the mesh.

They concern parts that are too thin, solids whose overlap counts twice, and liquid inside a solid.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from coupling.solids.signed_distance import SignedDistance
from coupling.solids.surface_sampling import SurfaceSampling
from coupling.solids.thin_parts import TIGHT
from oilsim.backend.arrays import Array

UNSAID = 0.02  # of a solid's volume, or of what its wall particles stand for: what other errors come to
ENCLOSED = 0.5  # spacings below a surface: as far as particles come that only press on it
DEEP = 0.75  # spacings between wall particles of two solids below which one lies in the other; solids that touch have them 1 apart


@dataclass(frozen=True, eq=False)
class PlacedWalls:
    """Wall particles of one solid at their places: position (M, 3) [m] in the world, volume (M,) [m3]."""

    position: Array
    volume: Array


def swelling(sampling: SurfaceSampling, volume: float) -> float:
    """Return the volume that the fluid sees / the solid's `volume` [m3]; 1 if they hardly differ.

    The fluid sees parts thinner than the sampling's `minimum_thickness` as that thick.
    """
    times = 1.0 + sampling.excess_volume / volume
    return times if times > 1.0 + UNSAID else 1.0


def tell_thin_parts(name: str, sampling: SurfaceSampling, volume: float) -> None:
    """Say it if the fluid meets more than the `volume` [m3] of a solid, or plates that do not hold it by their thickness."""
    times = swelling(sampling, volume)
    if times > 1.0:
        warnings.warn(
            f"{name} has parts thinner than {thinnest_seen(sampling)}: the fluid sees and lifts {times:.3g} times its volume of "
            f"{volume:.3g} m3; a particle_spacing below {sampling.particle_spacing:g} m resolves them",
            stacklevel=4,
        )
    leak = leaking(sampling)
    if leak:
        warnings.warn(f"{name} {leak}", stacklevel=4)


def thinnest_seen(sampling: SurfaceSampling) -> str:
    """Say which thickness the fluid sees as it is at least."""
    spacings = sampling.minimum_thickness / sampling.particle_spacing
    return "a particle" if spacings <= 1.0 else f"{spacings:.2g} particle spacings"


def leaking(sampling: SurfaceSampling) -> str:
    """Say how thin plates are that do not hold liquid by their thickness, and what keeps it; "" if there are none."""
    thickness, spacing = sampling.thinnest_plate, sampling.particle_spacing
    if not np.isfinite(thickness):
        return ""
    if sampling.minimum_thickness >= TIGHT * spacing:
        return (
            f"has plates {thickness:.2g} m thin, {thickness / spacing:.2g} particle spacings: it does not move by the liquid, and the "
            f"fluid meets these plates as {sampling.minimum_thickness:.2g} m thick, so that nothing leaks; a particle_spacing up to "
            f"{thickness / TIGHT:.2g} m resolves them"
        )
    return (
        f"has plates {thickness:.2g} m thin, {thickness / spacing:.2g} particle spacings: the fluid keeps its particles on their side, "
        f"since pressure would not; a particle_spacing up to {thickness / TIGHT:.2g} m, or plates of {TIGHT * spacing:.2g} m, resolve them"
    )


def tell_overlaps(
    solids: Mapping[str, PlacedWalls], present: Mapping[str, PlacedWalls], particle_spacing: float
) -> None:
    """Warn once if solids about to be added overlap with each other or with solids that are there: the overlap counts twice."""
    met, found = dict(present), []
    for name, solid in solids.items():
        share, others = _overlap(solid, met, DEEP * particle_spacing)
        if share > UNSAID:
            found.append(f"{name} in {', '.join(others)} with {100.0 * share:.0f} % of its wall particles")
        met[name] = solid
    if found:
        warnings.warn(
            f"solids overlap: {'; '.join(found)}. The overlap counts twice for the fluid, in lift and in pressure; solids that only "
            "touch do not overlap",
            stacklevel=5,
        )


def tell_liquid_within(name: str, mesh: trimesh.Trimesh, position: Array, particle_spacing: float) -> None:
    """Warn if particles, at `position` (K, 3) [m] in the mesh's coordinates, are inside a solid; some may stay there."""
    near = position[((position > mesh.bounds[0]) & (position < mesh.bounds[1])).all(axis=1)]
    count = int((SignedDistance(mesh).phi(near) < -ENCLOSED * particle_spacing).sum()) if len(near) else 0
    if count:
        warnings.warn(
            f"{name} is placed in liquid: {count} particles ({count * particle_spacing**3:.2g} m3) are inside it; some will stay and "
            "reduce its lift, allowed: fill the fluid around bodies",
            stacklevel=4,
        )


def _overlap(solid: PlacedWalls, others: Mapping[str, PlacedWalls], deep: float) -> tuple[float, list[str]]:
    """Return the share of a solid's walls that is nearer than `deep` [m] to those of others, and the names of these."""
    label = np.repeat(np.arange(len(others)), [len(walls.volume) for walls in others.values()])
    if not label.size:
        return 0.0, []
    tree = cKDTree(np.concatenate([walls.position for walls in others.values()]))
    gap, nearest = tree.query(solid.position, distance_upper_bound=deep)
    inside, names = np.isfinite(gap), list(others)
    share = float(solid.volume[inside].sum() / solid.volume.sum())
    return share, [names[index] for index in np.unique(label[nearest[inside]])]
