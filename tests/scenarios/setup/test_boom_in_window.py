"""A boom through a window: its segments are in its middle, in its rim, or outside, and each has one load."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.participants.window import WindowParticipant
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

[window]
target = [0.6, -1.35]
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


NESTED = ("window.outer={spacing=0.3, size=[6.0, 6.0]}", "window.depth=1.2")


@pytest.fixture(params=[(), NESTED], ids=["alone", "nested"])
def assembly(request: pytest.FixtureRequest, tmp_path: Path) -> Assembly:
    (tmp_path / "boom.toml").write_text(SCENARIO)
    return build(load_scenario(tmp_path / "boom.toml", overrides=request.param).scenario)


def test_a_boom_through_a_window_has_one_load_and_repeats_its_steps(assembly: Assembly) -> None:
    """Shares of the windows and the formulas sum to one, and a restart repeats all."""
    simulation, world, fluid = assembly.co_simulation(), assembly.world, assembly.fluid_participant
    assert world is not None and isinstance(fluid, WindowParticipant)
    simulation.initialize()
    for _ in range(2):
        simulation.step()
    shares = fluid.shares.at(0.05)
    assert shares.max() > 0.5, "the window bears most of a segment"
    assert ((shares > 0.01) & (shares < 0.99)).any(), "a segment lies in the rim"
    assert (shares == 0.0).any(), "a segment lies outside"
    assert shares.max() <= 1.0
    if len(fluid.all_shares) > 1:
        outer = fluid.all_shares[1].at(0.05)
        assert (outer[shares == 1.0] == 0.0).all()
        assert outer.max() > 0.5, "the outer window bears most of a segment"
        assert (shares + outer).max() <= 1.0
        bears_alone = np.flatnonzero((fluid.shares.values == 0.0) & (fluid.all_shares[1].values > 0.0))
        assert bears_alone.size
        for name in np.array(fluid.shares.names)[bears_alone]:
            assert fluid.expected_twist(name) == pytest.approx(fluid.outer.expected_twist(name))
    saved, ends = simulation.save_state(), []
    for _ in range(2):
        for _ in range(2):
            simulation.step()
        ends.append([world.pose(name).tobytes() for name in fluid.shares.names])
        simulation.restore_state(saved)
    assert ends[0] == ends[1]
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


def test_the_particles_that_a_boom_may_meet_make_its_skirt(tmp_path: Path) -> None:
    (tmp_path / "boom.toml").write_text(SCENARIO.replace("skirt_thickness = 0.15\n", ""))
    for changes, spacing in ((["window.spacing=0.12"], 0.12), (["fidelity=none"], None)):
        assert resolve(load_scenario(tmp_path / "boom.toml", overrides=changes).scenario).met_spacing == spacing
    assert resolve(load_scenario("u-sweep").scenario).met_spacing == 0.07


@pytest.mark.parametrize(
    ("place", "level", "begins"),
    [
        ([0.6, -1.35], "info", "window: particles bear 3 of the 14 segments of boom 'main' at the start"),
        ([-0.75, 3.6], "warning", "window: boom 'main' lies in its rim at the start"),  # of 0.6 m
    ],
)
def test_a_run_says_how_many_segments_particles_bear_or_that_a_boom_lies_in_the_rim(
    tmp_path: Path, place: list[float], level: str, begins: str
) -> None:
    (tmp_path / "boom.toml").write_text(SCENARIO)
    scenario = load_scenario(tmp_path / "boom.toml", overrides=[f"window.target={place}"]).scenario
    told = [
        notice
        for notice in build(scenario).remarks.look(None)
        if "segments of boom" in notice.text or "rim" in notice.text
    ]
    assert [(notice.level, notice.text[: len(begins)]) for notice in told] == [(level, begins)]


@pytest.mark.parametrize("segments", [13, 14])
def test_a_window_that_follows_a_boom_lies_on_its_axis(tmp_path: Path, segments: int) -> None:
    """Beside the axis, on the one of the two middle segments, a window drew the boom of `u-sweep` 0.3 m aside in 14 s."""
    text = SCENARIO.replace("segments = 14", f"segments = {segments}").replace(
        "target = [0.6, -1.35]", 'target = "main"'
    )
    (tmp_path / "boom.toml").write_text(text)
    assembly = build(load_scenario(tmp_path / "boom.toml").scenario)
    participant = assembly.fluid_participant
    assert isinstance(participant, WindowParticipant)
    assert participant.window.rim.center[1] == pytest.approx(0.0, abs=1e-9)
