"""Impossible descriptions are refused at construction, all problems at once."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.config import FluidConfig
from oilsim.initial_conditions import block, cylinder, sphere
from oilsim.parallel import Team
from oilsim.phases import Phase
from oilsim.time_step import cfl_time_step, equal_steps


def test_every_problem_is_named():
    with pytest.raises(ValueError) as caught:
        FluidConfig(
            particle_spacing=-0.1, phases=(Phase(name="a", rest_density=1.0),) * 2, lower=(0, 0, 0), upper=(1, 0, 1), cfl=2.0,
            dimension=4, minimum_time_step=0.1,
        )  # fmt: skip
    message = str(caught.value)
    for part in ("particle_spacing is -0.1, allowed: above 0 m", "cfl is 2.0", "dimension is 4", "share a name", "upper.y is 0 m",
                 "minimum_time_step is 0.1 s"):  # fmt: skip
        assert part in message


def test_gravity_lies_in_the_plane_of_two_dimensions():
    with pytest.raises(ValueError, match=r"gravity\.y is 1\.0 m/s2, allowed: 0 in two dimensions"):
        FluidConfig(
            particle_spacing=0.1, phases=(Phase(name="a", rest_density=1.0),), lower=(0, -1, 0), upper=(1, 1, 1), dimension=2,
            gravity=(0.0, 1.0, -9.81),
        )  # fmt: skip


@pytest.mark.parametrize(("key", "value"), [("rest_density", 0.0), ("dynamic_viscosity", -1.0), ("adhesion", math.nan)])
def test_impossible_liquid_is_refused(key, value):
    with pytest.raises(ValueError, match=f"phase 'oil': {key} is"):
        Phase(name="oil", **({"rest_density": 840.0} | {key: value}))


def test_time_step_follows_equation_30_and_31():
    assert cfl_time_step(0.03, 2.0, 0.4, 1e-4, 1e-2) == pytest.approx(0.4 * 0.03 / 2.0)
    assert cfl_time_step(0.03, 0.0, 0.4, 1e-4, 1e-2) == 1e-2
    assert cfl_time_step(0.03, 1e6, 0.4, 1e-4, 1e-2) == 1e-4
    assert equal_steps(0.01, 0.004) == pytest.approx(0.01 / 3)
    assert equal_steps(0.01, 0.01) == 0.01


def test_blocks_hold_their_volume():
    assert len(block((0, 0, 0), (1.0, 0.5, 0.3), 0.1)) == 150
    assert len(block((0, 0, 0), (1.0, 0.5, 0.3), 0.1, dimension=2)) == 30
    ball = sphere((1.0, 2.0, 3.0), 0.5, 0.05)
    # a lattice inside a ball: the error is of the order of the surface layer over the volume, over the root of its size
    assert len(ball) * 0.05**3 == pytest.approx(4 / 3 * math.pi * 0.5**3, rel=0.03)
    rod = cylinder((0, 0, 0), (1, 1, 0), 0.3, 1.0, 0.05)
    along = rod @ np.array([1, 1, 0]) / math.sqrt(2)
    assert along.min() > 0.0
    assert along.max() < 1.0
    assert len(rod) * 0.05**3 == pytest.approx(math.pi * 0.3**2, rel=0.03)


def test_thin_block_is_refused():
    with pytest.raises(ValueError, match="along y, allowed: half the particle spacing"):
        block((0, 0, 0), (1, 0.01, 1), 0.1)


def test_error_in_a_thread_reaches_the_caller():
    def kernel(begin: int, end: int) -> None:
        if begin > 0:
            raise ValueError("second half")

    with pytest.raises(ValueError, match="second half"):
        Team(2).run(kernel, 10_000)
