"""Skimmers, mooring legs and ties as pictures show them: points on bodies, which move along with these."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Point3 = tuple[float, float, float]
_CORNERS = 24  # of the ring that stands for a skimmer's mouth


@dataclass(frozen=True, kw_only=True)
class Equipment:
    """A skimmer with one end, its mouth, or a line with two, a mooring leg's anchor last.

    ends    the body of each end, empty for the world, and the point [m] along its axes from its centre of mass
    places  names of the series of the place [m] of the last end, where it may be moved: a mouth, or an anchor that drags
    width   [m] of a skimmer's mouth
    series  name of the series of a line's tension [N], which is 0 where it has parted or hangs loose; empty for a skimmer
    """

    name: str
    kind: Literal["skimmer", "mooring", "tie"]
    ends: tuple[tuple[str, Point3], ...]
    places: tuple[str, ...] = ()
    width: float = 0.0
    series: str = ""

    def strip(
        self, motions: Mapping[str, npt.NDArray[np.float64]], scalars: Mapping[str, float], level: float
    ) -> npt.NDArray[np.float64] | None:
        """Return a line (N, 3) [m] that shows it, not below `level` [m], where water would hide it; None without one of its bodies.

        motions: of bodies by name, (7,) or more, position [m] and quaternion xyzw first; scalars: values of series by name.
        """
        if any(body and body not in motions for body, _ in self.ends):
            return None
        places = np.array([_placed(np.array(point), motions.get(body)) for body, point in self.ends])
        moved = [scalars.get(name) for name in self.places]
        places[-1, : len(moved)] = [old if new is None else new for old, new in zip(places[-1], moved, strict=False)]
        places[:, 2] = np.maximum(places[:, 2], level)
        if self.kind != "skimmer":
            return places
        turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
        return np.asarray(places + 0.5 * self.width * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn]))


def _placed(point: npt.NDArray[np.float64], motion: npt.NDArray[np.float64] | None) -> npt.NDArray[np.float64]:
    """Return where a point (3,) [m] of a body is in the world: x + p + 2 u x (u x p + w p) for a quaternion (u, w)."""
    if motion is None:
        return point
    axis, real = motion[3:6], motion[6]
    return np.asarray(motion[:3] + point + 2.0 * np.cross(axis, np.cross(axis, point) + real * point))
