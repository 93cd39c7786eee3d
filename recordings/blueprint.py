"""How the viewer opens a recording: scene on the left, series and events on the right, simulated time below."""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal

import rerun.blueprint as rrb

from recordings import entity_paths
from recordings.frame import CameraView, RunDescription
from recordings.plots import WORKINGS, plots_with_series

_BACKGROUND = (224, 233, 240)


def run_blueprint(run: RunDescription, scalars: Collection[str], *, live: bool = False) -> rrb.Blueprint:
    """The opening layout of a recording of ``run``, with diagrams of those series that are recorded.

    ``live`` shows the newest frame, otherwise the viewer waits at the first one.
    """
    play: Literal["following", "paused"] = "following" if live else "paused"
    time_panel = rrb.TimePanel(
        timeline=entity_paths.TIMELINE_TIME, state="collapsed", playback_speed=1.0, play_state=play
    )
    tabs = []
    chosen = plots_with_series(run.plots, [entity_paths.scalar_name(entity_paths.scalar(name)) for name in scalars])
    for title, workings in (("Exercise", False), ("Solver", True)):
        views = [_plot(plot, names) for plot, names in chosen.items() if (plot in WORKINGS) == workings]
        if views:
            tabs.append(rrb.Vertical(*views, name=title))
    events = rrb.TextLogView(origin=f"/{entity_paths.EVENTS}", name="Events")
    beside = rrb.Vertical(rrb.Tabs(*tabs), events, row_shares=[3, 1]) if tabs else events
    return rrb.Blueprint(
        rrb.Horizontal(_scene(run), beside, column_shares=[5, 2]),
        time_panel,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _plot(title: str, names: Collection[str]) -> rrb.TimeSeriesView:
    """One diagram of some series."""
    return rrb.TimeSeriesView(origin="/", contents=[f"/{entity_paths.scalar(name)}" for name in names], name=title)


def _scene(run: RunDescription) -> rrb.Spatial3DView:
    """The 3-D view; boundary particles are there but not shown, because a tank's walls would hide the water."""
    hidden = {f"/{entity_paths.BOUNDARY}": rrb.EntityBehavior(visible=False)}
    return rrb.Spatial3DView(
        origin="/",
        name=run.name,
        overrides=hidden,
        background=_BACKGROUND,
        line_grid=False,
        eye_controls=_eye(run.camera),
    )


def _eye(camera: CameraView | None) -> rrb.EyeControls3D | None:
    """The camera's place, if the run says one."""
    if camera is None:
        return None
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital, position=camera.eye, look_target=camera.target, eye_up=(0.0, 0.0, 1.0)
    )
