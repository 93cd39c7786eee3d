"""The tow winch against its formulas: drive, stall, brake, render and recover, and the ends of its line."""

from __future__ import annotations

import math

import numpy as np
import pytest

from docs.fmus.tow_winch import TowWinch

STEP = 0.05


def winch(**settings: float) -> TowWinch:
    """A winch with its brake released that begins at 0 s."""
    model = TowWinch()
    for name, value in settings.items():
        model.set(name, np.array([value]))
    model.enter_initialization_mode(0.0)
    model.exit_initialization_mode()
    return model


def run(model: TowWinch, seconds: float) -> TowWinch:
    for k in range(round(seconds / STEP)):
        model.do_step(k * STEP, STEP)
    return model


def test_drive_approaches_its_order_exponentially() -> None:
    # v = u (1 - exp(-t / T)), x = u (t - T (1 - exp(-t / T))), exact at any step
    model = run(winch(speed_order=0.1, response_time=0.4), 1.0)
    kept = math.exp(-1.0 / 0.4)
    assert model.speed == pytest.approx(0.1 * (1.0 - kept), rel=1e-12)
    assert model.paid_out == pytest.approx(0.1 * (1.0 - 0.4 * (1.0 - kept)), rel=1e-12)


def test_hauling_slows_down_under_load_and_stalls() -> None:
    for tension, share in ((0.0, 1.0), (50.0, 0.5), (100.0, 0.0), (500.0, 0.0)):
        model = run(winch(speed_order=-0.1, tension=tension, stall_pull=100.0, line_in=5.0), 10.0)
        assert model.speed == pytest.approx(-0.1 * share, abs=1e-12)


def test_speed_is_limited_both_ways() -> None:
    for order in (-9.0, 9.0):
        model = run(winch(speed_order=order, maximum_speed=0.2, line_in=50.0, line_out=50.0), 10.0)
        assert model.speed == pytest.approx(math.copysign(0.2, order))


def test_brake_holds_up_to_its_limit_and_then_slips() -> None:
    held = run(winch(brake=1.0, speed_order=0.2, tension=59.0, brake_holding=60.0), 2.0)
    assert (held.paid_out, held.speed) == (0.0, 0.0)
    slipping = run(winch(brake=1.0, tension=100.0, brake_holding=60.0, brake_slip=400.0), 2.0)
    assert slipping.paid_out == pytest.approx(2.0 * (100.0 - 60.0) / 400.0)


def test_constant_tension_renders_and_recovers_to_the_ordered_tension() -> None:
    # a spring of 100 N/m to a point 1 m off: the tension settles within the dead band of the order, from either side
    for start in (0.0, 0.9):
        model = winch(constant_tension=1.0, tension_order=30.0, dead_band=1.0, tension_band=20.0, line_in=1.0)
        model.memory["paid_out"] = start
        for k in range(2000):
            model.set("tension", np.array([max(0.0, 100.0 * (1.0 - model.paid_out))]))
            model.do_step(k * STEP, STEP)
        assert model.tension == pytest.approx(30.0, abs=1.5)
        assert model.speed == pytest.approx(0.0, abs=1e-6)


def test_line_ends_stop_the_drum() -> None:
    out = run(winch(speed_order=0.2, line_out=0.3), 10.0)
    assert (out.paid_out, out.speed) == (0.3, 0.0)
    home = run(winch(speed_order=-0.2, line_in=0.1), 10.0)
    assert (home.paid_out, home.speed) == (-0.1, 0.0)


def test_saved_winch_repeats() -> None:
    model = run(winch(speed_order=0.15), 0.5)
    saved = model.save_state()
    first = run(model, 0.5).paid_out
    model.restore_state(saved)
    assert run(model, 0.5).paid_out == first


def test_impossible_settings_are_refused() -> None:
    with pytest.raises(ValueError, match=r"brake_slip is 0 N s/m, allowed: above 0"):
        winch(brake_slip=0.0)
    with pytest.raises(ValueError, match="'TowWinch' has no variable 'colour', allowed: tension, speed_order"):
        winch(colour=1.0)
    with pytest.raises(ValueError, match="'paid_out' is an output"):
        winch(paid_out=1.0)
