"""Moments of a recording in space: bodies, oil, and clear water above them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from recordings.model import palette
from recordings.model.exercise import BoomDescription, is_ground
from recordings.model.frame import BodyFrame, CameraView, MeshDescription, PhaseDescription, RunDescription
from recordings.pictures.foam import whitecaps
from recordings.pictures.raster import Canvas, Projection, fitted_projection
from recordings.replay.moments import Moment, placed_vertices

Points = npt.NDArray[np.float64]
_SCENE_HEIGHTS = (0.45, 0.76)  # least and largest height of a scene, in widths
_LEAST_EXTENT = (
    10.0  # [particle spacings] of a picture of a single point; balls would fill the picture of a smaller one
)
_MARGIN = 0.04  # margin around a scene, in widths
_OIL_RADIUS = 0.6  # in particle spacings; a film one particle thick should look closed
_CLEAR_DEPTHS = 0.9  # distance that light reaches in water, in water depths
_EQUIPMENT_RADIUS = 0.3  # [m] of skimmers' rings and of lines; a line of 24 mm would not be seen
_FINENESS = 2  # pixels drawn to one that is shown, in each direction, for smooth edges
_LEAST_BOOM = 2.0  # [pixels] that the freeboard of a boom takes at least
_LOST_RADIUS = 0.75  # larger than _OIL_RADIUS, so that lost oil covers the same oil of its phase


class SceneView:
    """One camera that sees some moments of a run, for pictures of these and of moments between them."""

    def __init__(
        self, run: RunDescription, moments: Sequence[Moment], width: int, *, exercise_only: bool = False
    ) -> None:
        """Aim the camera; pictures are `width` [pixels] wide, and as high as needed.

        With ``exercise_only`` the camera frames bodies and oil, and not all of the water.
        """
        self._run, self._width = run, width
        self._projection, self._height = _shared_view(run, moments, width, exercise_only)
        self._depth = _water_depth(run, moments)
        sizes = [_pixels_of_boom(boom, moment, self._projection) for boom in run.booms for moment in moments]
        self._widened = max(_LEAST_BOOM / min(sizes, default=_LEAST_BOOM), 1.0)

    @property
    def note(self) -> str:
        """The things that pictures show otherwise than they are, in words; empty if none."""
        return f"boom drawn {self._widened:.2g} times as high as it is" if self._widened > 1.0 else ""

    def draw(self, moment: Moment) -> Points:
        """Draw a picture (height, width, 3) of colours from 0 to 1."""
        fineness = 1 if _clear_liquids(self._run, moment) else _FINENESS  # balls of water have no edges, and take long
        canvas = Canvas(self._projection, self._width, self._height, fineness=fineness)
        _render(self._run, moment, canvas, self._depth)
        return np.asarray(canvas.shown, dtype=np.float64)

    def outline(self, name: str, moment: Moment) -> Points:
        """Return the outline (C, 2) [pixels] of a body that has a mesh."""
        pixels, _ = self._projection(placed_vertices(self._run.meshes[name].vertices, moment.bodies[name]))
        return np.asarray(pixels[ConvexHull(pixels).vertices])


def _pixels_of_boom(boom: BoomDescription, moment: Moment, projection: Projection) -> float:
    """Return the pixels that a boom's freeboard takes, in the middle of its segments; infinite for one that is not there."""
    places = [moment.bodies[name].position for name in boom.segments if name in moment.bodies]
    return projection.pixels(boom.freeboard, np.array(places)) if places else np.inf


