"""The numbers that the error-time benchmark draws from a run, on runs whose answer is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.benchmarks.pareto.measures import (
    Sample,
    decay_rate,
    fit_pressure,
    front_position,
    pareto_front,
    read_front,
    rms_speed,
    shifted_rms,
    surface_level,
)
from tests.benchmarks.pareto.results import Family, variants
from tests.benchmarks.pareto.scenes import SCENES


def test_front_keeps_what_nothing_beats():
    points = [(1.0, 9.0), (2.0, 3.0), (3.0, 5.0), (4.0, 1.0), (4.0, 2.0), (5.0, 1.0), (0.1, math.nan), (math.inf, 0.0)]
    assert pareto_front(points) == [(1.0, 9.0), (2.0, 3.0), (4.0, 1.0)]
    assert pareto_front([]) == []


def test_one_time_shift_is_taken_out():
    reference_time, reference_front = read_front(6.0)
    time = np.linspace(0.0, 6.0, 601)
    late = np.interp(time - 0.4, reference_time, reference_front)
    error, shift = shifted_rms(time, late, reference_time, reference_front)
    assert shift == pytest.approx(0.4, abs=0.006)
    assert error < 0.002


def test_front_too_far_by_a_share_is_that_far_off():
    # z = 1.05 z_ref at equal times: no shift of a curve can undo a stretch of a constant one
    time = np.linspace(0.0, 4.0, 401)
    error, _ = shifted_rms(time, np.full(401, 2.1), np.array([1.0, 2.0]), np.array([2.0, 2.0]))
    assert error == pytest.approx(0.05)


def test_run_that_ends_early_has_no_front_error():
    error, _ = shifted_rms(np.array([0.0, 0.1]), np.array([1.0, 1.0]), np.array([4.0]), np.array([5.0]))
    assert error == math.inf


def test_spray_is_not_the_front():
    position = np.zeros((12, 3))
    position[:, 0] = [*np.arange(11) * 0.1 + 0.05, 2.0]
    assert front_position(position, 0.1) == pytest.approx(1.1)


def test_decay_of_an_exponential():
    time = np.linspace(0.0, 2.0, 50)
    assert decay_rate(time, 3.0 * np.exp(-0.7 * time)) == pytest.approx(0.7)
    assert math.isnan(decay_rate(time, time - 1.0))


def test_rms_speed_counts_the_last_second():
    def sample(time: float, speed: float) -> Sample:
        return Sample(time=time, position=np.zeros((4, 3)), velocity=np.full((4, 3), speed / math.sqrt(3.0)))

    assert rms_speed([sample(0.5, 9.0), sample(1.8, 2.0), sample(2.0, 2.0)]) == pytest.approx(2.0)


def test_level_of_a_lattice_is_half_a_spacing_above_its_last_layer():
    position = SCENES["box"]().particles(0.1)
    assert surface_level(position[np.abs(position[:, 0]) > 0.25], 0.1) == pytest.approx(0.4)


def test_pressure_fit_is_exact_for_a_linear_pressure():
    position = np.random.default_rng(0).uniform(0.0, 1.0, (400, 3)) * (1.0, 0.0, 1.0)
    pressure = 9810.0 * (1.0 - position[:, 2])
    assert fit_pressure(position, pressure, np.array([[0.5, 0.0, 0.1]]), 0.2)[0] == pytest.approx(9810.0 * 0.9)


def test_families_vary_the_spacing_or_stay_at_the_reference():
    scene = SCENES["column"]()
    families = (
        Family(name="spacing", settings=({},), spacings="every"),
        Family(name="knob", settings=({"a": 1}, {"a": 2})),
    )
    runs = variants("solver", families, scene, quick=False)
    assert [run.spacing for run in runs] == [*scene.spacings, scene.reference, scene.reference]
    assert runs[-1].label == "d 0.05 m, a 2"
    assert len(variants("solver", families, scene, quick=True)) == 3
