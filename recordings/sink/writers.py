"""Write the parts of a scene to a recording: bodies with their force arrows, the names of booms, the surface of the sea."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import rerun as rr

from recordings.model import appearance, entity_paths, palette
from recordings.model.exercise import BoomDescription, Equipment, ExerciseDescription
from recordings.model.frame import MeshDescription, RunDescription
from recordings.model.sample import Sample
from recordings.model.surface import SurfaceFrame, grid_faces


class Static(Protocol):
    """Logs components that do not change."""

    def __call__(self, path: str, *components: rr.AsComponents) -> None:
        """Log them at a path."""


class Changing(Protocol):
    """Sends one chunk, with one row for each sample."""

    def __call__(self, path: str, samples: Sequence[Sample], columns: Iterable[rr.ComponentColumn]) -> None:
        """Send it for a path."""


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


_ABOVE = 2.0  # [1] height of a name over the boom, in heights of its freeboard


_LINE_RADIUS = 0.15  # [m] of lines, as they are drawn


class BoomNames:
    """Writes where the names stand."""

    def __init__(self, static: Static, changing: Changing) -> None:
        self._static, self._changing = static, changing
        self._places: Mapping[str, tuple[str, float]] = {}

    def begin(self, booms: Sequence[BoomDescription]) -> None:
        """Write the names themselves; the place of each is a segment of its boom."""
        self._places = {boom.name: (boom.apex, _ABOVE * boom.freeboard) for boom in booms}
        for boom in booms:
            look = rr.Points3D.from_fields(labels=[boom.name], colors=[palette.NAME], radii=[0.0], show_labels=True)
            self._static(entity_paths.boom_label(boom.name), look)

    def write(self, samples: Sequence[Sample]) -> None:
        """Write where the names stand in samples."""
        for name, (segment, above) in self._places.items():
            having = [sample for sample in samples if segment in sample.bodies]
            if having:
                places = np.array([sample.bodies[segment][:3] for sample in having]) + np.array([0.0, 0.0, above])
                columns = rr.Points3D.columns(positions=places.astype(np.float32))
                self._changing(entity_paths.boom_label(name), having, columns)


class EquipmentWriter:
    """Writes skimmers as rings, and mooring legs and ties as lines; of those that have parted or hang loose, a point."""

    def __init__(self, static: Static, changing: Changing) -> None:
        self._static, self._changing = static, changing
        self._exercise = ExerciseDescription()

    def begin(self, exercise: ExerciseDescription | None) -> None:
        """Write looks, and the names of skimmers and anchors."""
        if exercise is None:
            return
        self._exercise = exercise
        for one in exercise.equipment:
            labels = [] if one.kind == "tie" else [one.name]  # names of all cross bridles would hide the boom
            look = rr.LineStrips3D.from_fields(colors=[palette.EQUIPMENT], radii=[_LINE_RADIUS], labels=labels)
            self._static(_path_of(one), look)

    def write(self, samples: Sequence[Sample]) -> None:
        """Write where they are in samples."""
        exercise = self._exercise
        for one in exercise.equipment:
            found = [(sample, one.strip(sample.bodies, sample.scalars, exercise.water_level)) for sample in samples]
            having = [(sample, strip) for sample, strip in found if strip is not None]
            if having:
                seen = [exercise.is_seen(one, sample.time, sample.scalars) for sample, _ in having]
                strips = [
                    (strip if is_seen else np.repeat(strip[:1], 2, axis=0)).astype(np.float32)
                    for (_, strip), is_seen in zip(having, seen, strict=True)
                ]
                self._changing(_path_of(one), [sample for sample, _ in having], rr.LineStrips3D.columns(strips=strips))


def _path_of(one: Equipment) -> str:
    """Return the entity path of a skimmer or a line."""
    return f"{entity_paths.EQUIPMENT}/{one.kind}/{one.name}"


Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DrawnBodies:
    """Bodies that one entity draws: the segments of a boom with one mesh, or a single body.

    path: of the entity; mesh: None for a body that only has a pose; full_tension: [N] of the boom, 0 for others.
    """

    path: str
    names: tuple[str, ...]
    mesh: MeshDescription | None
    full_tension: float = 0.0

    @property
    def are_instances(self) -> bool:
        """True for several bodies, which are drawn as instances of one mesh."""
        return len(self.names) > 1

    @property
    def tension_line(self) -> Array:
        """Ends (2, 3) [m] of the line that shows the tension, in the body frame: along x, on top."""
        assert self.mesh is not None
        lower, upper = self.mesh.vertices.min(axis=0), self.mesh.vertices.max(axis=0)
        return np.array([[lower[0], 0.0, upper[2]], [upper[0], 0.0, upper[2]]], dtype=np.float64)


class BodyWriter:
    """The writer of bodies to one stream."""

    def __init__(self, run: RunDescription, static: Static, changing: Changing) -> None:
        """Write the meshes of the run, with the looks of tensions and forces."""
        self._static, self._changing = static, changing
        density = max((phase.rest_density for phase in run.phases), default=1000.0)
        self._arrows = ForceArrows(run.meshes, density)
        self._drawn = list(drawn_bodies(run))
        self._known = {name for drawn in self._drawn for name in drawn.names}
        self._last_names: tuple[str, ...] = ()
        for drawn in self._drawn:
            self._write_shape(drawn)

    def write(self, samples: Sequence[Sample]) -> None:
        """Write the bodies of a block of samples."""
        having = [sample for sample in samples if sample.bodies]
        if not having:
            return
        self._write_motions(having)
        for name in dict.fromkeys(name for sample in having for name in sample.bodies):
            if name not in self._known:  # a body without a mesh, which only has a pose
                self._known.add(name)
                self._drawn.append(DrawnBodies(entity_paths.body(name), (name,), None))
        for drawn in self._drawn:
            present = [sample for sample in having if any(name in sample.bodies for name in drawn.names)]
            if present:
                self._draw(drawn, present)

    def _write_motions(self, samples: Sequence[Sample]) -> None:
        """Write motion, tension and held speed of every body at full precision, and before them the bodies' names if they have changed."""
        changed = []
        for sample in samples:
            names = tuple(sample.bodies)
            if names != self._last_names:
                self._last_names = names
                changed.append(sample)
        if changed:
            names = pa.array([name for sample in changed for name in sample.bodies])
            parts = rr.AnyValues.columns(names=names).partition([len(sample.bodies) for sample in changed])
            self._changing(entity_paths.motion_names(), changed, parts)
        motion = np.concatenate([motion for sample in samples for motion in sample.bodies.values()])
        tension = np.array([sample.tensions.get(name, np.nan) for sample in samples for name in sample.bodies])
        held = np.array([sample.held_speeds.get(name, np.nan) for sample in samples for name in sample.bodies])
        counts = np.array([len(sample.bodies) for sample in samples])
        columns = [
            *rr.AnyValues.columns(motion=pa.array(motion)).partition(len(motion) // counts.sum() * counts),
            *rr.AnyValues.columns(tension=pa.array(tension)).partition(counts),
            *rr.AnyValues.columns(held_speed=pa.array(held)).partition(counts),
        ]
        self._changing(entity_paths.MOTIONS, samples, columns)

    def _write_shape(self, drawn: DrawnBodies) -> None:
        """Write the triangles of a mesh; poses follow frame by frame.

        The viewer shades by vertex normals, so every triangle gets vertices of its own. The mesh as described is stored beside them.
        """
        mesh, name = drawn.mesh, drawn.names[0]
        assert mesh is not None
        corners = mesh.vertices[mesh.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.float32(1e-30))
        shape = rr.Mesh3D(
            vertex_positions=corners.reshape(-1, 3),
            vertex_normals=np.repeat(normal, 3, axis=0),
            vertex_colors=None if mesh.face_colors is None else np.repeat(mesh.face_colors, 3, axis=0),
            albedo_factor=palette.body_color(name, mesh) if mesh.face_colors is None else None,
            face_rendering="DoubleSided",
        )
        colors = {} if mesh.face_colors is None else {"face_colors": mesh.face_colors.ravel()}
        described = rr.AnyValues(
            vertices=mesh.vertices.ravel(), faces=mesh.faces.ravel(), names=list(drawn.names), **colors
        )
        self._static(drawn.path, shape, described)
        if entity_paths.body_group(name) == entity_paths.VESSELS:
            self._static(entity_paths.label(name), appearance.name_over(mesh, name.partition("/")[2]))
        if drawn.full_tension:
            self._static(entity_paths.tension(drawn.path), appearance.tension())
        scale = self._arrows.metres_per_newton.get(name)
        if scale is not None:
            self._static(entity_paths.force(drawn.path), appearance.force(), rr.AnyValues(metres_per_newton=scale))

    def _draw(self, drawn: DrawnBodies, samples: Sequence[Sample]) -> None:
        """Write poses, tensions and forces of an entity as the viewer draws them."""
        names = [[name for name in drawn.names if name in sample.bodies] for sample in samples]
        counts = [len(some) for some in names]
        motion = np.array([sample.bodies[name] for sample, some in zip(samples, names, strict=True) for name in some])
        position, orientation = motion[:, :3], motion[:, 3:7]
        if drawn.are_instances:
            poses = rr.InstancePoses3D.columns(translations=position, quaternions=orientation).partition(counts)
        else:
            poses = rr.Transform3D.columns(translation=position, quaternion=orientation)
        self._changing(drawn.path, samples, poses)
        if drawn.full_tension:
            tension = np.array(
                [one.tensions.get(name, 0.0) for one, some in zip(samples, names, strict=True) for name in some]
            )
            strips = _placed(drawn.tension_line, position, orientation).astype(np.float32)
            colors = palette.tension_color(tension, drawn.full_tension)
            lines = rr.LineStrips3D.columns(strips=strips, colors=colors).partition(counts)
            self._changing(entity_paths.tension(drawn.path), samples, lines)
        vectors = self._arrows.vectors(drawn.names[0], motion[:, 13:16])
        if vectors is not None:
            arrows = rr.Arrows3D.columns(origins=position, vectors=vectors).partition(counts)
            self._changing(entity_paths.force(drawn.path), samples, arrows)


def drawn_bodies(run: RunDescription) -> Iterable[DrawnBodies]:
    """Sort the bodies of a run into those that one entity draws: segments of a boom that share a mesh, else each by itself."""
    full = {name: boom.full_tension for boom in run.booms for name in boom.segments}
    shapes: dict[str, dict[int, list[str]]] = {}
    for name, mesh in run.meshes.items():
        parent = name.rpartition("/")[0] if entity_paths.body_group(name) == entity_paths.BOOM else name
        shapes.setdefault(parent, {}).setdefault(id(mesh), []).append(name)
    for parent, together in shapes.items():
        for place, names in enumerate(together.values()):
            path = entity_paths.body(names[0]) if len(names) == 1 else entity_paths.segments(parent, place)
            yield DrawnBodies(path, tuple(names), run.meshes[names[0]], full.get(names[0], 0.0))


def _placed(points: Array, position: Array, orientation: Array) -> Array:
    """Place points (P, 3) [m] of the body frame in the world, for each of N poses: (N, P, 3) [m]; x + v + 2 u x (u x v + w v)."""
    axis, real = orientation[:, None, :3], orientation[:, None, 3:]
    turned = points + 2.0 * np.cross(axis, np.cross(axis, points) + real * points)
    return np.asarray(turned + position[:, None])


class SurfaceWriter:
    """Writes surfaces and films; the places of vertices in the film's box are sent again only where the box has changed."""

    def __init__(self, static: Static, changing: Changing) -> None:
        self._static, self._changing = static, changing
        self._box: tuple[float, ...] = ()
        self._lines: tuple[bytes, bytes] | None = None
        self.has_film = self.is_clear = False

    @property
    def is_begun(self) -> bool:
        """True once a surface has been written."""
        return bool(self._box)

    def write(self, samples: Sequence[Sample]) -> None:
        """Write the surfaces of those samples that have one."""
        having = [sample for sample in samples if sample.surface is not None]
        surfaces = [sample.surface for sample in samples if sample.surface is not None]
        if not having:
            return
        if not self._box:
            self.has_film, self.is_clear = having[0].film is not None, surfaces[0].is_clear
            self._begin(surfaces[0])
        drawn = rr.Mesh3D.columns(
            vertex_positions=np.concatenate([surface.vertices for surface in surfaces]),
            vertex_colors=np.concatenate([_greys(surface) for surface in surfaces]),
        )
        self._changing(entity_paths.SURFACE, having, [*drawn.partition([surface.height.size for surface in surfaces])])
        for sample, surface in zip(having, surfaces, strict=True):
            lines = (surface.x.tobytes(), surface.y.tobytes())
            if surface.box != self._box or lines != self._lines:
                self._box, self._lines = surface.box, lines
                places = rr.Mesh3D.columns(vertex_texcoords=surface.places_in_box[:, ::-1].copy())
                box = rr.AnyValues.columns(box=np.array(surface.box)).partition([4])
                self._changing(entity_paths.SURFACE, [sample], [*places.partition([surface.height.size]), *box])
        films = [sample for sample in having if sample.film is not None]
        if films:
            self._changing(entity_paths.SURFACE, films, _texture_columns(films))

    def _begin(self, surface: SurfaceFrame) -> None:
        """Write the triangles, the number of vertices in each direction, and the water's colour where no film has it."""
        shape = (len(surface.x), len(surface.y))
        color = None if self.has_film else palette.CLEAR_WATER if self.is_clear else palette.SEA
        faces = rr.Mesh3D.from_fields(triangle_indices=grid_faces(*shape), albedo_factor=color)
        self._static(entity_paths.SURFACE, faces, rr.AnyValues(shape=list(shape), clear=[int(self.is_clear)]))


def _greys(surface: SurfaceFrame) -> npt.NDArray[np.uint8]:
    """Return the daylight on each vertex as a grey (V, 4), by which the viewer multiplies the colours."""
    grey = np.round(255.0 * surface.brightness).astype(np.uint8)
    return np.stack([grey, grey, grey, np.full_like(grey, 255)], axis=-1)


def _texture_columns(samples: Sequence[Sample]) -> rr.ComponentColumnList:
    images = [palette.film_colors(sample.film.thickness) for sample in samples if sample.film is not None]
    formats = [
        rr.components.ImageFormat(width=image.shape[1], height=image.shape[0], color_model="RGB", channel_datatype="U8")
        for image in images
    ]
    return rr.Mesh3D.columns(albedo_texture_buffer=[image.tobytes() for image in images], albedo_texture_format=formats)