def _shared_view(
    run: RunDescription, moments: Sequence[Moment], width: int, exercise_only: bool
) -> tuple[Projection, int]:
    """Return the projection that shows all moments, and the height of their pictures [pixels]."""
    camera = run.camera or _usual_camera(moments)
    eye, target = np.array(camera.eye), np.array(camera.target)
    seen = np.empty((0, 3))
    if exercise_only:
        seen = np.concatenate([_extent(run, _without_water(run, moment), far=np.inf) for moment in moments])
    if not len(seen):
        seen = np.concatenate([_extent(run, moment) for moment in moments])
    if not len(seen) or np.ptp(seen, axis=0).max() < _LEAST_EXTENT * run.particle_spacing:
        middle = seen.mean(axis=0) if len(seen) else target
        seen = middle + 0.5 * _LEAST_EXTENT * run.particle_spacing * np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
    margin = _MARGIN * width
    room = int(width - 2.0 * margin)
    tight = fitted_projection(eye, target, seen, room, int(_SCENE_HEIGHTS[1] * width - 2.0 * margin))
    needed = float(np.ptp(tight(seen)[0][:, 1])) + 2.0 * margin
    height = int(np.clip(needed, _SCENE_HEIGHTS[0] * width, _SCENE_HEIGHTS[1] * width))
    fitted = fitted_projection(eye, target, seen, room, int(height - 2.0 * margin))
    return replace(fitted, center=fitted.center + margin), height


def _render(run: RunDescription, moment: Moment, canvas: Canvas, depth: float) -> None:
    """Draw one moment: first the opaque things, then the water in front of them."""
    for name, mesh in run.meshes.items():
        if name in moment.bodies:
            placed = placed_vertices(mesh.vertices, moment.bodies[name])
            canvas.triangles(placed, mesh.faces, _body_color(run, name, mesh, moment.bodies[name]))
    for boom in run.booms:
        if _pixels_of_boom(boom, moment, canvas.projection) < _LEAST_BOOM * canvas.fineness:
            _draw_line_of(boom, moment, canvas)
    for index, phase in enumerate(run.phases):
        if _opaque(phase, len(run.phases)) and phase.name in moment.positions and not _is_film(phase, moment):
            color = palette.phase_color(phase, index)
            canvas.spheres(moment.positions[phase.name], _OIL_RADIUS * run.particle_spacing, color)
    for cause, positions in moment.lost.items():
        radius = moment.radius.get(cause, _LOST_RADIUS * run.particle_spacing)
        canvas.spheres(positions, radius, palette.cause_color(cause))
    if moment.sea is not None and not moment.sea.surface.is_clear:
        foam = partial(whitecaps, moment.sea.surface, np.array(moment.wind), moment.time)
        canvas.sea(moment.sea.surface, moment.sea.image, palette.SEA, foam)
    for _, strip in moment.equipment:
        canvas.spheres(_beads(strip), _EQUIPMENT_RADIUS, palette.EQUIPMENT)
    for index, phase in _clear_liquids(run, moment):
        color = palette.phase_color(phase, index)
        canvas.water(moment.positions[phase.name], run.particle_spacing, color, _CLEAR_DEPTHS * depth)


def _clear_liquids(run: RunDescription, moment: Moment) -> list[tuple[int, PhaseDescription]]:
    """Return the phases through which one sees, with their places in the run; none below a sea, which hides them."""
    if moment.sea is not None and not moment.sea.surface.is_clear:
        return []
    places = enumerate(run.phases)
    return [
        (place, phase)
        for place, phase in places
        if len(moment.positions.get(phase.name, ())) and not _opaque(phase, len(run.phases))
    ]


def _draw_line_of(boom: BoomDescription, moment: Moment, canvas: Canvas) -> None:
    """Draw the top of a boom as wide as it is seen well."""
    bodies = [moment.bodies[name] for name in boom.segments if name in moment.bodies]
    top = np.array(boom.joint_points)
    top[:, 2] = boom.waterline + boom.freeboard
    tensions = np.nan_to_num([body.tension for body in bodies])
    ends = np.array([placed_vertices(top, body) for body in bodies])
    canvas.lines(ends, _LEAST_BOOM, palette.tension_color(tensions, boom.full_tension))


def _beads(strip: Points) -> Points:
    """Return points (M, 3) [m] along a line (N, 3) [m], so close that balls on them touch."""
    far = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(strip, axis=0), axis=1))])
    along = np.arange(0.0, far[-1], _EQUIPMENT_RADIUS)
    return np.column_stack([np.interp(along, far, part) for part in strip.T])


def _is_film(phase: PhaseDescription, moment: Moment) -> bool:
    """Tell whether a phase is drawn as a film on the sea."""
    return phase.is_oil and moment.sea is not None and moment.sea.image is not None


