"""A few random scenes of `make stress`, and the tools that run them."""

from __future__ import annotations

import tomllib
from contextlib import suppress

import numpy as np
import pytest

from scenarios.running.assembly import build
from scenarios.spec.load import scenario_from
from scenarios.text.problems import ScenarioError
from tests.stress import trials
from tests.stress.__main__ import trial_of
from tests.stress.random_exchanges import run_exchange_trial
from tests.stress.random_scenes import random_scene
from tests.stress.random_worlds import random_world
from tests.stress.trials import Trial, as_toml, run_trial
from tests.stress.world_trials import run_world_trial

SEEDS = range(7000, 7004)  # `make stress` draws hundreds
WORLDS = range(7000, 7002)


@pytest.mark.parametrize("seed", SEEDS[:1])
def test_random_scene_keeps_to_physics(seed: int) -> None:
    assert trial_of(seed).faults == {}


@pytest.mark.parametrize("seed", SEEDS[:1])
def test_random_exchange_keeps_to_physics(seed: int) -> None:
    assert run_exchange_trial(seed).faults == {}


@pytest.mark.parametrize("seed", WORLDS[:1])
def test_random_world_keeps_to_physics(seed: int) -> None:
    assert run_world_trial(seed).faults == {}


def test_leaks_of_a_world_are_what_comes_through_its_sides_or_vanishes() -> None:
    world = random_world(WORLDS[0])
    place, spacing = world.fluid.particles.position.copy(), world.fluid.config.particle_spacing
    seen = world.fluid.particles._replace(position=place)
    assert world.count_leaked() == 0
    place[0, 0] = -2.0 * spacing
    assert world.count_leaked(seen) == 1
    place[2, 1] = 2.0 * world.size[2] + spacing  # over the rim, and down outside
    assert world.count_leaked(seen) == 1
    place[:, 1] = -2.0 * spacing
    assert world.count_leaked(seen) == 1
    world.fluid.remove_particles(np.arange(world.fluid.particle_count) < 3)
    assert world.count_leaked() == 2
    world.close()


def test_most_random_scenes_can_be_built() -> None:
    built = 0
    for seed in SEEDS:
        with suppress(ScenarioError):
            fluid = build(scenario_from(random_scene(seed))).fluid
            built += fluid.particle_count > 0
            fluid.close()
    assert built >= 0.75 * len(SEEDS)


def test_scene_that_fails_is_left_as_the_same_scenario() -> None:
    for seed in SEEDS:
        scene = random_scene(seed)
        assert tomllib.loads(as_toml(scene)) == {key: value for key, value in scene.items() if value != {}}


def test_faults_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trials, "FASTEST", 1e-3)
    data = random_scene(7000)
    data["run"]["duration"] = 20 * data["run"]["communication_step"]
    assert "speed" in run_trial(7000, data).faults
    data["fluid"]["particle_spacing"] = -1.0
    assert "particle_spacing" in run_trial(7000, data).refused


def test_largest_figures_are_kept() -> None:
    trial = Trial(1)
    for value in (1.0, 3.0, 2.0):
        trial.note("speed", value, 2.5)
    assert trial.figures == {"speed": 3.0}
    assert trial.faults == {"speed": "3, allowed: 2.5"}
