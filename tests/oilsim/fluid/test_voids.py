"""What parts a little in liquid that fills its box does not make it another liquid; a free surface, however small, is one."""

from __future__ import annotations

import numpy as np

from oilsim import Fluid, FluidConfig, block, tank_walls
from oilsim.core.state import Confinement
from oilsim.stages.relaxation import VOIDS
from tests.oilsim.conftest import WATER, disturbed

SPACING, ROW, STEP = 0.05, 130, 0.01
SIDE = ROW * SPACING
TIGHT = 0.997  # of the room that its particles ask for: boxes seldom are whole numbers of spacings


def stirred_box() -> Fluid:
    """Weightless water that fills a plane box, with a vortex in the middle, after six steps."""
    room = 4.0 * SPACING
    fluid = Fluid(
        FluidConfig(
            particle_spacing=SPACING, phases=(WATER,), dimension=2, gravity=(0.0, 0.0, 0.0),
            lower=(-room, -1.0, -room), upper=(SIDE + room, 1.0, SIDE + room), maximum_time_step=0.01,
        )
    )  # fmt: skip
    upper = (TIGHT * SIDE, 0.0, TIGHT * SIDE)
    fluid.add_boundary(tank_walls((0, 0, 0), upper, SPACING, sides=("-x", "+x", "-z", "+z"), dimension=2))
    points = disturbed(TIGHT * block((0, 0, 0), (SIDE, 0.0, SIDE), SPACING, 2), 0.1 * SPACING, 0) * (1, 0, 1)
    fluid.add_particles(points, phase="water")
    x, _, z = fluid.state.position - 0.5 * SIDE
    swirl = 4.0 * np.exp(-(x**2 + z**2) / 0.3**2)
    fluid.state.velocity[0], fluid.state.velocity[2] = -swirl * z, swirl * x
    for _ in range(6):
        fluid.advance(STEP)
    assert fluid.state.confinement == Confinement.FILLED
    return fluid


def take_out(fluid: Fluid, count: int) -> None:
    """Particles in the middle of the box."""
    x, _, z = fluid.state.position - 0.5 * SIDE
    leaving = np.zeros(fluid.state.count, dtype=bool)
    leaving[np.argsort(x**2 + z**2)[:count]] = True
    fluid.state.remove(leaving, fluid.context.team)


def energy(fluid: Fluid) -> float:
    """Of motion, over half a particle's mass [m2/s2]."""
    return float((fluid.state.velocity.astype(np.float64) ** 2).sum())


def test_a_void_of_a_few_particles_is_no_blow() -> None:
    # pressure sets itself by it, and density stays that of the box: held to its own the water is pushed apart, and has half as much
    # energy again in three steps
    fluid = stirred_box()
    take_out(fluid, 3)
    before, parted = energy(fluid), 0
    for _ in range(20):
        report = fluid.advance(STEP)
        assert fluid.state.confinement != Confinement.OPEN
        assert report.iterations["density"] <= 2.0
        assert energy(fluid) < 1.02 * before
        if fluid.state.confinement != Confinement.FILLED:
            parted += 1
            assert fluid.state.pressure_impulse.min() >= 0.0
    assert parted


def test_what_is_more_than_disorder_is_a_free_surface() -> None:
    fluid = stirred_box()
    take_out(fluid, round(2 * VOIDS * fluid.particle_count))
    fluid.advance(STEP)
    assert fluid.state.confinement != Confinement.FILLED
    assert fluid.state.confinement == Confinement.OPEN


def test_a_surface_that_was_there_from_the_start_is_no_void_however_small() -> None:
    deep, wide, room = 900, 9, 4.0 * SPACING
    upper = (wide * SPACING, 0.0, deep * SPACING)
    fluid = Fluid(
        FluidConfig(
            particle_spacing=SPACING, phases=(WATER,), dimension=2, lower=(0.0, -1.0, -room),
            upper=(wide * SPACING, 1.0, upper[2] + 1.0), periodic=(True, False, False),
        )
    )  # fmt: skip
    floor = tank_walls((0, 0, 0), upper, SPACING, sides=("-z",), periodic=(True, False, False), dimension=2)
    fluid.add_boundary(floor)
    fluid.add_particles(block((0, 0, 0), upper, SPACING, 2), phase="water")
    fluid.advance(STEP)
    beside = int(np.count_nonzero(fluid.arrays.sums.surface))
    assert 0 < beside < VOIDS * fluid.particle_count
    assert fluid.state.confinement == Confinement.OPEN


def test_steps_with_a_void_repeat_after_a_restore() -> None:
    fluid = stirred_box()
    take_out(fluid, 3)
    fluid.advance(STEP)
    assert fluid.state.confinement != Confinement.OPEN
    assert fluid.state.confinement != Confinement.FILLED
    saved, found = fluid.save_state(), []
    for _ in range(2):
        for _ in range(3):
            fluid.advance(STEP)
        found.append(fluid.state.velocity.copy())
        fluid.restore_state(saved)
    np.testing.assert_array_equal(*found)
