"""One boom through two windows: its segments are in one, in the other, in a rim, or in neither, and each has one load."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.participants.window import WindowParticipant
from coupling.participants.windows import WindowsParticipant
from scenarios.running.assembly import Assembly, build
from scenarios.spec.load import load_scenario
from scenarios.spec.resolve import resolve

SCENARIO = """
name = "boom-in-windows"

[run]
duration = 10.0
communication_step = 0.04
threads = 1

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


def test_a_boom_in_a_window_has_a_skirt_that_particles_resolve_and_stands(tmp_path: Path) -> None:
    """The shipped harbour boom, whose skirt is 5 mm thick as built, in still water: its start leans it by 17 degrees, and it rights itself.

    With 5 mm among particles of 125 mm it lay on its side, at 90 degrees.
    """
    changes = (
        "run.communication_step=0.05", "run.threads=1", "fluid.particle_spacing=0.125", "window.target=main",
        "window.size=[3.5, 3.5]", "window.depth=0.6", "window.rim=0.6", "sea.current.speed=0.0", "fluid.sleep_speed=0.03",
    )  # fmt: skip
    assembly = build(load_scenario("u-sweep", overrides=changes).scenario)
    layout, world = assembly.fleet.booms["main"], assembly.world
    assert world is not None
    assert (layout.boom.skirt_thickness, layout.boom.design_skirt_thickness) == (0.125, 0.005)
    simulation, leans = assembly.co_simulation(), []
    simulation.initialize()
    for _ in range(24):
        simulation.step()
        turns = Rotation.from_quat([world.pose(segment.name)[3:] for segment in layout.segments])
        leans.append(float(np.degrees(np.arccos(turns.as_matrix()[:, 2, 2])).max()))
    simulation.terminate()
    assert max(leans) < 25.0
    assert leans[-1] < 12.0


def test_the_coarsest_window_that_a_boom_may_meet_makes_its_skirt(tmp_path: Path) -> None:
    (tmp_path / "boom.toml").write_text(SCENARIO.replace("skirt_thickness = 0.15\n", ""))
    changes = ("window.left.spacing=0.1", "window.right.spacing=0.12")
    assert resolve(load_scenario(tmp_path / "boom.toml", overrides=changes).scenario).coarsest_spacing == 0.12
    assert resolve(load_scenario(tmp_path / "boom.toml", overrides=["fidelity=none"]).scenario).coarsest_spacing is None
    assert resolve(load_scenario("u-sweep").scenario).coarsest_spacing == 0.07


def test_a_run_says_how_many_segments_particles_bear_and_that_a_boom_lies_in_a_rim(tmp_path: Path) -> None:
    """Moved by 2.5 m, the right window has the boom in its rim of 0.6 m alone."""
    (tmp_path / "boom.toml").write_text(SCENARIO)
    scenario = load_scenario(tmp_path / "boom.toml", overrides=["window.right.target=[-0.75, 3.6]"]).scenario
    told = {notice.text: notice.level for notice in build(scenario).remarks.look(None)}
    bears = "window.left: particles bear 3 of the 14 segments of boom 'main' at the start"
    assert [level for text, level in told.items() if text.startswith(bears)] == ["info"]
    assert not any(text.startswith("window.right: particles bear") for text in told)
    lies = "window.right: boom 'main' lies in its rim at the start"
    assert [level for text, level in told.items() if text.startswith(lies)] == ["warning"]


@pytest.mark.parametrize("segments", [13, 14])
def test_a_window_that_follows_a_boom_lies_on_its_axis(tmp_path: Path, segments: int) -> None:
    """Beside the axis, on the one of the two middle segments, a window drew the boom of `u-sweep` 0.3 m aside in 14 s."""
    text = SCENARIO.replace("segments = 14", f"segments = {segments}").replace(
        "target = [0.6, -1.35]", 'target = "main"'
    )
    (tmp_path / "boom.toml").write_text(text[: text.index("[window.right]")] + text[text.index("[booms.main]") :])
    assembly = build(load_scenario(tmp_path / "boom.toml").scenario)
    participant = assembly.fluid_participant
    assert isinstance(participant, WindowParticipant)
    assert participant.window.rim.center[1] == pytest.approx(0.0, abs=1e-9)
