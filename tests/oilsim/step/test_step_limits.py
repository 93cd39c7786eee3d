"""What limits a step beside the speed of the water: turning bodies, bodies about to come in, pressed water; and who must not."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import BoundaryParticles, Phase, block, solid_box, tank_walls
from oilsim.neighborhood.cell_grid import make_grid

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
PLANE = {"dimension": 2, "lower": (-0.7, -1.0, -0.7), "upper": (0.7, 1.0, 0.7), "particle_spacing": 0.02}


def test_the_tips_of_a_turning_paddle_go_no_further_than_liquid_may(make_fluid):
    # 12 rad/s at 0.4 m: 4.8 m/s, of which a step of 10 ms would be 2.4 spacings
    fluid = make_fluid(**PLANE)
    fluid.add_boundary(tank_walls((-0.6, 0, -0.6), (0.6, 0, 0.7), 0.02, sides=("-x", "+x", "-z"), dimension=2))
    points = block((-0.6, 0, -0.6), (0.6, 0, 0.5), 0.02, 2)
    fluid.add_particles(points[(np.abs(points[:, 0]) > 0.4) | (np.abs(points[:, 2]) > 0.02)], phase="water")
    paddle = fluid.add_boundary(solid_box((0.8, 0.0, 0.04), 0.02, dimension=2))
    fluid.set_boundary_motion(paddle, (0, 0, 0), UPRIGHT, (0, 0, 0), (0, 12.0, 0))
    report = fluid.advance(0.01)
    assert report.time_step * 4.8 <= 1.75 * 0.02


@pytest.mark.parametrize(("x", "cut"), [(2.4, True), (20.0, False)])
def test_a_fast_body_outside_the_domain_counts_before_it_comes_in(make_fluid, x, cut):
    """What is far off meets nothing in the step."""
    fluid = make_fluid()
    fluid.add_particles(block((0.2, 0.2, 0.2), (1.8, 1.8, 0.4), 0.1), phase="water")
    bullet = fluid.add_boundary(solid_box((0.2, 0.2, 0.2), 0.1))
    fluid.set_boundary_motion(bullet, (x, 1.0, 0.3), UPRIGHT, (-60.0, 0, 0), (0, 0, 0))
    assert (fluid.advance(0.01).time_step * 60.0 <= 1.75 * 0.1) == cut


def test_particles_that_are_added_do_not_lift_the_limit_of_pressed_water(make_fluid):
    """A drop beside a deep tank in every advance: the water inside lies still all the same."""
    layers, width, d = 48, 16, 0.02
    fluid = make_fluid(
        dimension=2, particle_spacing=d, lower=(-0.1, -1.0, -0.1), upper=(width * d + 1.1, 1.0, layers * d + 0.4)
    )
    walls = tank_walls((0, 0, 0), (width * d, 0, layers * d + 0.3), d, sides=("-x", "+x", "-z"), dimension=2)
    fluid.add_boundary(walls)
    fluid.add_particles(block((0, 0, 0), (width * d, 0, layers * d), d, 2), phase="water")
    fluid.advance(0.5)
    for k in range(100):
        fluid.add_particles([(width * d + 0.5 + 0.002 * k, 0, -0.09)], phase="water")  # falls out of the domain
        fluid.advance(0.01)
    inside = fluid.state.position[0] < width * d + 0.1
    rms = float(np.sqrt((fluid.state.velocity[:, inside] ** 2).sum(axis=0).mean()))
    assert rms < 0.002 * np.sqrt(9.81 * layers * d)


def test_a_particle_that_leaves_asleep_puts_no_other_to_sleep(make_fluid):
    """One drifts out of the domain in the step in which its region falls asleep; drops that fall elsewhere fall on."""
    fluid = make_fluid(dimension=2, particle_spacing=0.05, lower=(0, -1, -0.2), upper=(4, 1, 30), sleep_speed=0.1)
    fluid.add_boundary(tank_walls((-0.5, 0, 0), (4.5, 0, 1), 0.05, sides=("-z",), dimension=2))
    fluid.add_particles([(3.9642, 0, 0.0125)], phase="water", velocity=(0.05, 0, 0))
    fluid.add_particles([(1.0 + 0.2 * k, 0, 20.0) for k in range(5)], phase="water")
    for _ in range(90):
        fluid.advance(0.01)
        heights = fluid.phase_positions("water")[-5:, 2]
        assert heights.max() - heights.min() < 1e-3
    assert fluid.particle_count == 5 and fluid.state.asleep == 0


def test_wall_points_without_volume_leave_viscosity_to_others(make_fluid):
    speeds = []
    for marked in (False, True):
        fluid = make_fluid(phases=(Phase(name="water", rest_density=1e3, dynamic_viscosity=1e3),))
        sides = ("-x", "+x", "-y", "+y", "-z")
        fluid.add_boundary(tank_walls((0, 0, 0), (2, 1, 1), 0.1, sides=sides, no_slip=True))
        if marked:
            mark = np.array([[1.0, 0.5, 0.2]])
            fluid.add_boundary(BoundaryParticles(name="mark", position=mark, volume=np.zeros(1), area=np.zeros(1)))
        points = block((0, 0, 0), (2, 1, 0.4), 0.1)
        shear = np.stack([points[:, 2], 0 * points[:, 0], 0 * points[:, 0]], axis=1)
        fluid.add_particles(points, phase="water", velocity=shear)
        assert fluid.advance(0.05).iterations["viscosity"] > 0
        speeds.append(fluid.energy().kinetic)
    assert abs(speeds[1] - speeds[0]) < 0.1 * speeds[0]


def test_a_liquid_that_is_not_there_costs_no_viscous_solve(make_fluid):
    water = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1e-3)
    tar = Phase(name="tar", rest_density=900.0, dynamic_viscosity=1e4)
    states = []
    for phases in ((water,), (water, tar)):
        fluid = make_fluid(phases=phases)
        fluid.add_particles(block((0.2, 0.2, 0.2), (1.0, 1.0, 0.6), 0.1), phase="water")
        assert fluid.advance(0.05).iterations["viscosity"] == 0
        states.append(fluid.phase_positions("water"))
    np.testing.assert_array_equal(*states)


def test_an_axis_that_repeats_has_three_cells_at_least():
    """At exactly the least length allowed rounding would leave two, and a neighbour would be found on both sides."""
    for spacing in (0.017, 0.034, 0.045, 0.1):
        support = 2.75 * spacing
        grid = make_grid((0, -1, 0), (3.0 * support, 1, 20 * spacing), (True, False, False), support, 2)
        assert grid.cells[0] == 3


def test_landing_what_has_hardly_begun_changes_nothing(make_fluid):
    fluid = make_fluid()
    fluid.add_particles(block((0.2, 0.2, 0.2), (1.0, 1.0, 0.6), 0.1), phase="water")
    fluid.advance(0.05)
    fluid.advance(1e-19)
    fluid.finish_step()
    fluid.advance(0.01)
    assert np.isfinite(fluid.state.velocity).all()
