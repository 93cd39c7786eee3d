"""The boom of case 60 floats, stands upright and is moored as its numbers say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.validation.bodies.flumes.floating_boom import ABOVE, BELOW, FLUME, PARTS, WIDTH, Boom, Run, waves_of
from tests.validation.case import Bench
from tests.validation.scenes import WATER_DENSITY


@pytest.mark.parametrize("resolution", [10, 20])
def test_a_boom_has_the_area_of_float_and_skirt_and_the_faces_of_its_outline(resolution: int) -> None:
    spacing = FLUME.draft / resolution
    boom = Boom(spacing)
    boundary = boom.boundary()
    assert boundary.volume.sum() == pytest.approx(WIDTH * (BELOW + ABOVE) + spacing * (FLUME.draft - BELOW))
    assert boundary.area.sum() == pytest.approx(2.0 * (WIDTH + FLUME.draft + ABOVE))
    assert boom.mass == pytest.approx(1.1 * WATER_DENSITY * (WIDTH * BELOW + spacing * (FLUME.draft - BELOW)))
    assert sum(share for share, _ in PARTS) == pytest.approx(1.0)
    assert boom.centre < -0.5 * BELOW  # below the middle of what it displaces: it stands upright


def test_a_boom_at_rest_floats_at_its_draft_and_upright() -> None:
    run = Run(Bench(threads=1), 10, "calm")
    for _ in range(100):
        run.body.advance(Bench(), 0.01, run.mooring())
    assert abs(run.body.position[2] - run.rest[2]) < 0.02
    assert abs(2.0 * math.asin(run.body.orientation[1])) < math.radians(5.0)
    oil = run.fluid.phase_positions("oil")[:, 0]
    assert (oil < run.body.position[0]).all()


def test_waves_have_the_period_of_their_length_over_the_depth() -> None:
    waves = waves_of(0.2, 6.0)
    assert waves is not None
    number = 2.0 * math.pi / 6.0
    assert (2.0 * math.pi / waves.period) ** 2 == pytest.approx(9.81 * number * np.tanh(number * FLUME.level), rel=1e-3)
    assert waves_of(0.0, 0.0) is None
