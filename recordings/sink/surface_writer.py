"""Columns of the sea's surface: a mesh that changes, and the oil on it as the mesh's texture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import rerun as rr

from recordings import entity_paths, palette
from recordings.sample import Sample
from recordings.sink.streams import Changing, Static
from recordings.surface import SurfaceFrame, grid_faces


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
