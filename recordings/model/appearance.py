"""Colours, sizes and names of entities in the viewer.

The legend of a recording: the text beside its scenes in the viewer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import rerun as rr

from recordings.model import palette
from recordings.model.exercise import BoomDescription
from recordings.model.frame import MeshDescription, PhaseDescription, RunDescription
from recordings.model.palette import CAUSES, is_water
from recordings.model.words import cause_in_words, force_in_words


def legend(run: RunDescription) -> str:
    """Write the title, and the meaning of colours and arrows, in Markdown."""
    lines = [f"**{run.properties.get('title') or run.name}**"]
    if run.booms:
        causes = ", ".join(f"{name} *{cause_in_words(cause)}*" for cause, (name, _) in CAUSES.items())
        spots = f"Where the sea has no particles, {palette.spot_in_words()}."
        lines.append(f"**Oil** is dark. The colour of **lost oil** shows how it was lost: {causes}. {spots}")
        lines += [f"The line on {tension_colors(boom, len(run.booms) > 1)}." for boom in run.booms]
    elif run.oils:
        lines.append("**Oil** is dark.")
    if run.oils and any(map(is_water, run.phases)):
        lines[-1] += " **Water** is drawn as small dots."
    if run.meshes:
        lines.append(
            "Tab *Forces* shows the water's force on each body; an arrow of three body lengths is the buoyancy of the whole body as drawn."
        )
    return "\n\n".join(lines)


def tension_colors(boom: BoomDescription, several: bool) -> str:
    """Say what a boom's colours mean; with several booms, each has a scale of its own."""
    name = f"boom **{boom.name}**" if several else "the **boom**"
    half, full = force_in_words(0.5 * boom.full_tension), force_in_words(boom.full_tension)
    return f"{name} shows its tension: pale without any, orange at {half}, dark red from {full} on"


_WATER_RADIUS = 0.17  # in particle spacings; small, because the viewer draws no translucent points and oil under water must be visible
_LONE_WATER_RADIUS = 0.35  # without oil: large enough to show the surface, small enough to see bodies through it
_RADIUS = 0.5
_LOST_RADIUS = 0.6  # a little larger than _RADIUS, so that it covers the same particle of its phase
_WALL_CLASS = 100
_ARROW_RADIUS = -1.5  # negative values are points on the screen
_TENSION_RADIUS = -2.5  # the same; wide enough to see a kilometre of boom from above


def classes(phases: Sequence[PhaseDescription]) -> rr.AnnotationContext:
    """Name and colour every class of points."""
    entries = [
        rr.AnnotationInfo(id=index, label=phase.name, color=palette.phase_color(phase, index))
        for index, phase in enumerate(phases)
    ]
    return rr.AnnotationContext([*entries, rr.AnnotationInfo(id=_WALL_CLASS, label="wall", color=palette.WALL)])


def phase(index: int, one: PhaseDescription, spacing: float, *, beside_oil: bool) -> rr.Points3D:
    """Style the particles of one phase; water is drawn small if there is oil, too."""
    water = _WATER_RADIUS if beside_oil else _LONE_WATER_RADIUS
    return rr.Points3D.from_fields(class_ids=[index], radii=[spacing * (water if palette.is_water(one) else _RADIUS)])


def lost(cause: str, spacing: float, *, are_parcels: bool) -> rr.Points3D:
    """Style the oil that was lost by one cause; parcels have radii of their own."""
    radii = None if are_parcels else [_LOST_RADIUS * spacing]
    return rr.Points3D.from_fields(colors=[palette.cause_color(cause)], radii=radii)


def wall(points: npt.NDArray[np.float32], spacing: float) -> rr.Points3D:
    """Build the points of static boundary particles (N, 3) [m]."""
    return rr.Points3D(points, class_ids=[_WALL_CLASS], radii=[0.25 * spacing])


def outline(points: npt.NDArray[np.float32], spacing: float) -> rr.LineStrips3D:
    """Build the box around static boundary particles (N, 3) [m]; a box hides nothing."""
    edges = _box_edges(points.min(axis=0), points.max(axis=0))
    return rr.LineStrips3D(edges, colors=[palette.WALL], radii=[0.12 * spacing])


def name_over(mesh: MeshDescription, name: str) -> rr.Points3D:
    """Build a label with a body's name above its highest point."""
    above = np.array([[0.0, 0.0, 1.6 * float(mesh.vertices[:, 2].max())]], dtype=np.float32)
    return rr.Points3D(above, labels=[name], colors=[palette.NAME], radii=[0.0], show_labels=True)


def tension() -> rr.LineStrips3D:
    """Style the lines that show a boom's tension by their colours."""
    return rr.LineStrips3D.from_fields(radii=[_TENSION_RADIUS])


def force() -> rr.Arrows3D:
    """Style the arrow of a force."""
    return rr.Arrows3D.from_fields(colors=[palette.FORCE], radii=[_ARROW_RADIUS])


def line(name: str, run: str = "") -> rr.SeriesLines:
    """Style the line of a series.

    The label names the run if two runs are shown. A series of lost oil has the colour of its cause, any other one of its own.
    """
    last = name.rpartition("/")[2]
    label = " ".join(filter(None, (run, last.replace("_", " "))))
    if "oil_lost/" in name:
        return rr.SeriesLines(names=[label], colors=[palette.cause_color(last)], widths=[2.0])
    return rr.SeriesLines(
        names=[label], colors=[palette.LIMIT if name.endswith("_limit") else palette.series_color(name)]
    )


def _box_edges(lower: npt.NDArray[np.float32], upper: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the twelve edges of a box, (12, 2, 3) [m]."""
    bits = [(first, second, axis) for axis in range(3) for first in (0, 1) for second in (0, 1)]
    edges = []
    for first, second, axis in bits:
        corner = np.insert(np.array([first, second], dtype=np.float32), axis, 0.0)
        edges.append([corner, np.insert(np.array([first, second], dtype=np.float32), axis, 1.0)])
    return np.array(lower + (upper - lower) * np.array(edges), dtype=np.float32)
