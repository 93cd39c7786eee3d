"""Pipes: how much they pour, and what shuts them."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.emitter import HOLD, PipeEmitter

SPACING, SPEED, STEP = 0.05, 0.5, 0.01


def pipe(**options: object) -> PipeEmitter:
    """From left to right through (1, 1, 1), 0.2 m wide."""
    terms = {"phase": "oil", "mouth": (1.0, 1.0, 1.0), "direction": (1.0, 0.0, 0.0), "radius": 0.1, "speed": SPEED}
    return PipeEmitter(**(terms | {"spacing": SPACING} | options))


def poured(emitter: PipeEmitter, begin: float, end: float) -> int:
    """Particles that enter between two times [s]."""
    steps = range(round(begin / STEP), round(end / STEP))
    return sum(len(emitter.emit(STEP * step, STEP)) for step in steps)


def held_speed(emitter: PipeEmitter, time: float) -> float:
    """To what speed [m/s] a particle is brought that lies at rest in the pipe, a spacing before its mouth."""
    velocity = np.zeros((3, 1), np.float32)
    emitter.hold(time, np.array([[1.0 - SPACING], [1.0], [1.0]], np.float32), velocity)
    return float(velocity[0, 0])


def test_a_pipe_is_shut_opened_and_slowed_by_its_speed() -> None:
    """Layers follow the way of the jet: one every spacing, and none while it stands still."""
    emitter = pipe()
    layer = len(emitter.emit(0.0, 1e-9))
    assert poured(emitter, 0.0, 0.5) == 5 * layer
    emitter.speed = 0.0
    assert poured(emitter, 0.5, 2.0) == 0
    assert held_speed(emitter, 2.0) == 0.0
    emitter.speed = 2.0 * SPEED
    assert poured(emitter, 2.0, 2.5) == 10 * layer
    assert held_speed(emitter, 2.5) == pytest.approx(2.0 * SPEED)


def test_a_pipe_drives_nothing_before_it_opens_and_after_its_last_layer_has_left() -> None:
    """Two layers enter at 1 s and a spacing later; the last has come HOLD spacings, to the mouth, another HOLD spacings later."""
    layer = len(pipe().emit(0.0, 1e-9))
    emitter = pipe(start=1.0, volume=2 * layer * SPACING**3)
    assert poured(emitter, 0.0, 1.0) == 0
    assert held_speed(emitter, 0.9) == 0.0
    assert poured(emitter, 1.0, 1.2) == 2 * layer
    assert held_speed(emitter, 1.2) == pytest.approx(SPEED)
    assert poured(emitter, 1.2, 1.1 + HOLD * SPACING / SPEED + 2 * STEP) == 0
    assert held_speed(emitter, 2.0) == 0.0
