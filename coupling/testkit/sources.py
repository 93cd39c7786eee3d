"""Sources of readings: live runs, and recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from coupling.testkit.history import BodyTrack, Track
from coupling.testkit.readings import Array, Basin, Readable, Readings
from recordings.model.frame import RunDescription

if TYPE_CHECKING:
    from recordings.replay.recording import Replay

TANK = "tank"  # the name of a tank's walls in every recording


def readings_of(source: object) -> Readings:
    """Return the readings of a scene, a watched world, a scenario run, a recording or its file; TypeError for anything else."""
    if isinstance(source, Readings):
        return source
    if isinstance(source, str | Path) or _is_replay(source):
        return readings_of_recording(source)
    if not isinstance(source, Readable):
        allowed = "a scene, a watched world (coupling.testkit.watch), a scenario run, a recording or its file"
        raise TypeError(f"a check is given {source!r}, allowed: {allowed}")
    return source.readings()


def _is_replay(source: object) -> TypeGuard[Replay]:
    """Tell whether a source is a recording that has been opened; without one, nothing that reads recordings has been imported."""
    module = sys.modules.get("recordings.replay.recording")
    return module is not None and isinstance(source, module.Replay)


def readings_of_recording(source: str | Path | Replay) -> Readings:
    """Return the readings of a recording; RecordingError if it cannot be read."""
    from recordings.replay.moments import recorded_steps
    from recordings.replay.recording import Replay

    replay = source if isinstance(source, Replay) else Replay(source)
    bodies = {
        name: BodyTrack(time=one.time, pose=one.pose, twist=one.twist, wrench=one.wrench, tension=one.tension)
        for name, one in replay.bodies.items()
    }

    def particles(phase: str) -> Array:
        steps = replay.phase_times(phase).index
        frames = replay.phase_frames(phase, {int(steps[-1])}) if len(steps) else ()
        return next((frame.position.astype(np.float64) for _, _, frame in frames), np.empty((0, 3)))

    return Readings(
        run=replay.run,
        time=recorded_steps(replay)[-1][1],
        bodies=bodies,
        series={name: Track(one.time, one.value) for name, one in replay.scalars.items() if one.value.ndim == 1},
        particles=particles,
        basin=basin_of(replay.run),
        source=f"the recording {replay.path.name}",
    )


def basin_of(run: RunDescription) -> Basin | None:
    """Return the upright tank whose walls are in the description; None without one.

    The first layer of wall particles stands half a spacing behind the surface, so the walls' innermost points tell where the inside ends.
    """
    walls = run.boundaries.get(TANK)
    if walls is None or run.dimension != 3:
        return None
    middle = 0.5 * (walls.min(axis=0) + walls.max(axis=0)).astype(np.float64)
    upper_half = walls[walls[:, 2] > middle[2]].astype(np.float64)  # sides only, without the floor
    if not len(upper_half):
        return None
    inside = []
    for axis in (0, 1):
        below, above = upper_half[:, axis] < middle[axis], upper_half[:, axis] > middle[axis]
        other = np.abs(upper_half[:, 1 - axis] - middle[1 - axis]) < 0.75 * run.particle_spacing  # off the corners
        if not ((below & other).any() and (above & other).any()):
            return None
        inside.append(
            upper_half[above & other, axis].min() - upper_half[below & other, axis].max() - run.particle_spacing
        )
    center = (np.abs(walls[:, :2] - middle[:2]) < 0.75 * run.particle_spacing).all(axis=1)
    if not center.any():
        return None
    return Basin(float(inside[0] * inside[1]), float(walls[center, 2].max()) + 0.5 * run.particle_spacing)
