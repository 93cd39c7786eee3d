"""A window that meets no water, one smaller than a wave, and one coarser than a skirt: one clear message with the cure, whoever asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from scenarios.cli import main
from scenarios.running.assembly import build
from scenarios.setup.cost import estimate
from scenarios.spec.load import load_scenario
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError

SCENARIO = """
name = "bad-window"

[run]
duration = 1.0
communication_step = 0.05
threads = 1

[fluid]
particle_spacing = 0.2

[phases.water]
density = 1027.0
dynamic_viscosity = 1.05e-3

[tank]
lower = [-20.0, -20.0, -10.0]
upper = [20.0, 20.0, 6.0]
open = ["-x", "+x", "-y", "+y", "+z"]

[sea]
depth = 30.0

[sea.waves]
kind = "regular"
height = 0.05
period = 1.4

[window]
target = [0.0, 3.0]
size = [3.6, 3.6]
depth = 0.8

[bodies.rock]
shape = "box"
size = [8.0, 8.0, 6.0]
position = [-9.0, 0.0, -0.5]
density = 2600.0
motion = "fixed"

[booms.main]
ends = [[0.0, 0.0], [0.0, 6.0]]
length = 7.0
segments = 7
skirt_depth = 0.45
freeboard = 0.45
buoyancy_to_weight = 5.0
"""


def with_coarse_particles(scenario: Scenario) -> Scenario:
    """Return the scenario with particles of 0.5 m in a window that is deep and large enough for them."""
    assert scenario.window is not None
    window = replace(scenario.window, depth=4.0, size=(6.0, 6.0))
    return replace(scenario, fluid=replace(scenario.fluid, particle_spacing=0.5), window=window)


def with_target(scenario: Scenario, target: tuple[float, float]) -> Scenario:
    assert scenario.window is not None
    return replace(scenario, window=replace(scenario.window, target=target))


# what is wrong: key and value of the file, the same by Python, and the parts of the one message
REFUSED: dict[str, tuple[str, str, Callable[[Scenario], Scenario], tuple[str, ...]]] = {
    "too shallow": (
        "sea.depth", "0.5", lambda one: replace(one, sea=replace(one.sea, depth=0.5)),
        ("fluid.particle_spacing is 0.2 m", "allowed in a window on water 0.5 m deep: up to a quarter of that"),
    ),
    "inside a rock": (
        "window.target", "[-9.0, 0.0]", lambda one: with_target(one, (-9.0, 0.0)),
        ("window.target puts all of the window inside body 'rock'", "allowed: a place in the water"),
    ),
    "coarser than the skirt": (
        "fluid.particle_spacing", "0.5",
        with_coarse_particles,
        ("fluid.particle_spacing is 0.5 m", "allowed in a window: up to the skirt of boom 'main', 0.45 m"),
    ),
}  # fmt: skip


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "bad.toml"
    path.write_text(SCENARIO)
    return path


def as_written(text: str, key: str, value: str) -> str:
    """Return the file with another value of a key; a spacing above a quarter of the window's depth gets a deeper and larger window too."""
    table, _, name = key.partition(".")
    before, after = text.split(f"[{table}]\n")
    line = next(one for one in after.splitlines() if one.startswith(f"{name} = "))
    changed = f"{before}[{table}]\n{after.replace(line, f'{name} = {value}', 1)}"
    if key != "fluid.particle_spacing":
        return changed
    return changed.replace("depth = 0.8", "depth = 4.0").replace("size = [3.6, 3.6]", "size = [6.0, 6.0]")


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused_with_the_cure(path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The same message from the file, --set, Python, `oilsim check` and a run."""
    key, value, changed, parts = REFUSED[name]
    overrides = [
        f"{key}={value}",
        *(["window.depth=4.0", "window.size=[6.0, 6.0]"] if key == "fluid.particle_spacing" else []),
    ]
    said = []
    for make in (estimate, build):
        with pytest.raises(ScenarioError) as caught:
            make(load_scenario(path, overrides=overrides).scenario)
        said.append(caught.value.problems)
    with pytest.raises(ScenarioError) as caught:
        estimate(changed(load_scenario(path).scenario))
    said.append(caught.value.problems)
    path.write_text(as_written(SCENARIO, key, value))
    with pytest.raises(ScenarioError) as caught:
        estimate(load_scenario(path).scenario)
    said.append(caught.value.problems)
    assert [len(problems) for problems in said] == [1, 1, 1, 1]
    assert len({str(problems[0]) for problems in said}) == 1
    for command in ("check", "run"):
        assert main([command, str(path), *(["--no-record"] if command == "run" else [])]) == 2
        error = " ".join(capsys.readouterr().err.split())
        assert all(part in error for part in parts), error


def test_a_window_smaller_than_a_wave_is_told_with_the_rim_that_would_end_it(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The wave is 3.06 m long in deep water, g T^2 / 2 pi, and a window of 2.8 m smaller than that."""
    assert main(["check", str(path)]) == 0
    assert "smaller than the sea's waves" not in " ".join(capsys.readouterr().out.split())
    assert main(["check", str(path), "--set", "window.size=[2.8, 2.8]"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "it is smaller than the sea's waves of 3.06 m, which pass all the same" in told
    assert "window.rim = 1.53 in a window of 6.12 m keeps 1 %" in told
    small = with_target(load_scenario(path, overrides=["window.size=[2.8, 2.8]"]).scenario, (0.0, 3.0))
    assert [one for one in estimate(small).told if "smaller than the sea's waves of 3.06 m" in one]


def test_a_fixed_body_that_reaches_beyond_a_window_is_told(path: Path) -> None:
    """A window at the rock's corner holds a part of it, which its water does not meet."""
    beyond = estimate(load_scenario(path, overrides=["window.target=[-4.0, 3.0]"]).scenario).told
    assert [one for one in beyond if "body 'rock' reaches beyond it" in one and "window.size must hold" in one]
    clear = estimate(load_scenario(path).scenario).told
    assert not [one for one in clear if "reaches beyond" in one]


def test_a_fixed_body_alone_is_met(path: Path) -> None:
    """No body moves, and the rock in the window displaces water all the same."""
    text = SCENARIO[: SCENARIO.index("[booms.main]")].replace("size = [8.0, 8.0, 6.0]", "size = [1.0, 1.0, 3.0]")
    path.write_text(text.replace("target = [0.0, 3.0]", "target = [-9.0, 0.0]"))
    assembly = build(load_scenario(path).scenario)
    before, simulation = assembly.fluid.particle_count, assembly.co_simulation()
    simulation.initialize()
    simulation.step()
    simulation.terminate()
    assert len(assembly.fluid.moving_boundaries) == 1
    assert before - assembly.fluid.particle_count == pytest.approx(1.0 * 1.0 * 0.8 / 0.2**3, rel=0.5)


@pytest.mark.parametrize(
    ("override", "place", "text"),
    [
        ('window.target="buoy"', "window.target", "allowed: main, rock"),
        ("window.spacing=0.3", "window", "4 spacings"),
        ("window.near.size=[3.6, 3.6]", "window.near", "is unknown"),
        ("fluid.gravity=[1.0, 0.0, -9.8]", "fluid.gravity", "straight down"),
        ("run.budget=true", "run.budget", "keeps no account of causes"),
    ],
)
def test_what_a_window_cannot_have_is_refused(path: Path, override: str, place: str, text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path, overrides=[override])
    assert place in [problem.path for problem in caught.value.problems]
    assert text in str(caught.value)
