"""Bridles of a scenario: laid taut, towed with the pull of a plain line, and refused where they cannot be."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from booms.deployment import PlacedBridle
from coupling.rigid.bridle import Bridle
from scenarios.load import scenario_from
from scenarios.problems import ScenarioError
from scenarios.running.assembly import Assembly, build
from tests.scenarios.small_tow import small_tow

ELASTIC = "line_stiffness = 20000.0\n"
AT_BOOM = ELASTIC + "bridle = { legs = [0.6, 0.6] }\n"
AT_VESSEL = ELASTIC + 'bridle = { at = "vessel", legs = [1.1, 1.2], spread = 1.4 }\n'


def begun(more: str) -> Assembly:
    return build(scenario_from(tomllib.loads(small_tow(duration=8.0, communication_step=0.1, frame_rate=5) + more)))


def towed(more: str) -> tuple[Assembly, float]:
    """Tow for 8 s; return the run and the mean tension [N] of the port line over the last 4 s."""
    assembly = begun(more)
    simulation, told = assembly.co_simulation(), []
    simulation.initialize()
    for step in range(80):
        simulation.step()
        if step >= 40:
            told.append(assembly.world.tension(assembly.fleet.tensions_of("main")["port"]))
    simulation.terminate()
    return assembly, float(np.mean(told))


@pytest.mark.parametrize("more", [AT_BOOM, AT_VESSEL])
def test_a_bridle_is_laid_taut_without_tension(more: str) -> None:
    assembly = begun(more)
    for placed in assembly.fleet.lines:
        assert isinstance(placed, PlacedBridle)
        line = assembly.world.lines[placed.name]
        assert isinstance(line, Bridle)
        poses = assembly.world.poses(assembly.world.body_names)
        assert line.pulls(poses) == pytest.approx(0.0, abs=1e-5)
        line.length *= 0.99
        assert (line.pulls(poses) > 1.0).all()
        line.length /= 0.99


@pytest.mark.slow
def test_bridles_tow_the_boom_as_plain_lines_do() -> None:
    _, plain = towed(ELASTIC)
    for more in (AT_BOOM, AT_VESSEL):
        _, tension = towed(more)
        assert tension == pytest.approx(plain, rel=0.05)


def test_impossible_bridles_are_refused() -> None:
    for more, text in {
        "bridle = { legs = [0.6, 0.6] }\n": "bridle is given, allowed: only with line_stiffness",
        ELASTIC + "bridle = { legs = [0.3, 0.3] }\n": r"bridle\.legs are \[0\.3, 0\.3\] m from points 0\.7 m apart",
        ELASTIC
        + "bridle = { legs = [2.0, 2.0] }\n": r"bridle\.legs are \[2\.0, 2\.0\] m, allowed: below tow_line = 2 m",
        ELASTIC + "bridle = { legs = [0.6, 0.6], spread = 0.5 }\n": r"bridle\.spread is given, allowed: only with at",
        ELASTIC + 'bridle = { at = "vessel", legs = [1.0, 1.0] }\n': r"bridle\.spread is missing",
        ELASTIC
        + 'bridle = { at = "vessel", legs = [1.6, 1.6], spread = 3.0 }\n': "spread of 3 m, allowed: at most the beam",
    }.items():
        with pytest.raises(ScenarioError, match=text):
            begun(more)
