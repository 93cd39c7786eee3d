"""Neighbouring segments of a boom lean alike, as fabric does: the lean along a boom that is moored across a mouth is smooth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy.spatial.transform import Rotation

from recordings.replay.recording import Replay
from scenarios.debrief.boom_history import BoomHistory, boom_histories
from scenarios.running.run import RunOptions, run_scenario
from scenarios.spec.load import scenario_from
from scenarios.text.toml import read_toml

SMOOTH = 5.0  # [degrees] between neighbours
MOUTH = """
name = "mouth"
title = "200 m of boom, moored across a mouth"
run = {duration = 90.0, communication_step = 0.1, threads = 1}
fluid.particle_spacing = 0.25
phases.water = {density = 1025.0, dynamic_viscosity = 1.05e-3}
sea.depth = 10.0
sea.current = {kind = "steady", speed_kn = 0.5, direction_deg = 180.0}
recording = {frame_rate = 5, checkpoint_interval = 0}

[booms.main]
ends = [[0.0, 70.0], [0.0, -70.0]]
length = 200.0
segments = 66
skirt_depth = 0.75
freeboard = 0.45
buoyancy_to_weight = 8.0
ballast_fraction = 0.7
stream_deg = 180.0
"""
WIND = "sea.wind = {kind = 'steady', speed = 8.0, direction_deg = 120.0, gust_intensity = 0.12}\n"
WAVES = "sea.waves = {kind = 'regular', height = 0.28, period = 2.0, direction_deg = 180.0}\n"


def history_of(more: str, folder: Path) -> tuple[BoomHistory, np.ndarray]:
    """Run the boom with more of a sea; return its history, and the instants of the last minute."""
    record = folder / "mouth.rrd"
    scenario = scenario_from(read_toml(MOUTH.replace("recording =", f"{more}recording =")))
    assert run_scenario(scenario, options=RunOptions(record=record, overwrite=True), console=Console(quiet=True)) == 0
    (history,) = boom_histories(Replay(record))
    return history, history.time >= 30.0


def rolls(more: str, folder: Path) -> np.ndarray:
    """Return the roll (N, S) [degrees] of all segments over the last minute, positive to one side."""
    history, late = history_of(more, folder)
    turn = np.array([state.orientation for state in history.states])[late]
    return np.degrees(Rotation.from_quat(turn.reshape(-1, 4)).as_euler("ZYX")[:, 2].reshape(turn.shape[:2]))


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("more", ["", WIND], ids=["calm", "wind"])
def test_without_waves_the_lean_is_smooth_at_every_moment(more: str, tmp_path: Path) -> None:
    history, late = history_of(more, tmp_path)
    assert np.degrees(np.abs(np.diff(history.skirt_angle[late], axis=1))).max() < SMOOTH


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_fabric_keeps_neighbours_from_rolling_against_each_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If joints twist freely, waves of 2 s roll neighbours against each other, at the waves' frequency; fabric keeps them from it."""
    fabric = rolls(WAVES, tmp_path)
    monkeypatch.setattr("booms.boom.FABRIC_SHEAR", 0.0)
    free = rolls(WAVES, tmp_path)
    zigzag = [float(np.sqrt((np.diff(one, axis=1) ** 2).mean())) for one in (fabric, free)]
    assert zigzag[0] < 0.5 * zigzag[1]
