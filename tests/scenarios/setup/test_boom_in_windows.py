"""One boom through two windows: its segments are in one, in the other, in a rim, or in neither, and each has one load."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from coupling.participants.windows import WindowsParticipant
from scenarios.build import Assembly, build
from scenarios.load import load_scenario

SCENARIO = """
name = "boom-in-windows"

[run]
duration = 10.0
communication_step = 0.04
threads = 1
detail = "window"

[fluid]
particle_spacing = 0.15

[phases.water]
density = 1027.0
dynamic_viscosity = 1.05e-3

[tank]
lower = [-10.0, -10.0, -10.0]
upper = [10.0, 10.0, 6.0]
open = ["-x", "+x", "-y", "+y", "+z"]

[sea]
depth = 30.0

[sea.current]
kind = "steady"
speed = 0.3
direction = 0.0

[window.left]
target = [0.6, -1.35]
size = [2.7, 2.7]
depth = 0.75
rim = 0.6

[window.right]
target = [0.6, 1.5]
size = [2.7, 2.7]
depth = 0.75
rim = 0.6

[booms.main]
ends = [[0.0, -3.0], [0.0, 3.0]]
length = 7.0
segments = 14
skirt_depth = 0.45
skirt_thickness = 0.15
freeboard = 0.45
buoyancy_to_weight = 3.0
ballast_fraction = 0.7
"""


@pytest.fixture
def assembly(tmp_path: Path) -> Assembly:
    (tmp_path / "boom.toml").write_text(SCENARIO)
    return build(load_scenario(tmp_path / "boom.toml").scenario)


def test_a_boom_through_two_windows_has_one_load_and_repeats_its_steps(assembly: Assembly) -> None:
    """Shares of both windows and the formulas sum to one, the loads of both make that of the boom, and a restart repeats all."""
    simulation, world, windows = assembly.co_simulation(), assembly.world, assembly.fluid_participant
    assert world is not None and isinstance(windows, WindowsParticipant)
    simulation.initialize()
    for _ in range(2):
        simulation.step()
    parts = list(windows._windows.values())
    each, joint = np.array([one.shares.values for one in parts]), windows.shares.at(0.05)
    assert (each.max(1) > 0.5).all(), "each window bears most of a segment"
    assert ((joint > 0.01) & (joint < 0.99)).any(), "a segment lies in a rim"
    assert (joint == 0.0).any(), "a segment lies in neither window"
    assert joint.max() <= 1.0
    saved, ends = simulation.save_state(), []
    for _ in range(2):
        for _ in range(2):
            simulation.step()
        ends.append([world.pose(name).tobytes() for name in windows.shares.names])
        simulation.restore_state(saved)
    assert ends[0] == ends[1]
    simulation.step()
    for name in windows.shares.names:
        np.testing.assert_array_equal(
            windows.get(f"{name}.wrench"), np.sum([one.get(f"{name}.wrench") for one in parts], axis=0)
        )
    simulation.terminate()
    assert assembly.ledger.momentum_residual < 1e-9
