"""How the viewer opens a recording: scene on the left, series and events on the right, simulated time below."""

from __future__ import annotations

import rerun.blueprint as rrb

from recordings import entity_paths
from recordings.frame import CameraView, RunDescription

USUAL_PLOTS: dict[str, tuple[str, ...]] = {
    "Oil [m³]": ("oil_inside", "oil_outside", "oil_lost/**"),
    "Tow tension [N]": ("tow_tension/**",),
    "Probes": ("probes/**",),
    "Kinetic energy [J]": ("kinetic_energy",),
    "Iterations per step": ("iterations_density", "iterations_divergence", "iterations_viscosity"),
    "Density error [-]": ("density_error",),
    "Time step [s]": ("time_step",),
    "Real-time factor [-]": ("real_time_factor",),
}
_STORY_PLOTS = 3
_BACKGROUND = (224, 233, 240)


def run_blueprint(run: RunDescription) -> rrb.Blueprint:
    """The opening layout of a recording of ``run``."""
    plots = [
        rrb.TimeSeriesView(origin="/", contents=[f"/{entity_paths.scalar(name)}" for name in names], name=title)
        for title, names in (run.plots or USUAL_PLOTS).items()
    ]
    story, workings = (plots, []) if run.plots else (plots[:_STORY_PLOTS], plots[_STORY_PLOTS:])
    tabs = [rrb.Vertical(*story, name="Exercise")]
    if workings:
        tabs.append(rrb.Vertical(*workings, name="Solver"))
    events = rrb.TextLogView(origin=f"/{entity_paths.EVENTS}", name="Events")
    return rrb.Blueprint(
        rrb.Horizontal(
            _scene(run),
            rrb.Vertical(rrb.Tabs(*tabs), events, row_shares=[3, 1]),
            column_shares=[5, 2],
        ),
        rrb.TimePanel(timeline=entity_paths.TIMELINE_TIME, state="collapsed", playback_speed=1.0, play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


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
