"""A body in a window at sea: it floats with the waves, and crosses the rim as its load passes from the formulas to the particles."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from scenarios.running.assembly import Assembly, build
from scenarios.setup.at_sea.build_sea import build_sea
from scenarios.setup.cost import estimate
from scenarios.spec.load import load_scenario
from scenarios.spec.resolve import resolve
from scenarios.text.problems import ScenarioError

SCENARIO = """
name = "window-box"

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

[sea.current]
kind = "steady"
speed = 1.0

[sea.waves]
kind = "regular"
height = 0.1
period = 3.0

[window]
target = TARGET
size = [SIZE, 3.6]
depth = 0.8
rim = 0.8

[bodies.box]
shape = "box"
size = [1.0, 1.0, 0.6]
position = [PLACE, 0.0, 0.0]
velocity = [1.0, 0.0, 0.0]
density = 513.5
"""


def assembled(folder: Path, target: str, place: float, size: float = 3.6, *overrides: str) -> Assembly:
    text = SCENARIO.replace("TARGET", target).replace("PLACE", str(place)).replace("SIZE", str(size))
    (folder / "box.toml").write_text(text)
    return build(load_scenario(folder / "box.toml", overrides=overrides).scenario)


def steps(assembly: Assembly, duration: float) -> Iterator[float]:
    """Yield the times of the run, step by step."""
    simulation = assembly.co_simulation()
    simulation.initialize()
    try:
        for _ in range(round(duration / 0.05)):
            simulation.step()
            yield simulation.communication_point.time
    finally:
        simulation.terminate()


def test_a_floating_body_moves_with_the_waves(tmp_path: Path) -> None:
    """It begins at rest in the current, and surges with the water after half a period; what it exchanges is accounted for."""
    assembly = assembled(tmp_path, '"box"', 0.0)
    spec, apart = assembly.scenario, []
    sea = build_sea(spec.sea_at(0.0), spec)
    assert sea is not None and assembly.world is not None
    for time in steps(assembly, 2.4):
        pose = assembly.world.pose("box")
        water = sea.velocity(np.array([[pose[0], pose[1], 0.0]]), time)[0]
        if time > 1.5:
            apart.append(assembly.world.twist("box")[0] - water[0])
    orbital = 0.05 * 2.0 * np.pi / 3.0
    assert np.abs(apart).max() < 0.2 * orbital
    assert assembly.ledger.momentum_residual < 1e-9
    assert abs(assembly.ledger.energy_residual) < 0.1


def test_a_body_that_drifts_into_a_window_feels_no_jump(tmp_path: Path) -> None:
    assembly = assembled(tmp_path, "[2.4, 0.0]", 0.0, 4.8, "sea.waves.height=0.001")
    participant = assembly.fluid_participant
    shares, heights, speeds, met = [], [], [], []
    assert assembly.world is not None
    for _ in steps(assembly, 2.6):
        shares.append(float(participant.shares.values[0]))  # type: ignore[attr-defined]
        met.append(len(assembly.fluid.moving_boundaries))
        heights.append(assembly.world.pose("box")[2])
        speeds.append(assembly.world.twist("box")[0])
    assert (shares[0], met[0]) == (0.0, 0)
    assert (shares[-1], met[-1]) == (1.0, 1)
    before = np.count_nonzero(met) - np.count_nonzero(shares)
    assert before >= 3, "the water meets it in the rim, before it bears a share"
    assert np.all(np.diff(shares) >= 0.0)
    assert np.abs(np.diff(shares)).max() < 0.25
    assert np.abs(heights).max() < 0.25 * 0.2
    assert np.abs(np.array(speeds) - 1.0).max() < 0.05
    assert participant.water_moved["out"] > 0  # type: ignore[attr-defined]
    assert assembly.ledger.momentum_residual < 1e-9


def test_a_body_in_the_rim_repeats_its_steps_after_a_restart(tmp_path: Path) -> None:
    """Its share changes in every step: particles and formulas bear it with the same one, before and after."""
    assembly = assembled(tmp_path, "[1.2, 0.0]", 0.0, 3.6)
    simulation, shares = assembly.co_simulation(), assembly.fluid_participant.shares  # type: ignore[attr-defined]
    assert assembly.world is not None
    simulation.initialize()
    for _ in range(3):
        simulation.step()
    saved, ends = simulation.save_state(), []
    first = float(shares.values[0])
    for _ in range(2):
        for _ in range(4):
            simulation.step()
        ends.append(
            (assembly.world.pose("box").tobytes(), assembly.fluid.particles.position.tobytes(), shares.values[0])
        )
        simulation.restore_state(saved)
    simulation.terminate()
    assert ends[0] == ends[1]
    assert 0.0 < first < ends[0][2] < 1.0


@pytest.mark.parametrize(
    ("override", "place", "text"),
    [
        ('window.target="buoy"', "window.target", "allowed: box"),
        ("window.depth=0.3", "window", "4 spacings"),
        ("window.rim=2.0", "window", "less than half of the size"),
    ],
)
def test_bad_input_is_refused(tmp_path: Path, override: str, place: str, text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        assembled(tmp_path, '"box"', 0.0, 3.6, override)
    assert [problem.path for problem in caught.value.problems] == [place]
    assert text in str(caught.value)


def test_no_force_is_read_where_nothing_finds_one(tmp_path: Path) -> None:
    """Without particles formulas load what moves freely: a fixed body's force is left out, and said so; in a window it is there."""
    probed = PILE + '[probes.on-pile]\nkind = "body"\nbody = "pile"\n'
    (tmp_path / "pile.toml").write_text(probed)
    for fidelity, is_there in (("none", False), ("fine", True)):
        scenario = load_scenario(tmp_path / "pile.toml", overrides=[f"fidelity={fidelity}"]).scenario
        told = [text for text in estimate(scenario).told if text.startswith("probes.on-pile: without particles")]
        assert bool(told) != is_there
        assembly = build(scenario)
        simulation = assembly.co_simulation()
        simulation.initialize()
        scalars = assembly.frame_source(simulation.communication_point).scalars
        simulation.terminate("done")
        assert "probes/on-pile/z" in scalars and ("probes/on-pile/force_x" in scalars) == is_there


