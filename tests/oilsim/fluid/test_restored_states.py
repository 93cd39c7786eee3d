"""A restored fluid goes on as the one that was saved, whatever it had been doing: ties, pipes, and what it has not told yet."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import PipeEmitter, block, solid_box

UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def with_two_boxes(make_fluid):
    """Two boxes side by side, just above water; the fluid and their handles."""
    fluid = make_fluid()
    fluid.add_particles(block((0.5, 0.5, 0.2), (1.5, 1.5, 0.5), 0.1), phase="water")
    return fluid, [fluid.add_boundary(solid_box((0.3, 0.3, 0.3), 0.1, name=name)) for name in ("one", "other")]


def move(fluid, handle, x, **terms):
    fluid.set_boundary_motion(
        handle, (x, 1.0, 0.63), UPRIGHT, (0.0, 0.0, -0.5), (0.0, 0.0, 0.0), inverse_mass=np.eye(6), **terms
    )


def test_what_ties_bodies_is_part_of_the_state(make_fluid):
    """Two boxes that can only move alike."""
    (fluid, handles), (other, _) = with_two_boxes(make_fluid), with_two_boxes(make_fluid)
    for handle, x in zip(handles, (0.8, 1.2), strict=True):
        move(fluid, handle, x)
    fluid.set_joint_inverse_mass(handles, np.tile(0.5 * np.eye(6), (2, 2)))
    other.restore_state(fluid.save_state())
    twists = []
    for one in (fluid, other):
        one.advance(0.05)
        twists.append([one.boundary_twist(handle) for handle in handles])
    assert np.abs(twists[0]).max() > 0.1
    np.testing.assert_array_equal(twists[0], twists[1])


def test_ties_are_of_the_bodies_that_are_named_and_do_not_change_with_the_callers_array(make_fluid):
    twists = []
    for order in ((0, 1), (1, 0)):
        fluid, handles = with_two_boxes(make_fluid)
        for handle, x in zip(handles, (0.8, 1.2), strict=True):
            move(fluid, handle, x)
        tied = np.kron(np.diag([(1.0, 0.1)[n] for n in order]), np.eye(6))
        fluid.set_joint_inverse_mass([handles[n] for n in order], tied)
        tied[:] = 0.0
        fluid.advance(0.05)
        twists.append([fluid.boundary_twist(handle) for handle in handles])
    np.testing.assert_array_equal(*twists)
    assert np.abs(twists[0][0] - twists[0][1]).max() > 0.05


def test_bodies_move_on_in_the_order_in_which_they_did(make_fluid):
    """The order of wall particles is that of sums over them."""
    (fluid, handles), (other, _) = with_two_boxes(make_fluid), with_two_boxes(make_fluid)
    for one, order in ((fluid, (1, 0)), (other, (0, 1))):
        for n in order:
            move(one, handles[n], (0.8, 1.2)[n])
    other.restore_state(fluid.save_state())
    for one in (fluid, other):
        one.advance(0.1)
    np.testing.assert_array_equal(fluid.phase_positions("water"), other.phase_positions("water"))


def test_a_pipe_has_its_speed_again(make_fluid):
    fluid = make_fluid()
    pipe = PipeEmitter(phase="water", mouth=(1, 1, 1), direction=(0, 0, -1), radius=0.1, speed=1.0, spacing=0.1)
    fluid.add_emitter(pipe)
    state = fluid.save_state()
    pipe.speed = 0.0
    fluid.restore_state(state)
    assert pipe.speed == 1.0


def test_what_has_not_been_told_is_told_after_a_restore(make_fluid):
    """A particle that flies out, landed before its advance ends, belongs to the next report."""
    fluid, other = make_fluid(maximum_time_step=0.05), make_fluid(maximum_time_step=0.05)
    fluid.add_particles([(1.0, 1.0, 0.5), (1.2, 1.0, 0.5)], phase="water")
    fluid.advance(0.05)
    fluid.advance(1e-3)
    fluid.state.position[0, 1], fluid.state.velocity[0, 1] = 1.999, 5.0
    fluid.advance(2e-3)
    fluid.finish_step()
    other.restore_state(fluid.save_state())
    told, again = fluid.advance(0.02), other.advance(0.02)
    assert told.removed == again.removed == {"water": 1}
    assert told.sub_steps == again.sub_steps


@pytest.mark.parametrize(
    ("handles", "matrix", "message"),
    [
        (
            [0, 1],
            np.full((12, 12), np.nan),
            r"inverse mass of boundaries \[0, 1\] has nan at \(0, 0\), allowed: finite numbers",
        ),
        ([0, 0], np.eye(12), r"for boundaries \[0, 0\], allowed: \(6 n, 6 n\) for all that move, \[0, 1\]"),
        ([0, 1], -np.eye(12), r"inverse mass of boundaries \[0, 1\] has -1.0 on its diagonal, allowed: 0 or more"),
    ],
)
def test_ties_that_cannot_be_are_refused(make_fluid, handles, matrix, message):
    fluid, own = with_two_boxes(make_fluid)
    for handle, x in zip(own, (0.8, 1.2), strict=True):
        move(fluid, handle, x)
    with pytest.raises(ValueError, match=message):
        fluid.set_joint_inverse_mass(handles, matrix)


def test_an_inverse_mass_is_symmetric(make_fluid):
    fluid, handles = with_two_boxes(make_fluid)
    skew = np.eye(6)
    skew[0, 1] = 5.0
    with pytest.raises(ValueError, match=r"inverse_mass of boundary 0 differs from its transpose by 5.0, allowed: 0"):
        fluid.set_boundary_motion(handles[0], (1, 1, 1), UPRIGHT, (0, 0, 0), (0, 0, 0), inverse_mass=skew)


def test_liquid_that_flies_through_an_immense_domain_goes_on_as_it_did(make_fluid):
    """Of 3e12 cells only those around the liquid are counted, others in the fluid that is restored than in the one that was saved."""

    def drops():
        fluid = make_fluid(lower=(-1500.0,) * 3, upper=(1500.0,) * 3)
        for x, speed in ((0.0, 20.0), (3.0, -20.0)):
            fluid.add_particles(
                block((x, 0.0, 0.0), (x + 0.5, 0.5, 0.5), 0.1), phase="water", velocity=(speed, 0.0, 5.0)
            )
        return fluid

    fluid, other = drops(), drops()
    fluid.advance(0.3)
    other.restore_state(fluid.save_state())
    for one in (fluid, other):
        one.advance(0.3)
    np.testing.assert_array_equal(fluid.phase_positions("water"), other.phase_positions("water"))
