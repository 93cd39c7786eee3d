"""Wind, waves, current, pipe and adhesion against their formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim import BoundaryParticles, Phase, PipeEmitter, block, tank_walls
from oilsim.forcing import AiryWaves, Current, Wind, Zone, wave_number
from oilsim.step.schemes import attract
from tests.oilsim.conftest import cache, search

EVERYWHERE = Zone((-10.0,) * 3, (10.0,) * 3, 0.5)


@pytest.mark.parametrize(
    ("period", "length"), [(0.8, 0.9956), (1.0, 1.5130), (1.2, 2.0483), (1.5, 2.8265), (2.0, 4.0564)]
)
def test_wave_length_follows_the_dispersion_relation(period, length):
    # depth 0.5 m, omega^2 = g k tanh(k h) solved to all digits
    assert 2 * math.pi / wave_number(period, 0.5) == pytest.approx(length, rel=2e-4)


def test_orbital_velocity_is_free_of_divergence_and_matches_the_surface():
    waves = AiryWaves(height=0.1, period=1.2, direction=0.0, bottom=0.0, level=0.5, zone=EVERYWHERE)
    x, y, z, step, time = 0.3, 0.0, 0.3, 1e-4, 5.0
    along = [waves.velocity(np.array([x + s]), np.array([y]), np.array([z]), time)[0][0] for s in (-step, step)]
    up = [waves.velocity(np.array([x]), np.array([y]), np.array([z + s]), time)[1][0] for s in (-step, step)]
    divergence = (along[1] - along[0] + up[1] - up[0]) / (2 * step)
    assert abs(divergence) < 1e-6
    # at the still level the vertical speed's amplitude is that of the surface, a omega
    times = np.linspace(5.0, 6.2, 200)
    heave = [waves.velocity(np.array([0.0]), np.array([0.0]), np.array([0.5]), t)[1][0] for t in times]
    assert max(heave) == pytest.approx(0.05 * 2 * math.pi / 1.2, rel=1e-3)


def test_a_current_carries_the_waves(make_fluid):
    # from water that moves with the current a wave is what it is in still water, whatever the current was before
    sea = {"height": 0.1, "period": 1.2, "direction": 0.5, "bottom": 0.0, "level": 0.5, "zone": EVERYWHERE}
    still, carried = AiryWaves(**sea), AiryWaves(**sea, drift=(0.3, -0.2))
    fluid = make_fluid(gravity=(0.0, 0.0, 0.0))
    fluid.add_particles([(1.0, 1.0, 1.0)], phase="water")
    fluid.add_forcing(carried)
    for _ in range(10):
        fluid.advance(0.01)
    state = fluid.save_state()
    carried.drift = (0.1, 0.0)
    for _ in range(20):
        fluid.advance(0.01)
    x, y, z = (np.array([place]) for place in (0.3, 0.4, 0.3))
    way = 0.1 * np.array([0.3, -0.2]) + 0.2 * np.array([0.1, 0.0])
    seen = carried.velocity(x + way[0], y + way[1], z, fluid.time)
    assert np.ravel(seen) == pytest.approx(np.ravel(still.velocity(x, y, z, fluid.time)))
    fluid.restore_state(state)
    seen = carried.velocity(x + 0.03, y - 0.02, z, fluid.time)
    assert np.ravel(seen) == pytest.approx(np.ravel(still.velocity(x, y, z, fluid.time)))


def test_current_is_reached_with_its_time_constant(make_fluid):
    fluid = make_fluid(gravity=(0, 0, 0))
    fluid.add_particles(block((0.5, 0.5, 0.5), (0.8, 0.8, 0.8), 0.1), phase="water")
    fluid.add_forcing(Current((0.2, -0.1, 0.0), EVERYWHERE))
    for _ in range(50):
        fluid.advance(0.01)
    expected = np.array([0.2, -0.1, 0.0]) * (1 - math.exp(-0.5 / 0.5))
    assert fluid.phase_velocities("water").mean(axis=0) == pytest.approx(expected, abs=1e-4)


def test_a_current_beside_waves_leaves_their_orbital_motion_alone(make_fluid):
    """In the waves' zone water moves as waves alone would have it, which carry the current; elsewhere it is the current's."""
    half = Zone((0.0, -1.0, -1.0), (1.0, 4.0, 4.0), 0.5)
    waves = AiryWaves(height=0.1, period=1.2, direction=0.5, bottom=0.0, level=1.0, zone=half, drift=(0.2, -0.1))
    found = []
    for forcings in ([waves], [Current((0.2, -0.1, 0.0), EVERYWHERE, beside=half), waves]):
        fluid = make_fluid(gravity=(0.0, 0.0, 0.0))
        fluid.add_particles([(0.5, 0.5, 0.8), (1.5, 0.5, 0.8)], phase="water")
        waves.restore({"height": 0.1, "drift": (0.2, -0.1), "carried": (0.0, 0.0)})
        for forcing in forcings:
            fluid.add_forcing(forcing)
        for _ in range(50):
            fluid.advance(0.01)
        found.append(fluid.phase_velocities("water"))
    np.testing.assert_array_equal(found[1][0], found[0][0])
    assert found[0][1] == pytest.approx(0.0)
    assert found[1][1] == pytest.approx(np.array([0.2, -0.1, 0.0]) * (1 - math.exp(-1.0)), abs=1e-4)


@pytest.mark.parametrize("spacing", [0.1, 0.05])
def test_wind_force_is_stress_times_area(make_fluid, spacing):
    fluid = make_fluid(particle_spacing=spacing, lower=(0, 0, -0.3), upper=(1, 1, 1), periodic=(True, True, False))
    walls = tank_walls((0, 0, 0), (1, 1, 1), spacing, sides=("-z",), periodic=(True, True, False))
    fluid.add_boundary(walls)
    fluid.add_particles(block((0, 0, 0), (1, 1, 0.4), spacing), phase="water")
    wind = Wind(speed=10.0, direction=math.pi, spacing=spacing, seed=1)
    fluid.add_forcing(wind)
    fluid.advance(0.001)
    force = fluid.momentum()[0] / 0.001
    # on a lattice the slopes of the two top layers add up to 1.07 of the jump within the water
    assert force == pytest.approx(-1.225 * 1.3e-3 * 10.0**2 * 1.0, rel=0.12)


@pytest.mark.parametrize("kind", ["waves", "wind"])
@pytest.mark.parametrize("direction", [0.0, math.pi, -math.pi])
def test_what_runs_along_x_stays_in_the_plane(make_fluid, kind, direction):
    # sin(pi) is 1.2e-16
    fluid = make_fluid(dimension=2, lower=(0, -1, 0), upper=(2, 1, 2))
    fluid.add_particles(block((0, 0, 0), (2, 0, 1), 0.1, 2), phase="water")
    waves = AiryWaves(height=0.1, period=1.0, direction=direction, bottom=0.0, level=1.0, zone=EVERYWHERE)
    fluid.add_forcing(
        {"waves": waves, "wind": Wind(speed=5.0, direction=direction, spacing=0.1, seed=1)}[kind],
    )
    fluid.advance(0.02)
    assert not fluid.state.velocity[1].any()
    if kind == "wind":
        assert np.sign(fluid.momentum()[0]) == round(math.cos(direction))


def test_gusts_are_seeded_and_have_their_standard_deviation(make_fluid):
    series = []
    for _ in range(2):
        fluid = make_fluid()
        fluid.add_particles([(1.0, 1.0, 1.0)], phase="water")
        wind = Wind(speed=10.0, direction=0.0, spacing=0.1, seed=7, gustiness=0.2, gust_time=0.05)
        fluid.forcings.append(wind)
        gusts = []
        for _ in range(400):
            _at_rest(fluid)
            fluid._drive(0.05)
            gusts.append(wind.gust)
        series.append(gusts)
    assert series[0] == series[1]
    # 400 values, correlation exp(-1): about 200 independent ones, 5 % of the deviation each way, three times that
    assert np.std(series[0]) == pytest.approx(0.2, rel=0.15)


def _at_rest(fluid):
    search(fluid)
    cache(fluid)
    return fluid.state


def test_pipe_pours_its_volume(make_fluid):
    fluid = make_fluid(particle_spacing=0.05, gravity=(0, 0, 0))
    pipe = PipeEmitter(
        phase="water", mouth=(0.5, 1, 1), direction=(1, 0, 0), radius=0.1, speed=0.5, spacing=0.05, volume=0.02
    )
    fluid.add_emitter(pipe)
    emitted = [fluid.advance(0.05).emitted.get("water", 0) for _ in range(40)]
    layer = len(block((-0.1, -0.1, 0), (0.1, 0.1, 0.05), 0.05)) - 4  # the corners lie outside the circle
    # a layer a spacing travelled: 0.5 m/s for 0.5 s are 5 layers
    assert sum(emitted[:10]) == pytest.approx(5 * layer, abs=layer)
    assert sum(emitted) == round(0.02 / 0.05**3)
    assert fluid.phase_velocities("water")[:, 0].mean() == pytest.approx(0.5, rel=0.02)


def test_waves_without_gravity_are_refused():
    with pytest.raises(ValueError, match=r"waves: gravity is 0\.0, allowed: above 0 m/s2"):
        AiryWaves(height=0.1, period=1.0, direction=0.0, bottom=0.0, level=1.0, zone=EVERYWHERE, gravity=0.0)


def test_impossible_pipe_is_refused():
    with pytest.raises(
        ValueError, match=r"pipe: radius is 0\.01 m, allowed: 0\.05 m or more, half the particle spacing"
    ):
        PipeEmitter(phase="oil", mouth=(0, 0, 0), direction=(0, 0, 1), radius=0.01, speed=1.0, spacing=0.1)


def adhesive_fluid(make_fluid, work_of_adhesion):
    oil = Phase(name="oil", rest_density=900.0, adhesion=work_of_adhesion)
    return make_fluid(
        phases=(oil,),
        particle_spacing=0.1,
        lower=(0, 0, -0.5),
        upper=(1, 1, 2),
        periodic=(True, True, False),
        gravity=(0, 0, 0),
    )


def test_tearing_oil_off_a_plane_costs_the_work_of_adhesion(make_fluid):
    lift = np.linspace(0.0, 0.2, 41)
    forces = []
    for height in lift:
        fluid = adhesive_fluid(make_fluid, 0.07)
        fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1), 0.1, sides=("-z",), periodic=(True, True, False)))
        fluid.add_particles(block((0, 0, height), (1, 1, 0.5 + height), 0.1), phase="oil")
        search(fluid)
        attract(fluid.context, fluid.clock, fluid.arrays, fluid.state, 1.0)
        forces.append(-fluid.momentum()[2])
    # one layer of lattice within reach stands for the integral: midpoint rule over three layers, 15 %
    assert np.trapezoid(forces, lift) == pytest.approx(0.07 * 1.0, rel=0.15)


def test_adhesion_pulls_the_body_as_it_pulls_the_oil(make_fluid):
    fluid = adhesive_fluid(make_fluid, 0.07)
    points = block((-0.2, -0.2, -0.05), (0.2, 0.2, 0.05), 0.1)
    handle = fluid.add_boundary(
        BoundaryParticles(
            name="plate", position=points, volume=np.full(len(points), 4e-4), area=np.full(len(points), 0.01)
        )
    )
    inverse_mass = np.diag([0.5] * 3 + [2.0] * 3)
    fluid.set_boundary_motion(handle, (0.5, 0.5, 0.72), (0, 0, 0, 1), (0, 0, 0), (0, 0, 0), inverse_mass)
    fluid.add_particles(block((0.2, 0.2, 0.4), (0.8, 0.8, 0.6), 0.1), phase="oil")
    search(fluid)
    attract(fluid.context, fluid.clock, fluid.arrays, fluid.state, 0.01)
    body = fluid.context.walls.moving[handle]
    assert body.impulse[2] < -1e-5
    assert body.impulse[:3] == pytest.approx(-fluid.momentum(), rel=1e-4, abs=1e-9)


def test_a_zone_with_an_edge_rises_smoothly_from_its_sides():
    graded, sharp = Zone((0, -1, 0), (4, 9, 1), 0.5, edge=1.0), Zone((0, -1, 0), (4, 9, 1), 0.5)
    position = np.zeros((3, 5), np.float32)
    position[0], position[1] = (0.0, 0.5, 1.0, 2.0, 4.0), 4.0
    share = graded.share(0.1, position)
    assert share == pytest.approx([0.0, 1.0 - np.exp(-0.1 / 0.5 * 0.5), *[float(sharp.share(0.1, position))] * 2, 0.0])
    with pytest.raises(ValueError, match="edge"):
        Zone((0, 0, 0), (1, 1, 1), 0.5, edge=-1.0)


def test_waves_that_run_keep_their_length():
    waves = AiryWaves(height=0.1, period=1.2, direction=0.0, bottom=0.0, level=0.5, zone=EVERYWHERE)
    for name in ("period", "direction", "bottom", "level"):
        with pytest.raises(
            ValueError, match=rf"waves: {name} stays .* while they run, allowed to change: height, drift"
        ):
            setattr(waves, name, 0.3)
    waves.height = 0.2
    assert (waves.height, waves.period) == (0.2, 1.2)
