"""Bodies in a recording: the exact motions of all in one chunk, and the shapes, tensions and forces that the viewer draws.

A chunk costs Rerun about a millisecond, however little it holds. So one entity has the motions of all bodies, frame by frame, and the
segments of a boom, which share a mesh, are drawn as instances of one entity. Instances have one colour; therefore a line along the top
of each segment shows its tension.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import rerun as rr

from recordings import appearance, entity_paths, palette
from recordings.frame import MeshDescription, RunDescription
from recordings.sample import Sample
from recordings.sink.force_arrows import ForceArrows
from recordings.sink.streams import Changing, Static

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
        """Write the motion and tension of every body at full precision, and before them the bodies' names if they have changed."""
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
        counts = np.array([len(sample.bodies) for sample in samples])
        columns = [
            *rr.AnyValues.columns(motion=pa.array(motion)).partition(len(motion) // counts.sum() * counts),
            *rr.AnyValues.columns(tension=pa.array(tension)).partition(counts),
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
            albedo_factor=palette.body_color(name, mesh),
            face_rendering="DoubleSided",
        )
        described = rr.AnyValues(vertices=mesh.vertices.ravel(), faces=mesh.faces.ravel(), names=list(drawn.names))
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
    full = {name: boom.full_tension for boom in (run.exercise.booms if run.exercise else ()) for name in boom.segments}
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
