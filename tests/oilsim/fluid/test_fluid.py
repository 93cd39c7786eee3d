"""The whole step: flight, conservation, determinism, restart, clear refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from oilsim import FluidError, Phase, PipeEmitter, block, solid_box, tank_walls
from oilsim.sea import KaimalGusts, SeaForcing, WindDrift
from oilsim.stages.pressure import minority_phases
from tests.seas import shallow_sea

OILY = (
    Phase(name="water", rest_density=1000.0),
    Phase(name="oil", rest_density=800.0, dynamic_viscosity=5.0, adhesion=0.05),
)


def small_tank(make_fluid, threads=1, **options):
    fluid = make_fluid(threads=threads, phases=OILY, lower=(-0.3,) * 3, upper=(2.3, 2.3, 2.3), **options)
    fluid.add_boundary(tank_walls((0, 0, 0), (1.5, 1.5, 1.5), 0.1, no_slip=True))
    fluid.add_particles(disturb(block((0, 0, 0), (1.5, 1.5, 0.6), 0.1)), phase="water")
    fluid.add_particles(block((0.4, 0.4, 0.7), (1.0, 1.0, 1.1), 0.1), phase="oil")
    fluid.add_emitter(
        PipeEmitter(phase="oil", mouth=(0.2, 0.2, 1.2), direction=(0, 0, -1), radius=0.1, speed=0.5, spacing=0.1)
    )
    fluid.add_forcing(
        SeaForcing(
            shallow_sea(0.6, wind=(7.6, 2.4), gusts=KaimalGusts(intensity=0.3, seed=5), drift=WindDrift()), spacing=0.1
        )
    )
    return fluid


def disturb(points):
    return points + np.random.default_rng(0).uniform(-0.005, 0.005, points.shape)


@pytest.mark.parametrize("scheme", ["split", "paper"])
def test_isolated_particle_flies_a_parabola(make_fluid, scheme):
    fluid = make_fluid(scheme=scheme)
    start, velocity = np.array([0.2, 1.0, 1.0]), np.array([1.0, 0.2, 2.0])
    fluid.add_particles(start[None], phase="water", velocity=velocity)
    steps, step = 80, 0.005
    longest = max(fluid.advance(step).time_step for _ in range(steps))
    time = steps * step
    exact = start + velocity * time + 0.5 * np.array([0, 0, -9.81]) * time**2
    # symplectic Euler is off by g dt t / 2, whichever of drift and kick comes first
    assert fluid.phase_positions("water")[0] == pytest.approx(exact, abs=0.5 * 9.81 * longest * time + 1e-5)
    late = 9.81 * longest if scheme == "split" else 0.0  # of a step that goes on, velocities are those of its beginning
    assert fluid.phase_velocities("water")[0] == pytest.approx(
        velocity + np.array([0, 0, -9.81]) * time, abs=late + 1e-4
    )


def test_stiff_oil_does_not_press_water_through_the_floor_in_the_papers_scheme(make_fluid):
    """Oil stiffened as in the paper (gamma = 1e4) falls onto shallow water: every particle stays in the tank.

    Without the walls' stop in Alg. 2 and in the flight 5 % leave within two seconds.
    """
    stiff = Phase(name="oil", rest_density=840.0, dynamic_viscosity=0.1)
    fluid = make_fluid(
        scheme="paper", viscosity_correction=1e4, particle_spacing=0.05, maximum_time_step=0.04,
        phases=(Phase(name="water", rest_density=1027.0, dynamic_viscosity=1.05e-3), stiff), lower=(-0.4,) * 3, upper=(1.2, 1.2, 2.0),
    )  # fmt: skip
    fluid.add_boundary(tank_walls((0, 0, 0), (0.8, 0.6, 1.6), 0.05))
    fluid.add_particles(block((0.025,) * 3, (0.775, 0.575, 0.3), 0.05), phase="water")
    fluid.add_particles(block((0.2, 0.15, 0.4), (0.6, 0.45, 0.9), 0.05), phase="oil")
    count = fluid.particles.position.shape[1]
    for _ in range(60):
        fluid.advance(1.0 / 30.0)
    lowest = fluid.particles.position.min()
    assert fluid.particles.position.shape[1] == count
    assert lowest > -0.01, f"a particle stands {-lowest / 0.05:.2f} spacings outside"


@pytest.mark.parametrize("scheme", ["split", "paper"])
def test_momentum_in_free_space_is_constant(make_fluid, scheme):
    fluid = make_fluid(scheme=scheme, gravity=(0.0, 0.0, 0.0), phases=OILY)
    points = disturb(block((0.5, 0.5, 0.5), (1.5, 1.5, 1.5), 0.095))
    speeds = np.cross(points - 1.0, (0.3, 0.2, 1.0))
    half = points[:, 2] < 1.0
    fluid.add_particles(points[half], phase="water", velocity=speeds[half])
    fluid.add_particles(points[~half], phase="oil", velocity=speeds[~half])
    before = fluid.momentum()
    for _ in range(5):
        fluid.advance(0.005)
    scale = np.abs(fluid.state.velocity).sum() * 1000 * 1e-3
    assert np.abs(fluid.momentum() - before).max() < 1e-6 * scale


def test_threads_do_not_change_a_bit(make_fluid):
    states = []
    for threads in (1, 2):
        fluid = small_tank(make_fluid, threads, particle_spacing=0.1)
        for _ in range(6):
            fluid.advance(0.01)
        assert fluid.particle_count > 1400
        states.append(fluid.save_state()["state"])
    for name in ("position", "velocity", "pressure_impulse", "id", "phase"):
        assert np.array_equal(states[0][name], states[1][name]), name


@pytest.mark.parametrize("scheme", ["split", "paper"])
def test_restored_state_continues_bit_for_bit(make_fluid, scheme):
    fluid = small_tank(make_fluid, scheme=scheme)
    for _ in range(3):
        fluid.advance(0.01)
    saved = fluid.save_state()
    runs = []
    for _ in range(2):
        fluid.restore_state(saved)
        for _ in range(4):
            fluid.advance(0.01)
        runs.append(fluid.save_state())
    assert runs[0]["time"] == runs[1]["time"]
    for name in ("position", "velocity", "pressure_impulse", "id"):
        assert np.array_equal(runs[0]["state"][name], runs[1]["state"][name]), name


def test_closed_tank_loses_no_particle_in_a_splash(make_fluid):
    fluid = make_fluid(lower=(-0.3,) * 3, upper=(1.3, 1.3, 1.8))
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1.5), 0.1))
    fluid.add_particles(block((0, 0, 0), (0.4, 1, 1), 0.1), phase="water")
    removed = [fluid.advance(0.02).removed for _ in range(60)]
    assert not any(removed)
    position = fluid.state.position
    assert (position.min(axis=1) > -0.05).all()
    assert (position.max(axis=1) < np.array([1.05, 1.05, 1.55])).all()


def test_open_side_counts_what_leaves(make_fluid):
    fluid = make_fluid(gravity=(0.0, 0.0, 0.0))
    fluid.add_particles(block((1.6, 0.5, 0.5), (1.9, 0.8, 0.8), 0.1), phase="water", velocity=(1.0, 0.0, 0.0))
    removed = sum(fluid.advance(0.05).removed.get("water", 0) for _ in range(12))
    assert removed == 27
    assert fluid.particle_count == 0


def test_still_column_has_hydrostatic_pressure(make_fluid):
    fluid = make_fluid(
        particle_spacing=0.05, dimension=2, lower=(-0.2,) * 3, upper=(1.2, 1.2, 1.2), divergence_tolerance=1e-4
    )
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 0, 1), 0.05, sides=("-x", "+x", "-z"), dimension=2))
    fluid.add_particles(block((0, 0, 0), (1, 0, 0.5), 0.05, 2), phase="water")
    readings = []
    for step in range(100):
        fluid.advance(0.01)
        if step >= 50:
            readings.append(fluid.pressure_at([(0.5, 0.0, 0.1)])[0])
    # one spacing of depth is 12 % here; particles settle within a quarter of it
    assert np.mean(readings) == pytest.approx(1000 * 9.81 * 0.4, rel=0.05)
    assert fluid.surface_height_at([(0.5, 0.0)])[0] == pytest.approx(0.5, abs=0.025)


def test_oil_rises_through_water(make_fluid):
    fluid = make_fluid(phases=OILY, dimension=2, particle_spacing=0.05, lower=(-0.2,) * 3, upper=(1.2, 1.2, 1.4))
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 0, 1.2), 0.05, sides=("-x", "+x", "-z"), dimension=2))
    points = block((0, 0, 0), (1, 0, 0.6), 0.05, 2)
    ball = np.hypot(points[:, 0] - 0.5, points[:, 2] - 0.2) < 0.12
    fluid.add_particles(points[~ball], phase="water")
    fluid.add_particles(points[ball], phase="oil")
    before = fluid.phase_positions("oil")[:, 2].mean()
    for _ in range(60):
        fluid.advance(0.01)
    # chaotic: changes at round-off level of the start move the rise between 0.045 and 0.060 m
    assert fluid.phase_positions("oil")[:, 2].mean() > before + 0.03


def test_particle_outside_the_domain_is_refused(make_fluid):
    with pytest.raises(
        ValueError, match=r"1 particles of phase 'water' lie outside the domain, the first at \[5\.0, 0\.0, 0\.0\] m"
    ):
        make_fluid().add_particles([(5.0, 0.0, 0.0)], phase="water")


def test_what_would_leave_the_plane_is_refused(make_fluid):
    fluid = make_fluid(dimension=2)
    with pytest.raises(ValueError, match="have y other than 0, allowed: 0 in two dimensions"):
        fluid.add_particles([(1.0, 0.5, 1.0)], phase="water")
    with pytest.raises(ValueError, match="have velocity along y other than 0"):
        fluid.add_particles([(1.0, 0.0, 1.0)], phase="water", velocity=(1.0, 0.1, 0.0))


def test_bodies_that_have_left_the_domain_shorten_no_step(make_fluid):
    fluid = make_fluid(maximum_time_step=0.05, periodic=(True, False, False))
    fluid.add_particles(block((0.5, 0.5, 0.2), (1.5, 1.5, 0.6), 0.1), phase="water")
    handle = fluid.add_boundary(solid_box((0.3, 0.3, 0.3), 0.1))
    taken = {}
    for place in (
        (1.0, 1.0, -40.0),
        (1.0, 1.0, 2.1),
        (9.0, 1.0, 1.8),
    ):  # far below; half out; in a repetition of the domain
        fluid.set_boundary_motion(handle, place, (0, 0, 0, 1), (0, 0, -30.0), (0, 0, 0))
        taken[place[2]] = fluid.advance(0.01).sub_steps
    assert taken == {-40.0: 1, 2.1: 2, 1.8: 2}


def test_unknown_phase_is_refused(make_fluid):
    with pytest.raises(ValueError, match="phase 'tar' does not exist, allowed: water"):
        make_fluid().add_particles([(1.0, 1.0, 1.0)], phase="tar")


def test_blow_up_names_the_particle_and_the_time(make_fluid):
    fluid = make_fluid()
    fluid.add_particles([(1.0, 1.0, 1.0)], phase="water")
    fluid.state.velocity[0, 0] = np.nan
    with pytest.raises(FluidError, match=r"not finite at t = 0\.01 s, the first has id 0 in phase 'water'"):
        fluid.advance(0.01)


def test_each_liquid_but_the_most_meets_the_tolerance_by_itself(make_fluid, monkeypatch):
    fluid = small_tank(make_fluid, divergence_iterations=1000)
    solver, left = fluid.context.solver, []
    solve = solver.solve

    def look(system, pressures, tolerance, *others):
        result = solve(system, pressures, tolerance, *others)
        left.extend(
            solver._left(oil) / tolerance
            for oil in minority_phases(fluid.context, fluid.arrays.neighbors, fluid.state.phase)
        )
        return result

    monkeypatch.setattr(solver, "solve", look)
    for _ in range(10):
        fluid.advance(0.01)
    assert len(left) > 5 and max(left) < 1.01
    (group,) = minority_phases(fluid.context, fluid.arrays.neighbors, fluid.state.phase)
    places, oil = fluid.state.position.T, fluid.state.phase == 1
    reach = cKDTree(places[oil]).query(places)[0] / fluid.config.particle_spacing
    assert set(group) >= set(np.flatnonzero(reach < 2.7)) and reach[group].max() < 2.75 + 0.5
