"""What a fluid refuses, by name and before anything is computed."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import BoundaryParticles, FluidConfig, Phase, PipeEmitter, solid_box

NAN = float("nan")
POSE = {"position": (1, 1, 1), "orientation": (0, 0, 0, 1), "linear_velocity": (0, 0, 0), "angular_velocity": (0, 0, 0)}


def pipe(**options):
    terms = {"mouth": (1, 1, 1), "direction": (1, 0, 0), "radius": 0.1, "speed": 0.5, "spacing": 0.1}
    return PipeEmitter(phase="water", **(terms | options))


@pytest.mark.parametrize(
    ("position", "velocity", "message"),
    [
        (np.ones((3, 5)), (0, 0, 0), r"position of particles of phase 'water' has shape \(3, 5\), allowed: \(N, 3\)"),
        ([(1, 1, NAN)], (0, 0, 0), r"position .* has nan at \(0, 2\), allowed: finite"),
        ([(1, 1, 1)], 5.0, r"velocity .* has shape \(\), allowed: \(3\)"),
        ([(1, 1, 1)], (0, np.inf, 0), r"velocity .* has inf at \(1,\)"),
        ([(1, 1, 1)], np.zeros((2, 3)), r"velocity .* has shape \(2, 3\), allowed: \(1, 3\)"),
        (
            [(1, 1, 9)],
            (0, 0, 0),
            r"1 particles of phase 'water' lie outside the domain, the first at \[1.0, 1.0, 9.0\] m",
        ),
    ],
)
def test_impossible_particles_are_refused(make_fluid, position, velocity, message):
    fluid = make_fluid()
    with pytest.raises(ValueError, match=message):
        fluid.add_particles(position, phase="water", velocity=velocity)
    assert fluid.particle_count == 0


def test_particles_have_places_of_their_own(make_fluid):
    fluid, points = make_fluid(), np.array([[0.1, 0.1, 0.1], [0.2, 0.1, 0.1], [0.2, 0.1, 0.2]])
    fluid.add_particles(points, phase="water")
    message = r"2 particles of phase 'water' lie where others do, the first at \[0.2.*, 0.1.*, 0.1.*\] m, allowed: places of their own"
    with pytest.raises(ValueError, match=message):
        fluid.add_particles(points[1:], phase="water")
    with pytest.raises(ValueError, match=r"1 particles of phase 'water' lie where others do"):
        fluid.add_particles(np.full((2, 3), 0.3), phase="water")
    fluid.add_particles(points + 1e-4, phase="water")
    assert fluid.particle_count == 6
    with pytest.raises(
        ValueError, match=r"1 particles of phase 'water' lie where others do"
    ):  # across a seam, at one place
        make_fluid(periodic=(True, False, False)).add_particles([(0, 1, 1), (2, 1, 1)], phase="water")


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        ({"position": (1, 1, NAN)}, r"position of boundary 0 has nan at \(2,\), allowed: finite numbers"),
        ({"orientation": (0, 0, 0, 0)}, "orientation of boundary 0 is 0, allowed: a quaternion"),
        ({"linear_velocity": (1, 0)}, r"twist of boundary 0 has shape \(5,\), allowed: \(6\)"),
        ({"inverse_mass": np.eye(3)}, r"inverse_mass of boundary 0 has shape \(3, 3\), allowed: \(6, 6\)"),
        ({"inverse_mass": -np.eye(6)}, "inverse_mass of boundary 0 has -1.0 on its diagonal, allowed: 0 or more"),
        ({"inverse_mass": np.tri(6)}, "inverse_mass of boundary 0 differs from its transpose by 1.0, allowed: 0"),
    ],
)
def test_impossible_motions_are_refused(make_fluid, motion, message):
    fluid = make_fluid()
    handle = fluid.add_boundary(
        BoundaryParticles(name="dot", position=np.zeros((1, 3)), volume=np.ones(1), area=np.ones(1))
    )
    with pytest.raises(ValueError, match=message):
        fluid.set_boundary_motion(handle, **(POSE | motion))
    with pytest.raises(ValueError, match=r"boundary 7 does not exist, allowed: \[0\]"):
        fluid.set_boundary_motion(7, **POSE)
    for ask in (fluid.boundary_positions, fluid.remove_boundary):
        with pytest.raises(ValueError, match=r"boundary 7 does not exist, allowed: \[0\]"):
            ask(7)
    fluid.advance(0.01)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ({"gravity": (0, 0, NAN)}, "gravity is .* allowed: three finite numbers"),
        ({"upper": (np.inf, 2, 2)}, "upper is .* allowed: three finite numbers"),
        ({"gravity": (0, -9.81)}, r"gravity is \(0, -9.81\), allowed: three finite numbers"),
        ({"lower": (-2e4, 0, 0)}, "reach 20000.0 m from the origin, allowed: 16777 particle spacings"),
    ],
)
def test_impossible_domains_are_refused(terms, message):
    settings = {
        "particle_spacing": 0.1,
        "phases": (Phase(name="water", rest_density=1e3),),
        "lower": (0, 0, 0),
        "upper": (2, 2, 2),
    }
    with pytest.raises(ValueError, match=message):
        FluidConfig(**(settings | terms))


def test_a_plane_may_be_as_thick_as_it_likes():
    water = Phase(name="water", rest_density=1e3)
    corners = {"lower": (0.0, -1.0, 0.0), "upper": (1e-3, 1.0, 1e-3)}
    FluidConfig(particle_spacing=3e-5, phases=(water,), dimension=2, **corners)
    with pytest.raises(ValueError, match=r"reach 1.0 m from the origin"):
        FluidConfig(particle_spacing=3e-5, phases=(water,), **corners)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"spacing": 0.05}, r"pipe: spacing is 0.05 m, allowed: the fluid's, 0.1 m"),
        ({"mouth": (0.1, 1, 1)}, "lie outside the domain"),
        ({"volume": 0.5e-3}, r"pipe: volume is less than half a particle, allowed: above 0\.0005 m3"),
    ],
)
def test_pipes_that_cannot_pour_here_are_refused(make_fluid, options, message):
    with pytest.raises(ValueError, match=message):
        make_fluid().add_emitter(pipe(**options))


@pytest.mark.parametrize("terms", [{"speed": np.inf}, {"volume": -1.0}, {"start": NAN}, {"mouth": (0, 0, NAN)}])
def test_pipes_that_are_none_are_refused(terms):
    with pytest.raises(ValueError, match=rf"pipe: {next(iter(terms))} is .*, allowed: "):
        pipe(**terms)


def test_surfaces_have_handles_of_their_own(make_fluid):
    fluid, dot = make_fluid(), {"position": np.zeros((1, 3)), "volume": np.ones(1), "area": np.ones(1)}
    first = BoundaryParticles(name="first", **dot)
    handle = fluid.add_boundary(first)
    with pytest.raises(ValueError, match=f"boundary {handle} exists already, allowed: a handle that none has"):
        fluid.add_boundary(BoundaryParticles(name="second", **dot), handle)
    assert fluid.boundaries[handle] is first


def test_bodies_answer_together_as_matter_does(make_fluid):
    fluid, dot = make_fluid(), {"position": np.zeros((1, 3)), "volume": np.ones(1), "area": np.ones(1)}
    handle = fluid.add_boundary(BoundaryParticles(name="dot", **dot))
    fluid.set_boundary_motion(handle, **POSE)
    with pytest.raises(
        ValueError, match=r"inverse mass of boundaries \[0\] differs from its transpose by 1.0, allowed: 0"
    ):
        fluid.set_joint_inverse_mass([handle], np.tri(6))


def test_nothing_leaves_the_plane(make_fluid):
    fluid = make_fluid(dimension=2, lower=(0, -1, 0), upper=(2, 1, 2))
    fluid.add_particles([(1, 0, 1)], phase="water")
    with pytest.raises(ValueError, match="a pipe pours a round jet, allowed: none in two dimensions"):
        fluid.add_emitter(pipe())
    with pytest.raises(ValueError, match="velocity along y is other than 0, allowed: 0 in two dimensions"):
        fluid.set_velocities([[0.0], [0.1], [0.0]])
    with pytest.raises(ValueError, match=r"boundary 'box' has points at up to 0.2.* m from y = 0, allowed: 0"):
        fluid.add_boundary(solid_box((0.5, 0.5, 0.5), 0.1, name="box"))
    handle = fluid.add_boundary(solid_box((0.5, 0.0, 0.5), 0.1, dimension=2))
    for twist in (
        {"linear_velocity": (0, 0.1, 0)},
        {"angular_velocity": (0.1, 0, 0)},
        {"angular_velocity": (0, 0, 0.1)},
    ):
        with pytest.raises(ValueError, match=r"twist of boundary 0 leads out of the plane by 0\.1 m/s"):
            fluid.set_boundary_motion(handle, **(POSE | twist))
    fluid.set_boundary_motion(handle, **(POSE | {"linear_velocity": (1, 1e-12, 1), "angular_velocity": (0, 1, 1e-12)}))


def test_states_of_another_fluid_are_refused(make_fluid):
    fluid, other, walled = make_fluid(), make_fluid(sleep_speed=0.01), make_fluid()
    walled.add_boundary(BoundaryParticles(name="dot", position=np.zeros((1, 3)), volume=np.ones(1), area=np.ones(1)))
    mercury = make_fluid(phases=(Phase(name="mercury", rest_density=13500.0),))
    other.add_emitter(pipe())
    for state, message in (
        (walled.save_state(), r"saved state has boundaries \{'0': 1\}, allowed: \{\}, as this fluid"),
        (
            make_fluid(particle_spacing=0.2).save_state(),
            "saved state has particle_spacing 0.2, allowed: 0.1, as this fluid",
        ),
        (mercury.save_state(), r"saved state has phases \[\['mercury', 13500.0\]\], allowed: \[\['water', 1000.0\]\]"),
        (other.save_state(), "differ in whether regions may sleep"),
    ):
        with pytest.raises(ValueError, match=message):
            fluid.restore_state(state)
    fluid.add_emitter(pipe())
    with pytest.raises(ValueError, match="saved state has 0 emitters, allowed: 1"):
        fluid.restore_state(make_fluid().save_state())


def test_a_state_from_before_a_body_moved_brings_it_back_to_rest(make_fluid):
    fluid = make_fluid()
    handle = fluid.add_boundary(
        BoundaryParticles(name="dot", position=np.ones((1, 3)), volume=np.ones(1), area=np.ones(1))
    )
    fluid.advance(0.01)
    before = fluid.save_state()
    fluid.set_boundary_motion(handle, **(POSE | {"linear_velocity": (1, 0, 0)}))
    fluid.advance(0.01)
    fluid.restore_state(before)
    fluid.advance(0.01)
    np.testing.assert_array_equal(fluid.boundary_positions(handle), np.ones((1, 3)))
