"""Warnings of bodies that are too thin for their particles; `oilsim check` and the start of a run give the same ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from coupling.bullet.attachment_warnings import leaking, swelling, thinnest_seen
from coupling.solids.surface_sampling import SurfaceSampling, sample_surface
from coupling.solids.thin_parts import plates_of
from scenarios.setup.solids.placed_solids import Solid, table_entry


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