PILE = """
fidelity = "fine"
name = "pile"
run = {duration = 6.0, communication_step = 0.05, threads = 1}
fluid = {particle_spacing = 0.25}
phases.water = {density = 1027.0, dynamic_viscosity = 1.05e-3}
sea = {depth = 6.0, waves = {height = 0.4, period = 3.0, build_up = 2.0}}
bodies.pile = {shape = "cylinder", radius = 0.5, height = 8.0, position = [0.0, 0.0, -2.0], motion = "fixed"}
window = {target = [0.0, 0.0], size = [7.0, 7.0], depth = 2.5}
"""


@pytest.mark.slow
def test_a_pile_down_to_the_sea_bed_is_pushed_by_waves_and_told(tmp_path: Path) -> None:
    """Inertia 2 rho pi R^2 a on the 2.5 m in the window (MacCamy and Fuchs 1954, slender): particles give 0.7 of it or more."""
    (tmp_path / "pile.toml").write_text(PILE)
    scenario = load_scenario(tmp_path / "pile.toml").scenario
    (told,) = [text for text in estimate(scenario).told if "'pile' reaches to the bottom" in text]
    assert "nothing gives that on the part below" in told
    assembly = build(scenario)
    simulation = assembly.co_simulation()
    simulation.initialize()
    force = []
    for _ in range(120):
        simulation.step()
        force.append(assembly.frame_source(simulation.communication_point).bodies["pile"].wrench[0])
    simulation.terminate("done")
    spec, points = resolve(scenario), np.zeros((20, 3))
    sea = build_sea(spec.sea_at(0.0), spec)
    points[:, 2] = -2.5 * (np.arange(20) + 0.5) / 20
    steepest = [sea.acceleration(points, time)[:, 0].mean() for time in np.linspace(3.0, 6.0, 60)]
    whole = 2.0 * 1027.0 * np.pi * 0.25 * 2.5 * np.ptp(steepest)
    assert 0.7 < np.ptp(force[60:]) / whole < 1.1


BALL = """
fidelity = "fine"
name = "ball"
run = {duration = 8.0, communication_step = STEP, threads = 1}
fluid = {particle_spacing = 0.25}
phases.water = {density = 1027.0, dynamic_viscosity = 1.05e-3}
sea = {depth = 10.0, waves = {height = 0.3, period = 4.0, build_up = 2.0}}
bodies.ball = {shape = "sphere", radius = 1.25, position = [0.0, 0.0, -2.5], motion = "fixed"}
window = {target = [0.0, 0.0], size = [11.0, 11.0], depth = 5.0}
"""


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.1, 0.05, 0.025])
def test_a_ball_under_water_has_its_wave_force_in_every_step(tmp_path: Path, step: float) -> None:
    """Inertia 3/2 rho V a (Lamb 1932, sec. 92), two thirds of it by Froude and Krylov; 10 spacings across."""
    (tmp_path / "ball.toml").write_text(BALL.replace("STEP", str(step)))
    scenario = load_scenario(tmp_path / "ball.toml").scenario
    assembly = build(scenario)
    simulation = assembly.co_simulation()
    simulation.initialize()
    spec, found = resolve(scenario), []
    sea = build_sea(spec.sea_at(0.0), spec)
    for _ in range(round(8.0 / step)):
        simulation.step()
        time = simulation.communication_point.time
        force = assembly.frame_source(simulation.communication_point).bodies["ball"].wrench[0]
        found.append((force, sea.acceleration(np.array([[0.0, 0.0, -2.5]]), time - 0.5 * step)[0, 0]))
    simulation.terminate("done")
    forces, pushes = np.array(found)[-round(4.0 / step) :].T
    inertia = 1.5 * 1027.0 * 4.0 / 3.0 * np.pi * 1.25**3
    assert forces @ pushes / (pushes @ pushes) == pytest.approx(inertia, rel=0.05)
