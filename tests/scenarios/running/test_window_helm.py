"""In a run with a window, helmsmen and pictures have the sea of the formulas: its current and its surface."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.running.assembly import build
from scenarios.spec.load import load_scenario

SMALL = ("window.size=[6.0, 6.0]", "window.depth=1.2", "fluid.particle_spacing=0.3", "run.threads=1")


@pytest.mark.parametrize("fidelity", ["none", "live"])
def test_helmsmen_meet_the_current_and_frames_show_the_surface(fidelity: str) -> None:
    assembly = build(
        load_scenario("sweep-200m", overrides=[f"fidelity={fidelity}", *(SMALL if fidelity == "live" else ())]).scenario
    )
    simulation = assembly.co_simulation()
    simulation.initialize()
    try:
        current = next(iter(assembly.parts.helms.values())).current
        assert current is not None
        np.testing.assert_allclose(current(np.zeros(2), 0.0), [-0.2 * 1852.0 / 3600.0, 0.0], atol=1e-9)
        frame = assembly.frame_source(simulation.communication_point)
        surface = frame.surface
        assert surface is not None
        assert 0.05 < np.ptp(surface.height) < 2.0
    finally:
        simulation.terminate()
