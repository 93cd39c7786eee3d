"""Cameras of the viewer: over the whole scene, at a boom's apex, and at a vessel that tows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from recordings import entity_paths
from recordings.exercise import BoomDescription
from recordings.frame import CameraView, RunDescription

Places = Mapping[str, npt.NDArray[np.float64]]
_APEX_REACH = 0.3  # distance of the apex camera, in lengths of the boom
_OVERVIEW_REACH = 1.1  # distance of the overview, in extents of the exercise
_VESSEL_REACH = 2.2  # distance of the vessel camera, in lengths of the vessel


@dataclass(frozen=True)
class FollowingView:
    """A camera that starts at ``camera`` and keeps its place relative to the entity at the path ``follows``."""

    title: str
    follows: str
    camera: CameraView


def following_views(run: RunDescription, places: Places) -> list[FollowingView]:
    """Place cameras at every boom's apex and at the first vessel that tows it; ``places`` (3,) [m] are those of the first frame."""
    views = []
    for boom in run.exercise.booms if run.exercise else ():
        if not all(name in places for name in boom.segments):
            continue
        views.append(_at_apex(boom, places))
        towing = next((f"{entity_paths.VESSELS}/{end}" for end in boom.ends), "")
        if towing in places and towing in run.meshes:
            length = float(np.ptp(run.meshes[towing].vertices, axis=0).max())
            views.append(_at_vessel(boom, towing, length, places))
    return views


def overview(places: Places) -> CameraView:
    """Place a camera over the bodies at `places` (3,) [m], so far away that it sees them all."""
    together = np.array(list(places.values()))
    middle = 0.5 * (together.min(axis=0) + together.max(axis=0))
    return _view(middle + _OVERVIEW_REACH * float(np.ptp(together, axis=0).max()) * np.array([-0.4, -1.0, 0.7]), middle)


def _outward(boom: BoomDescription, places: Places) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the apex (3,) [m], and the horizontal unit vector (3,) to it from the middle between the ends."""
    apex = np.asarray(places[boom.apex])
    away = apex - 0.5 * (places[boom.segments[0]] + places[boom.segments[-1]])
    away[2] = 0.0
    return apex, away / max(float(np.linalg.norm(away)), 1e-9)


def _at_apex(boom: BoomDescription, places: Places) -> FollowingView:
    """Place a camera outside the U and above, where oil leaks out."""
    apex, outward = _outward(boom, places)
    eye = apex + _APEX_REACH * boom.length * (outward + np.array([0.0, 0.0, 0.8]))
    return FollowingView(f"Apex of {boom.name}", entity_paths.boom_label(boom.name), _view(eye, apex))


def _at_vessel(boom: BoomDescription, vessel: str, length: float, places: Places) -> FollowingView:
    """Place a camera ahead of the vessel that looks back over it at the boom."""
    _, outward = _outward(boom, places)
    target = np.asarray(places[vessel])
    eye = target + _VESSEL_REACH * length * (np.array([0.0, 0.0, 0.6]) - outward)
    return FollowingView(f"Vessel {vessel.partition('/')[2]}", entity_paths.body(vessel), _view(eye, target))


def _view(eye: npt.NDArray[np.float64], target: npt.NDArray[np.float64]) -> CameraView:
    return CameraView(
        (float(eye[0]), float(eye[1]), float(eye[2])), (float(target[0]), float(target[1]), float(target[2]))
    )