def _opaque(phase: PhaseDescription, phase_count: int) -> bool:
    """Tell whether a phase hides what is behind it: oil does; water and the only fluid of a run do not."""
    if phase.is_oil:
        return True
    return phase_count > 1 and not palette.is_water(phase)


def _body_color(run: RunDescription, name: str, mesh: MeshDescription, body: BodyFrame) -> npt.ArrayLike:
    """Return a body's colour, or one for each of its faces; the colour of a boom's segment shows its tension."""
    for boom in run.booms:
        if name in boom.segments and not np.isnan(body.tension):
            return palette.tension_color(body.tension, boom.full_tension)
    return palette.body_color(name, mesh) if mesh.face_colors is None else mesh.face_colors


def _without_water(run: RunDescription, moment: Moment) -> Moment:
    """Return the moment with its oil only, if it has oil."""
    oil = {name: position for name, position in moment.positions.items() if name in run.oils and len(position)}
    return replace(moment, positions=oil) if oil else moment


def _extent(run: RunDescription, moment: Moment, far: float = 0.5) -> Points:
    """Collect points (N, 3) [m] that the picture must contain: nearly all particles, and bodies within ``far`` times their extent."""
    if moment.sea is not None and len(afloat := _extent_at_sea(run, moment)):
        return afloat
    parts = [position for position in moment.positions.values() if len(position)]
    if not parts:
        return np.array([body.position for body in moment.bodies.values()]) if moment.bodies else np.empty((0, 3))
    together = np.concatenate(parts)
    lower, upper = np.percentile(together, 0.2, axis=0), np.percentile(together, 99.8, axis=0)
    corners = _corners(lower, upper)
    room = far * max(float((upper - lower).max()), run.particle_spacing)
    for name, mesh in run.meshes.items():
        if name in moment.bodies:
            placed = placed_vertices(mesh.vertices, moment.bodies[name])
            near = ((placed > lower - room) & (placed < upper + room)).all(axis=1)
            corners = np.concatenate([corners, placed[near]])
    return np.asarray(corners)


def _extent_at_sea(run: RunDescription, moment: Moment) -> Points:
    """Collect the points (N, 3) [m] of all bodies, and nearly all of the oil."""
    placed = [
        placed_vertices(mesh.vertices, moment.bodies[name])
        for name, mesh in run.meshes.items()
        if name in moment.bodies and not is_ground(name)
    ]
    oil = [moment.positions[name] for name in run.oils if len(moment.positions.get(name, ()))]
    limits = [_corners(*np.percentile(np.concatenate(oil), [2.0, 98.0], axis=0))] if oil else []
    return np.concatenate([*placed, *limits]) if placed or limits else np.empty((0, 3))


def _corners(lower: npt.NDArray[np.floating], upper: npt.NDArray[np.floating]) -> Points:
    """Return the corners (8, 3) [m] of a box."""
    return np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (upper - lower) + lower


def _usual_camera(moments: Sequence[Moment]) -> CameraView:
    """Place a camera in front, to the left and above, so far away that lines stay nearly parallel."""
    particles = [position for moment in moments for position in moment.positions.values() if len(position)]
    bodies = [body.position[None] for moment in moments for body in moment.bodies.values()]
    together = np.concatenate([*(particles or bodies or [np.zeros((1, 3))])]).astype(np.float64)
    middle = np.median(together, axis=0)
    size = max(float(np.ptp(together, axis=0).max()), 1e-3)
    eye = middle + size * np.array([-0.9, -1.6, 1.1])
    return CameraView(tuple(eye.tolist()), tuple(middle.tolist()))


def _water_depth(run: RunDescription, moments: Sequence[Moment]) -> float:
    """Return the smallest extent [m] of the fluids at the end: their depth, or the width of a flume or a plane."""
    parts = [position for position in moments[-1].positions.values() if len(position)]
    if not parts:
        return run.particle_spacing
    extent = np.ptp(np.percentile(np.concatenate(parts), [1.0, 99.0], axis=0), axis=0)
    return float(extent.min()) + run.particle_spacing
