"""Several windows in one run: two bodies, each in a window of its own with its own spacing; windows that overlap are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from coupling.master.errors import CoSimulationError
from coupling.participants.windows import WindowsParticipant
from scenarios.running.assembly import Assembly, build
from scenarios.setup.cost import estimate
from scenarios.spec.load import load_scenario
from scenarios.text.problems import ScenarioError

SCENARIO = """
name = "two-windows"

[run]
duration = 10.0
communication_step = 0.05
threads = 1

[fluid]
particle_spacing = 0.2
sleep_speed = 0.02

[phases.water]
density = 1027.0
dynamic_viscosity = 1.05e-3

[tank]
lower = [-10.0, -10.0, -10.0]
upper = [10.0, 10.0, 6.0]
open = ["-x", "+x", "-y", "+y", "+z"]

[sea]
depth = 30.0

[sea.waves]
kind = "regular"
height = 0.1
period = 3.0

[window.near]
target = "box"
size = [3.6, 3.6]
depth = 0.8
rim = 0.8

[window.far]
target = "other"
spacing = 0.25
size = [4.0, 3.5]
depth = 1.0
rim = 0.8

[bodies.box]
shape = "box"
size = [1.0, 1.0, 0.6]
position = [0.0, 0.0, 0.0]
density = 513.5

[bodies.other]
shape = "box"
size = [1.0, 1.0, 0.6]
position = [PLACE, 0.0, 0.0]
velocity = [SPEED, 0.0, 0.0]
density = 513.5
"""

NEAR = '{ target = "box", size = [3.6, 3.6], depth = 0.8, rim = 0.8 }'
FAR = '{ target = "other", spacing = 0.25, size = [4.0, 3.5], depth = 1.0, rim = 0.8 }'


def assembled(folder: Path, place: float = 5.0, speed: float = 0.0, *overrides: str) -> Assembly:
    text = SCENARIO.replace("PLACE", str(place)).replace("SPEED", str(speed))
    (folder / "two.toml").write_text(text)
    return build(load_scenario(folder / "two.toml", overrides=overrides).scenario)


def test_two_bodies_float_in_two_windows_as_each_in_its_own(tmp_path: Path) -> None:
    """Bodies that nothing ties do in two windows what each does in one alone, to the last bit, and again after a restart."""
    assembly = assembled(tmp_path)
    simulation, world = assembly.co_simulation(), assembly.world
    assert world is not None
    simulation.initialize()
    for _ in range(2):
        simulation.step()
    windows = assembly.fluid_participant
    assert isinstance(windows, WindowsParticipant)
    shares = windows.shares
    np.testing.assert_array_equal(shares.at(0.25), 1.0)
    assert assembly.particle_counts()["water"] == pytest.approx(18 * 18 * 4 + 16 * 14 * 4, abs=120)
    saved, ends = simulation.save_state(), []
    for _ in range(2):
        for _ in range(2):
            simulation.step()
        ends.append({name: world.pose(name).tobytes() for name in ("box", "other")})
        simulation.restore_state(saved)
    simulation.terminate()
    assert ends[0] == ends[1]
    assert assembly.ledger.momentum_residual < 1e-9
    for name, window in (("box", NEAR), ("other", FAR)):
        alone = assembled(tmp_path, 5.0, 0.0, f"window={window}")
        single = alone.co_simulation()
        single.initialize()
        for _ in range(4):
            single.step()
        single.terminate()
        assert alone.world is not None
        assert alone.world.pose(name).tobytes() == ends[0][name]


def test_windows_that_overlap_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="'near' and 'far' overlap: their middles are 3 m apart along x"):
        assembled(tmp_path, 3.0)


def test_windows_that_come_to_overlap_end_the_run(tmp_path: Path) -> None:
    """A body whose window touches the other at the start drifts towards it."""
    simulation = assembled(tmp_path, 3.9, -3.0).co_simulation()
    simulation.initialize()
    try:
        with pytest.raises(CoSimulationError, match="overlap"):
            for _ in range(6):
                simulation.step()
    finally:
        simulation.terminate()


def test_check_tells_of_each_window(tmp_path: Path) -> None:
    (tmp_path / "two.toml").write_text(SCENARIO.replace("PLACE", "5.0").replace("SPEED", "0.0"))
    cost = estimate(load_scenario(tmp_path / "two.toml").scenario)
    told = "\n".join(cost.told)
    assert "window.near: 3.6 by 3.6 m, 0.8 m deep, 1,296 particles of 0.2 m" in told
    assert "window.far: 4 by 3.5 m, 1 m deep, 896 particles of 0.25 m" in told
    assert cost.particles["water"] == 1296 + 896


@pytest.mark.parametrize(
    ("override", "place", "text"),
    [
        ('window.far.target="buoy"', "window.far.target", "allowed: box, other"),
        ("window.far.spacing=0.3", "window.far", "4 spacings"),
        ("window.far.colour=1", "window.far.colour", "is unknown"),
        ("fluid.gravity=[1.0, 0.0, -9.8]", "fluid.gravity", "straight down"),
        ("run.budget=true", "run.budget", "keeps no account of causes"),
    ],
)
def test_bad_input_is_refused(tmp_path: Path, override: str, place: str, text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        assembled(tmp_path, 5.0, 0.0, override)
    assert place in [problem.path for problem in caught.value.problems]
    assert text in str(caught.value)
