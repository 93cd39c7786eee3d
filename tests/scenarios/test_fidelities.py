"""Exercises with a window, as they ship: a few steps of each, with the skirt, and in a J the skimmer, among the particles."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.spec.load import load_scenario

WINDOWS = {
    "sweep-200m": "boom/main/segment-33",
    "j-sweep-skimmer": "boom/main/segment-24",  # which carries the brush
    "v-sweep": "boom/main/segment",
    "anchored-containment": "boom/main/segment",
    "tow-speed-trial": "boom/main/segment",
}
FIDELITIES = [pytest.param("live", 3.0), pytest.param("fine", 8.0, marks=[pytest.mark.slow, pytest.mark.timeout(900)])]


@pytest.mark.parametrize(("fidelity", "particles_to_the_draft"), FIDELITIES)
@pytest.mark.parametrize("name", WINDOWS)
def test_a_window_follows_what_is_there_to_see(
    scenario_run: type[ScenarioRun], name: str, fidelity: str, particles_to_the_draft: float
) -> None:
    run = scenario_run(load_scenario(name, overrides=[f"fidelity={fidelity}"]).scenario)
    step = run.assembly.scenario.run.communication_step
    run.run(3 * step)
    window, frame = run.assembly.scenario.window, run.last_frame()
    draft = run.assembly.scenario.booms["main"].skirt_depth
    assert draft / window.spacing_in(run.assembly.scenario.fluid) == pytest.approx(particles_to_the_draft, rel=0.02)
    middle = np.array([frame.scalars[f"windows/window/{axis}"] for axis in "xy"])
    near = [
        name for name, one in frame.bodies.items() if np.abs(one.position[:2] - middle).max() < 0.25 * min(window.size)
    ]
    assert any(WINDOWS[name] in one for one in near)
    water = frame.phases["water"].position
    assert len(water) > 2000 and np.isfinite(water).all()
    assert 0.0 < np.linalg.norm(run.assembly.fluid.particles.velocity, axis=0).max() < 3.0
