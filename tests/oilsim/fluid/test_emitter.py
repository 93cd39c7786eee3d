"""Pipes: how much they pour, and what shuts them."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import Phase, PipeEmitter, block, tank_walls
from oilsim.fluid.emitter import HOLD

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
    emitter.fill(np.array([7], np.uint32))
    emitter.hold(time, np.array([7], np.uint32), np.array([[1.0 - SPACING], [1.0], [1.0]], np.float32), velocity)
    return float(velocity[0, 0])


def test_a_pipe_is_shut_opened_and_slowed_by_its_speed() -> None:
    """Layers follow the way of the jet: one every spacing, and none while it stands still."""
    emitter = pipe()
    layer = len(emitter.emit(0.0, 1e-9))
    assert poured(emitter, 0.0, 0.53) == 5 * layer
    emitter.speed = 0.0
    assert poured(emitter, 0.53, 2.0) == 0
    assert held_speed(emitter, 2.0) == 0.0
    emitter.speed = 2.0 * SPEED
    assert poured(emitter, 2.0, 2.5) == 10 * layer  # of 0.3 and 10 spacings of way
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


def test_a_pipe_drives_only_what_it_has_poured_and_only_to_its_mouth() -> None:
    """Of three in the pipe, one of which was there before, one before the mouth and one behind it; and of none once it was shut."""
    emitter, ids = pipe(), np.array([3, 5, 4], np.uint32)
    places = np.array([[1.0 - SPACING] * 2 + [1.0 + SPACING], [1.0] * 3, [1.0] * 3], np.float32)
    emitter.fill(np.array([4, 5], np.uint32))
    velocity = np.zeros((3, 3), np.float32)
    emitter.hold(0.1, ids, places, velocity)
    assert velocity[0].tolist() == [0.0, SPEED, 0.0]
    emitter.speed = 0.0
    emitter.hold(0.2, ids, places, velocity)
    emitter.speed = 2.0 * SPEED
    emitter.hold(0.3, ids, places, velocity)
    assert velocity[0].tolist() == [0.0, SPEED, 0.0]


@pytest.mark.parametrize("advance", [1.0 / 30.0, 0.0141])
def test_layers_lie_a_spacing_apart_whatever_the_steps_are(make_fluid, advance: float) -> None:
    """A jet of 5 m/s without weight, in advances whose steps differ in length: the gap between layers in the pipe is one spacing."""
    oil = (Phase(name="oil", rest_density=900.0),)
    fluid = make_fluid(phases=oil, lower=(-1.0, -1.0, -1.0), upper=(6.0, 1.0, 1.0), gravity=(0.0, 0.0, 0.0))
    fluid.add_emitter(pipe(mouth=(0.0, 0.0, 0.0), radius=0.25, spacing=0.1, speed=5.0))
    gaps = []
    for _ in range(12):
        fluid.advance(advance)
        along = fluid.state.position[0]
        inside = np.sort(along[along < 0.0])
        steps = np.diff(inside)
        gaps += steps[steps > 0.01].tolist()
    assert len(gaps) > 10
    np.testing.assert_allclose(gaps, 0.1, rtol=1e-3)


def test_a_pipe_under_water_gives_no_momentum_to_the_water_around(make_fluid) -> None:
    """It gave 9 times what it poured, while it held all the water within a spacing of it as well.

    What it pours pushes on the water before it on the way to the mouth, for which there is no more than a small multiple.
    """
    water = Phase(name="water", rest_density=1000.0), Phase(name="oil", rest_density=1000.0)
    fluid = make_fluid(phases=water, lower=(-0.2, -0.2, -0.2), upper=(2.2, 1.0, 1.3))
    fluid.add_boundary(tank_walls((0, 0, 0), (2, 0.8, 1.3), 0.1, sides=("-x", "+x", "-y", "+y", "-z")))
    fluid.add_particles(block((0, 0, 0), (2, 0.8, 0.8), 0.1), phase="water")
    fluid.add_emitter(pipe(mouth=(0.8, 0.4, 0.4), radius=0.1, spacing=0.1))
    budget, poured = fluid.watch(), 0
    for _ in range(40):
        poured += fluid.advance(0.02).emitted.get("oil", 0)
    given = budget.total.parts["emitters"].momentum[0] / (poured * 0.1**3 * 1000.0 * SPEED)
    assert 1.0 < given < 5.0


def test_pipe_pours_its_volume(make_fluid):
    fluid = make_fluid(particle_spacing=0.05, gravity=(0, 0, 0))
    pipe = PipeEmitter(
        phase="water", mouth=(0.5, 1, 1), direction=(1, 0, 0), radius=0.1, speed=0.5, spacing=0.05, volume=0.02
    )
    fluid.add_emitter(pipe)
    emitted = [fluid.advance(0.05).emitted.get("water", 0) for _ in range(40)]
    layer = len(block((-0.1, -0.1, 0), (0.1, 0.1, 0.05), 0.05)) - 4  # the corners lie outside the circle
    # a layer a spacing travelled: 0.5 m/s for 0.5 s are 5 layers
    assert sum(emitted[:10]) == pytest.approx(5 * layer, abs=layer)
    assert sum(emitted) == round(0.02 / 0.05**3)
    assert fluid.phase_velocities("water")[:, 0].mean() == pytest.approx(0.5, rel=0.02)


def test_impossible_pipe_is_refused():
    with pytest.raises(
        ValueError, match=r"pipe: radius is 0\.01 m, allowed: 0\.05 m or more, half the particle spacing"
    ):
        PipeEmitter(phase="oil", mouth=(0, 0, 0), direction=(0, 0, 1), radius=0.01, speed=1.0, spacing=0.1)


@pytest.mark.parametrize("radius", [0.1, 0.25])
def test_a_pipe_is_as_wide_as_its_radius(radius: float) -> None:
    pipe = PipeEmitter(
        phase="oil", mouth=(1.0, 1.0, 1.0), direction=(1.0, 0.0, 0.0), radius=radius, speed=1.0, spacing=0.05
    )
    layer = pipe.emit(0.0, 1e-9)
    assert np.hypot(*(layer - (0.0, 1.0, 1.0)).T[1:]).max() <= radius
    assert len(layer) * 0.05**2 == pytest.approx(np.pi * radius**2, rel=0.15)
    ids, within = (
        np.array([1, 2], np.uint32),
        np.array([radius + 0.04, radius + 0.06]),
    )  # a spacing further it holds what swells
    position = np.array([[0.95, 0.95], [1.0, 1.0], 1.0 + within], np.float32)
    velocity = np.zeros((3, 2), np.float32)
    pipe.fill(ids)
    pipe.hold(0.0, ids, position, velocity)
    np.testing.assert_array_equal(velocity[0], [1.0, 0.0])
