"""Steps go on over the ends of advances where nothing but the liquid takes part in them."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import BoundaryParticles, FluidError, PipeEmitter, block, tank_walls

SPACING = 0.1
SIDES = ("-x", "+x", "-y", "+y", "-z")


def falling_dam(make_fluid, **options):
    """Water that collapses in a tank, its first step made."""
    fluid = make_fluid(lower=(-0.3,) * 3, upper=(2.3,) * 3, maximum_time_step=0.03, **options)
    fluid.add_boundary(tank_walls((0, 0, 0), (2, 0.6, 2), SPACING, sides=SIDES))
    fluid.add_particles(block((0, 0, 0), (0.6, 0.6, 0.6), SPACING), phase="water")
    fluid.advance(1e-3)
    return fluid


def test_steps_do_not_depend_on_how_often_they_are_looked_at(make_fluid):
    whole, pieces = falling_dam(make_fluid), falling_dam(make_fluid)
    steps = whole.advance(0.1).sub_steps
    reports = [pieces.advance(0.1 / 13) for _ in range(13)]
    assert sum(report.sub_steps for report in reports) == steps < 13
    assert pieces.time == pytest.approx(whole.time)
    # the flight is summed up in more pieces, by some roundings of a metre each
    np.testing.assert_allclose(pieces.phase_positions("water"), whole.phase_positions("water"), atol=2e-5)
    assert whole.state.time_left == pytest.approx(pieces.state.time_left)


def test_liquid_is_seen_on_its_flight(make_fluid):
    fluid = falling_dam(make_fluid)
    fluid.advance(0.1)
    before, velocity = fluid.phase_positions("water"), fluid.phase_velocities("water")
    left = fluid.state.time_left
    assert left > 0.0
    report = fluid.advance(0.5 * left)
    assert report.sub_steps == 0
    assert report.time_step > 0.0 < report.iterations["divergence"]  # those of the step before
    np.testing.assert_array_equal(fluid.phase_velocities("water"), velocity)
    np.testing.assert_allclose(fluid.phase_positions("water"), before + 0.5 * left * velocity, atol=1e-6)
    assert fluid.advance(0.5 * left).sub_steps == 1


def test_landing_ends_a_step_where_it_is_and_nothing_else(make_fluid):
    fluid = falling_dam(make_fluid)
    fluid.advance(0.1)
    flown, time = fluid.state.step - fluid.state.time_left, fluid.time
    fluid.finish_step()
    assert (fluid.state.time_left, fluid.time) == (0.0, time)
    assert fluid.state.time_step == pytest.approx(flown)
    landed = fluid.phase_velocities("water")
    fluid.finish_step()
    np.testing.assert_array_equal(fluid.phase_velocities("water"), landed)


def test_flight_goes_on_after_a_restart_bit_for_bit(make_fluid):
    fluid, other = falling_dam(make_fluid), falling_dam(make_fluid)
    fluid.advance(0.1)
    saved = fluid.save_state()
    assert saved["state"]["time_left"] > 0.0
    other.restore_state(saved)
    for one in (fluid, other):
        one.advance(0.003)
        one.advance(0.1)
    np.testing.assert_array_equal(fluid.phase_positions("water"), other.phase_positions("water"))


def test_what_is_added_ends_a_flight_and_bodies_keep_steps_within_advances(make_fluid):
    fluid = falling_dam(make_fluid)
    fluid.advance(0.1)
    begun, flown = fluid.state.step, fluid.state.step - fluid.state.time_left
    assert 0.0 < flown < begun
    plate = np.stack(np.meshgrid(np.arange(4), np.arange(4), [0]), axis=-1).reshape(-1, 3) * 0.1
    handle = fluid.add_boundary(
        BoundaryParticles(name="plate", position=plate, volume=np.full(16, 1e-3), area=np.full(16, 1e-2))
    )
    position, landed = np.array([1.5, 0.1, 1.5]), flown
    for _ in range(5):
        fluid.set_boundary_motion(handle, position, (0, 0, 0, 1), (0.1, 0, 0), (0, 0, 0))
        assert (fluid.state.time_left, fluid.state.time_step) == (0.0, pytest.approx(flown))
        report = fluid.advance(0.013)
        position = position + 0.013 * np.array([0.1, 0.0, 0.0])
        assert report.sub_steps * report.time_step == pytest.approx(landed + 0.013)
        moved = fluid.boundary_positions(handle) - plate
        np.testing.assert_allclose(moved, np.broadcast_to(position, plate.shape), atol=1e-6)
        flown, landed = fluid.state.step, 0.0
    fluid.remove_boundary(handle)
    fluid.advance(0.1)
    assert fluid.state.time_left > 0.0
    fluid.add_particles(block((0.9, 0.2, 1.5), (1.2, 0.5, 1.8), SPACING), phase="water")
    assert fluid.state.time_left == 0.0


def test_paper_keeps_its_steps_within_advances(make_fluid):
    fluid = falling_dam(make_fluid, scheme="paper")
    for duration in (0.013, 0.0071):
        report = fluid.advance(duration)
        assert report.sub_steps * report.time_step == pytest.approx(duration)
        assert fluid.state.time_left == 0.0


@pytest.mark.parametrize("interrupted", [False, True])
def test_a_pipe_pours_as_much_where_steps_are_cut_short(make_fluid, interrupted):
    fluid = falling_dam(make_fluid)
    pipe = PipeEmitter(
        phase="water", mouth=(1.5, 0.3, 1.5), direction=(0, 0, -1), radius=0.1, speed=1.0, spacing=SPACING
    )
    fluid.add_emitter(pipe)
    layer, time = len(pipe.entrance) // 2, 0.5
    emitted = 0
    for _ in range(100):
        emitted += fluid.advance(time / 100).emitted.get("water", 0)
        if interrupted:
            fluid.finish_step()
    # a layer at once, and one more for every spacing that the jet has moved, to rounding
    assert emitted / layer == pytest.approx(1 + time * pipe.speed / SPACING, abs=1.0)


def test_what_landing_does_is_in_the_next_report(make_fluid):
    fluid = falling_dam(make_fluid)
    fluid.add_particles([(2.25, 0.3, 2.0)], phase="water", velocity=(10.0, 0.0, 0.0))
    fluid.advance(1e-3)
    while fluid.state.time_left < 0.008:
        report = fluid.advance(1e-3)
    assert report.removed == {}
    fluid.state.position[0, np.argmax(fluid.state.velocity[0])] = 2.4
    fluid.finish_step()
    assert report.removed == {}
    later = fluid.advance(1e-4)
    assert (later.removed, later.sub_steps) == ({"water": 1}, 1)


@pytest.mark.parametrize(("speed", "ends"), [(50.0, False), (400.0, True)])
def test_what_would_cross_a_wall_in_the_shortest_step_ends_the_run(make_fluid, speed, ends):
    """In the shortest step of 0.1 ms 50 m/s is half a spacing of 1 cm, and 400 m/s four."""
    fluid = make_fluid(particle_spacing=0.01, dimension=2, lower=(-0.2,) * 3, upper=(1.2,) * 3)
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 0, 1), 0.01, sides=("-x", "+x", "-z", "+z"), dimension=2))
    fluid.add_particles(block((0.3, 0, 0.4), (0.4, 0, 0.5), 0.01, 2), phase="water", velocity=(-speed, 0.0, 0.0))
    if ends:
        with pytest.raises(
            FluidError, match=r"moves at 400 m/s, 4 spacings in the shortest step of 0\.0001 s, allowed: 1\.75"
        ):
            fluid.advance(0.001)
    else:
        for _ in range(5):
            fluid.advance(0.001)
        assert fluid.particle_count == 100
        assert fluid.state.position[0].min() > 0.0


def dam_and_drop(make_fluid):
    """The dam in flight, and a drop, first in order, that leaves when it lands; the fluid, and the drop's id."""
    fluid = falling_dam(make_fluid)
    fluid.add_particles([(-0.25, 0.3, 2.0)], phase="water", velocity=(-1.0, 0.0, 0.0))
    fluid.advance(1e-3)
    while fluid.state.time_left < 0.008:
        fluid.advance(1e-3)
    drop = int(fluid.particles.id.max())
    assert fluid.particles.id[0] == drop
    fluid.state.position[0, 0] = -0.4
    return fluid, drop


def test_new_velocities_end_a_flight(make_fluid):
    """Otherwise the rest of the step would take water through a wall, at a speed for which the step was never meant."""
    fluid, drop = dam_and_drop(make_fluid)
    ids = fluid.particles.id
    given = np.tile([[-40.0], [0.0], [0.0]], ids.size) + 1e-2 * ids * [[0.0], [0.0], [1.0]]
    fluid.set_velocities(given)
    assert fluid.state.time_left == 0.0 and drop not in fluid.particles.id
    np.testing.assert_allclose(fluid.particles.velocity[2], 1e-2 * fluid.particles.id, rtol=1e-6)  # each its own
    fluid.advance(0.01)
    assert fluid.particles.position[0].min() > -0.5 * SPACING


def test_marks_of_particles_hold_though_one_leaves(make_fluid):
    fluid, drop = dam_and_drop(make_fluid)
    ids = fluid.particles.id
    fluid.remove_particles(ids % 2 == 0)
    assert set(fluid.particles.id.tolist()) == set(ids[ids % 2 == 1].tolist()) - {drop}
