"""The account of a boom whose oil is a slick: what particles of a window carry past is resolved, the rest is modelled."""

from __future__ import annotations

import pytest

from oilsim.slick.loss_cause import LossCause
from scenarios.build import build
from scenarios.load import load_scenario


def test_what_particles_carry_past_is_resolved_and_what_is_put_back_is_told() -> None:
    assembly = build(load_scenario("sweep-200m").scenario)
    simulation, slick = assembly.co_simulation(), assembly.slick
    assert slick is not None
    simulation.initialize()
    try:
        simulation.step()
        losses, first = slick.slick.losses, slick.slick.barriers.rows("main").start
        assert "metrics/oil_held_back" not in assembly.scoring.series()
        losses.gone[LossCause.DRAINAGE, first], losses.carried[LossCause.DRAINAGE, first] = 3.0, 1.0
        losses.gone[LossCause.ENTRAINMENT, first + 1] = 0.5
        losses.held_back[first] = 0.25
        slick.restore_state(slick.save_state())
        simulation.step()
        (boom,) = assembly.scoring.booms
        report = boom.report
        assert report is not None
        assert report.lost_by_cause == pytest.approx({"drainage": 3.0, "entrainment": 0.5})
        assert report.lost_modelled == pytest.approx({"drainage": 2.0, "entrainment": 0.5})
        assert boom.summary()["held_back_m3"] == pytest.approx(0.25)
        assert assembly.scoring.series()["metrics/oil_held_back"] == pytest.approx(0.25)
        assert any("put back (modelled)" in notice.text for notice in assembly.scoring.take_notices())
    finally:
        simulation.terminate()
