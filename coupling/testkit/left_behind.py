"""The things that a run leaves behind: its recording, its state, and a picture of a moment with bodies marked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from coupling.testkit.readings import History
from recordings.files.checkpoint import Checkpoint, save_checkpoint, state_hash
from recordings.model.frame import Frame, RunDescription

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARK = (230, 30, 120, 255)  # red, green, blue, opacity: a colour that no palette of a run has
OTHER = (176, 182, 188, 255)
WIDTHS = (240, 900)  # [pixels] of a picture, least and largest
PARTICLE = 30  # [pixels] of a particle in a small picture: larger ones take long to draw


def write_recording(history: History, path: Path) -> None:
    """Write the frames that a history has kept to a recording; RecordingError if it cannot be written, ValueError without frames."""
    from recordings.sink.recorder import Recorder

    if history.run is None or not history.frames:
        raise ValueError(f"history has {len(history.frames)} frames, allowed: one or more, of a run that has begun")
    recorder = Recorder(path, frame_rate=1e6)  # all that were kept
    recorder.initialized(history.run)
    for frame in history.frames:
        recorder.step_completed(frame)
    for event in history.events:
        recorder.event(event)
    recorder.terminated(history.ended or "unfinished")


def write_checkpoint(state: dict[str, Any], frame: Frame, run: dict[str, Any], path: Path) -> None:
    """Write the state of a run at a frame; CheckpointError if it cannot be written.

    run: words that describe how to make the run again. `recordings.files.checkpoint.load_checkpoint` reads it.
    """
    checkpoint = Checkpoint(scenario_hash=state_hash(run), index=frame.index, time=frame.time, run=run, state=state)
    save_checkpoint(path, checkpoint)


def _outline(axes: Axes, name: str, corners: NDArray[np.float64]) -> None:
    """Draw the outline (K, 2) [pixels] of a marked body, with its name."""
    tint = [part / 255.0 for part in MARK[:3]]
    axes.fill(*corners.T, fill=False, edgecolor=tint, linewidth=1.6, linestyle="--")
    x, y = corners[corners[:, 1].argmin()]
    axes.annotate(
        name, (x, y), (0, 10), textcoords="offset points", ha="center", fontsize=11, fontweight="bold", color=tint
    )


def draw_moment(history: History, frame: Frame, marked: Sequence[str], text: str, path: Path) -> None:
    """Draw the moment of a frame as PNG, with the marked bodies in a colour of their own and in outline, and `text` below.

    ValueError for a history whose run has not begun.
    """
    from dataclasses import replace
    from textwrap import fill

    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from recordings.pictures.scenes import SceneView
    from recordings.pictures.style import STYLE
    from recordings.replay.moments import Moment

    if history.run is None:
        raise ValueError("history has no run, allowed: one that has begun")
    meshes = {name: replace(mesh, color=MARK if name in marked else OTHER) for name, mesh in history.run.meshes.items()}
    positions = {name: phase.position for name, phase in frame.phases.items()}
    moment = Moment(time=frame.time, positions=positions, bodies=dict(frame.bodies))
    view = SceneView(replace(history.run, meshes=meshes), [moment], _width(history.run, frame))
    image = view.draw(moment)
    words = fill(text, 104)
    rows = words.count("\n") + 1
    scene, foot, top = 9.0 * image.shape[0] / image.shape[1], 0.2 * rows + 0.25, 0.4
    height = scene + foot + top
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, height), dpi=120, facecolor="white")
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, foot / height, 1.0, scene / height))
        axes.imshow(image, interpolation="antialiased", aspect="equal")
        axes.set_axis_off()
        axes.autoscale(False)
        for name in (one for one in marked if one in meshes and one in moment.bodies):
            _outline(axes, name, view.outline(name, moment))
        figure.text(
            0.015,
            1.0 - 0.2 / height,
            f"{history.run.name} at {frame.time:.4g} s",
            va="center",
            fontsize=12,
            fontweight="bold",
        )
        figure.text(0.015, 0.12 / height, words, va="bottom", fontsize=9.5, color="#c23030")
        figure.savefig(path)


def _width(run: RunDescription, frame: Frame) -> int:
    """Return the width [pixels] of a picture in which a particle takes about PARTICLE pixels."""
    extents = [float(np.ptp(phase.position, axis=0).max()) for phase in frame.phases.values() if len(phase.position)]
    across = max(extents, default=np.inf) / run.particle_spacing
    return int(np.clip(PARTICLE * across, *WIDTHS))
