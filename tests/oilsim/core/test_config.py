"""Impossible descriptions are refused at construction, all problems at once."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim import FluidConfig, Phase, block, cylinder, sphere
from oilsim.backend.thread_team import Team
from oilsim.fluid.time_step import cfl_time_step, equal_steps


def test_every_problem_is_named():
    with pytest.raises(ValueError) as caught:
        FluidConfig(
            particle_spacing=-0.1, phases=(Phase(name="a", rest_density=1.0),) * 2, lower=(0, 0, 0), upper=(1, 0, 1), cfl=2.0,
            dimension=4, minimum_time_step=0.1, maximum_time_step=0.05,
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


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ({"divergence_iterations": 2.5}, r"divergence_iterations is 2\.5, allowed: a whole number, 1 or more"),
        ({"cfl": None}, "cfl is None, allowed: a number, 0.001 or more and at most 1"),
        ({"particle_spacing": "0.1"}, "particle_spacing is '0.1', allowed: a number, above 0 m"),
        ({"gravity": 9.81}, r"gravity is 9\.81, allowed: three finite numbers"),
        ({"periodic": (True,)}, r"periodic is \(True,\), allowed: True or False for each of x, y and z"),
        ({"periodic": "xyz"}, "periodic is 'xyz', allowed: True or False for each"),
        ({"explicit_viscosity": "no"}, "explicit_viscosity is 'no', allowed: True or False"),
        ({"phases": ("water",)}, r"phases is \('water',\), allowed: a tuple of Phase"),
    ],
)
def test_what_is_of_another_kind_is_refused_by_name(terms, message):
    water = Phase(name="water", rest_density=1000.0)
    known = {"particle_spacing": 0.1, "phases": (water,), "lower": (0, 0, 0), "upper": (1, 1, 1)}
    with pytest.raises(ValueError, match=message):
        FluidConfig(**(known | terms))


@pytest.mark.parametrize(
    ("key", "value"),
    [("rest_density", 0.0), ("rest_density", "1000"), ("dynamic_viscosity", -1.0), ("adhesion", math.nan)],
)
def test_impossible_liquid_is_refused(key, value):
    with pytest.raises(ValueError, match=f"phase 'oil': {key} is"):
        Phase(name="oil", **({"rest_density": 840.0} | {key: value}))


def test_explicit_viscosity_is_for_thin_liquids():
    # beyond nu dt / d^2 of a fifth noise grows from step to step: 1 m/s of shear in 1000 Pa s threw all particles out of the domain
    oil = Phase(name="oil", rest_density=900.0, dynamic_viscosity=36.0)
    terms = {"phases": (oil,), "lower": (0, 0, 0), "upper": (1, 1, 1), "explicit_viscosity": True}
    FluidConfig(particle_spacing=0.05, maximum_time_step=0.01, **terms)
    with pytest.raises(ValueError, match=r"viscous number .* of 0\.4, allowed: up to 0\.2, beyond which it swings"):
        FluidConfig(particle_spacing=0.05, maximum_time_step=0.025, **terms)


@pytest.mark.parametrize(
    ("spacing", "gravity", "longest"),
    [(0.05, 9.81, 0.01012), (0.2, 9.81, 0.02025), (0.05, 9.81 / 4, 0.02025), (0.05, 0.0, 0.01012)],
)
def test_longest_time_step_follows_the_shortest_wave(spacing, gravity, longest):
    """A fiftieth of sqrt(2 pi 8 d / g): with the square root of the spacing, and inversely with that of gravity."""
    terms = {
        "particle_spacing": spacing,
        "phases": (Phase(name="water", rest_density=1000.0),),
        "lower": (0, 0, 0),
        "upper": (1, 1, 1),
        "gravity": (0, 0, -gravity),
    }
    assert FluidConfig(**terms).longest_time_step == pytest.approx(longest, rel=1e-3)
    assert FluidConfig(**terms, maximum_time_step=0.003).longest_time_step == 0.003
    assert FluidConfig(**terms, minimum_time_step=0.1).longest_time_step == 0.1


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
