"""The layout in which the viewer opens a recording: scenes on the left; legend, diagrams and events on the right; time below."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
import rerun.blueprint as rrb

from recordings.model import entity_paths, palette
from recordings.model.exercise import BoomDescription
from recordings.model.frame import CameraView, RunDescription
from recordings.sink.plots import plots_with_series, usual_plots

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
    for boom in run.booms:
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


Layout = Literal["recording", "live", "embedded"]
_BACKGROUND = (205, 224, 238)  # a bright sky
_MOST_NAMED = 5  # a diagram with more series has no room for a legend


def run_blueprint(
    run: RunDescription,
    scalars: Collection[str],
    places: Places | None = None,
    *,
    layout: Layout = "recording",
    has_surface: bool = False,
    has_film: bool = False,
) -> rrb.Blueprint:
    """Lay out a recording of ``run``, with diagrams of the series that are recorded.

    ``places`` are the positions (3,) [m] of the bodies in the first frame. "live" shows the newest frame, from cameras that do not move:
    viewer 0.41 goes too near to a body that it follows if the body's frames arrive later than the layout. "embedded" does the same with
    scenes alone, for a page that has its own diagrams. Otherwise the viewer plays the recording at real speed, in a loop, and its cameras
    follow. ``has_surface``: water is shown as a surface, and not as particles, too. ``has_film``: so is the oil, as a film on the surface.
    """
    if run.camera is None and places and has_film:  # the viewer's own would show the sea to its horizon
        run = replace(run, camera=overview(places))
    live = layout != "recording"
    hidden = [*(_waters(run) if has_surface else []), *(_oils(run) if has_film else [])]
    scenes = _scenes(run, places or {}, follow=not live, hidden=hidden)
    return rrb.Blueprint(
        scenes if layout == "embedded" else rrb.Horizontal(scenes, _beside(run, scalars), column_shares=[5, 2]),
        _time_panel("following", "off") if live else _time_panel("playing", "all"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _time_panel(play_state: Literal["following", "playing"], loop_mode: Literal["off", "all"]) -> rrb.TimePanel:
    """Set up the time panel at real speed; a viewer that loops does not follow the newest frame."""
    return rrb.TimePanel(
        timeline=entity_paths.TIMELINE_TIME,
        state="collapsed",
        playback_speed=1.0,
        play_state=play_state,
        loop_mode=loop_mode,
    )


def _scenes(run: RunDescription, places: Places, *, follow: bool, hidden: Collection[str]) -> rrb.Container | rrb.View:
    """Lay out the overview, with the forces on the bodies behind it, above the cameras that follow boom and vessel."""
    overview = _scene(run, "Overview", run.camera, hidden=[entity_paths.FORCES, *hidden])
    forces = _scene(run, "Forces", run.camera, hidden=[*_waters(run), entity_paths.SURFACE])
    above = rrb.Tabs(overview, forces) if run.meshes else overview
    close = [_close_scene(run, view, follow=follow, hidden=hidden) for view in following_views(run, places)]
    return rrb.Vertical(above, rrb.Horizontal(*close), row_shares=[3, 2]) if close else above


def _close_scene(
    run: RunDescription, view: FollowingView, *, follow: bool, hidden: Collection[str]
) -> rrb.Spatial3DView:
    hidden = [entity_paths.FORCES, *_waters(run), *hidden]
    return _scene(run, view.title, view.camera, hidden=hidden, follows=view.follows if follow else None)


def _scene(
    run: RunDescription, title: str, camera: CameraView | None, *, hidden: Collection[str], follows: str | None = None
) -> rrb.Spatial3DView:
    """Build a 3-D view; boundary particles are in it but hidden, because a tank's walls would hide the water."""
    return rrb.Spatial3DView(
        origin="/",
        name=title,
        overrides={f"/{path}": rrb.EntityBehavior(visible=False) for path in (entity_paths.BOUNDARY, *hidden)},
        background=_BACKGROUND,
        line_grid=False,
        eye_controls=None if camera is None else _eye(camera, follows),
    )


def _waters(run: RunDescription) -> list[str]:
    """List the phases that would hide a boom from a near camera."""
    return [entity_paths.phase(phase.name) for phase in run.phases if palette.is_water(phase)]


def _oils(run: RunDescription) -> list[str]:
    """List the paths of oil."""
    return [entity_paths.phase(name) for name in run.oils]


def _eye(camera: CameraView, follows: str | None) -> rrb.EyeControls3D:
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=camera.eye,
        look_target=camera.target,
        eye_up=(0.0, 0.0, 1.0),
        tracking_entity=None if follows is None else f"/{follows}",
    )


def _beside(run: RunDescription, scalars: Collection[str]) -> rrb.Container | rrb.View:
    """Lay out legend, diagrams and events."""
    names = [entity_paths.scalar_name(entity_paths.scalar(name)) for name in scalars]
    chosen = plots_with_series(run.plots, names)
    tabs = []
    for title, plots in usual_plots(names).items():
        views = [_plot(plot, chosen.pop(plot)) for plot in plots if plot in chosen]
        if views:
            tabs.append(rrb.Vertical(*views, name=title))
    if chosen:
        own = rrb.Vertical(*(_plot(plot, found) for plot, found in chosen.items()), name="Series")
        tabs.insert(0 if run.exercise is None else 1, own)
    told: rrb.Container | rrb.View = rrb.TextDocumentView(origin=f"/{entity_paths.LEGEND}", name="Legend")
    parts = [(told, 6 if run.exercise is not None else 4 if run.meshes else 3)]
    if tabs:
        parts.append((rrb.Tabs(*tabs), 13))
    parts.append((_log(), 4))
    return rrb.Vertical(*(part for part, _ in parts), row_shares=[share for _, share in parts])


def _plot(title: str, names: Collection[str]) -> rrb.TimeSeriesView:
    """Build one diagram of some series; causes of loss have the colours of the legend beside the scene."""
    contents = [f"/{entity_paths.scalar(name)}" for name in names]
    shown = 1 < len(names) <= _MOST_NAMED
    legend = rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=shown)
    return rrb.TimeSeriesView(origin="/", contents=contents, name=title, plot_legend=legend)


def _log() -> rrb.TextLogView:
    """Build the list of events: time and text."""
    columns = rrb.TextLogColumns(timeline_columns=[entity_paths.TIMELINE_TIME], text_log_columns=["Body"])
    return rrb.TextLogView(origin=f"/{entity_paths.EVENTS}", name="Events", columns=columns)
