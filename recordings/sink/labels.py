"""Names of booms in the scene, each over the middle of its boom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr

from recordings import entity_paths, palette
from recordings.exercise import BoomDescription
from recordings.sample import Sample
from recordings.sink.streams import Changing, Static

_ABOVE = 2.0  # [1] height of a name over the boom, in heights of its freeboard


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
