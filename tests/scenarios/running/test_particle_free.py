"""Runs without particles: any exercise by formulas, bodies afloat, pulls of the right size, restart bit for bit, and bad input told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray

from coupling.testkit import assert_restarts_exactly
from recordings.export.chosen import oil_frames, oil_names
from recordings.export.netcdf import write_netcdf
from recordings.model.exercise import Site
from recordings.replay.recording import Replay
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.running.assembly import build
from scenarios.running.run import RunOptions, run_scenario
from scenarios.setup.cost import estimate
from scenarios.spec.load import load_scenario
from scenarios.text.problems import ScenarioError

BARE = 'fidelity="none"'


def run_bare(name: str, until: float, *changes: str):
    """Run a shipped scenario without particles until a time [s]; returns its assembly and its co-simulation."""
    assembly = build(load_scenario(name, overrides=[BARE, *changes]).scenario)
    simulation = assembly.co_simulation()
    simulation.initialize()
    simulation.run(until)
    return assembly, simulation


def test_exercise_made_for_particles_runs_without_them():
    """`u-sweep` in its current of 0.3 m/s, before the tow: all floats, and both ends together bear the drag of the boom's opening.

    Each has 0.94 rho/2 U^2 d w at a gap of a third, with the water that the U holds (`booms.held_water`); w = 0.32 L.
    """
    assembly, _ = run_bare("u-sweep", 6.0, "run.communication_step=0.02")
    world, level = assembly.world, 0.6
    layout = assembly.fleet.booms["main"]
    heights = [world.pose(segment.name)[2] + layout.segment.waterline - level for segment in layout.segments]
    pulls = [world.tension(joint) for joint in assembly.fleet.tensions_of("main").values()]
    counts = assembly.particle_counts()
    expected = 2.0 * 0.94 * 0.5 * 1027.0 * 0.3**2 * 0.25 * 0.32 * 6.0
    assert set(counts.values()) == {0}
    assert np.abs(heights).max() < 0.03
    assert sum(pulls) == pytest.approx(expected, rel=0.35)


def test_what_is_left_out_is_told_by_check_and_run():
    text = "without a tank, oil is a slick of parcels, and the sea is formulas, so fill.water is left out"
    scenario = load_scenario("u-sweep", overrides=[BARE]).scenario
    cost = estimate(scenario)
    assert text in cost.told
    assert sum(cost.particles.values()) == 0
    assert cost.boundary == {}


def test_restored_run_goes_on_bit_for_bit():
    scenario = load_scenario("u-sweep", overrides=[BARE, "run.communication_step=0.02"]).scenario
    assert_restarts_exactly(lambda: ScenarioRun(scenario), at=20, steps=20)


def test_ordered_wind_carries_the_slick_as_it_loads_the_bodies():
    """In `sweep-200m` the wind turns and grows: floating oil drifts with it at 2 to 4 % of its speed, beyond the current."""
    loaded = load_scenario("sweep-200m").scenario
    assembly = build(loaded)
    windy = replace(
        loaded, sea=replace(loaded.sea, waves=None, wind=replace(loaded.sea.wind, speed=20.0, direction=0.5 * np.pi))
    )
    assembly.controls.order(windy)
    velocity = assembly.slicks[0].flow.surface_velocity(np.zeros((1, 2)), 0.0)[0]
    current = loaded.sea.current.speed
    assert velocity[0] == pytest.approx(-current, abs=0.01)
    assert 0.4 < velocity[1] < 0.8


def test_description_tells_the_current_and_the_wind_of_the_sea():
    """A tide of 0.4 m/s and a wind of 8 m/s without its gusts; so in a tank."""
    tide = "sea.current={kind='tide', speed=0.4, direction=0.0, period=44712.0, turn=-11178.0}"
    exercise = build(load_scenario("sweep-200m", overrides=[tide, "run.seed=3"]).scenario).description.exercise
    wind = load_scenario("sweep-200m").scenario.sea.wind
    assert exercise.current == pytest.approx((0.4, 0.0), abs=1e-9)
    assert exercise.wind == pytest.approx((wind.speed * np.cos(wind.direction), wind.speed * np.sin(wind.direction)))
    blown = ["sea.wind={speed=5.0, direction=0.0}", BARE]
    for changes in (blown, blown[:1]):
        exercise = build(load_scenario("u-sweep", demo=True, overrides=changes).scenario).description.exercise
        assert exercise.wind == pytest.approx((5.0, 0.0))
        assert exercise.current == pytest.approx((-0.3, 0.0))


def test_ordered_current_carries_waves_on_from_where_they_are():
    """At the bodies of `sweep-200m`, ten minutes after the start: the surface stays where it is."""
    loaded = load_scenario("sweep-200m").scenario
    assembly = build(loaded)
    world = assembly.world
    world.time = 600.0
    places = world.poses(world.loaded_names)[:, :2]
    before = world.environment.sea
    sea = replace(loaded.sea, current=replace(loaded.sea.current, speed=loaded.sea.current.speed + 0.1))
    assembly.controls.order(replace(loaded, sea=sea))
    after = world.environment.sea
    assert after.elevation(places, 600.0) == pytest.approx(before.elevation(places, 600.0), abs=1e-9)


def test_body_that_sinks_is_refused_by_name():
    changes = [BARE, "bodies.rock.shape='box'", "bodies.rock.size=[0.2,0.2,0.2]", "bodies.rock.density=2600.0"]
    changes += ["bodies.rock.position=[1.0,1.0,0.5]", "bodies.rock.motion.kind='free'"]
    scenario = load_scenario("u-sweep", overrides=changes).scenario
    with pytest.raises(ScenarioError, match=r"bodies.rock.*bodies that float"):
        build(scenario)


def test_no_sea_can_be_had_without_water():
    changes = [BARE, "fill.water.phase='oil'"]
    with pytest.raises(ScenarioError, match=r"sea.depth is missing, allowed: a depth, or a tank with water"):
        build(load_scenario("u-sweep", overrides=changes).scenario)


def test_full_size_sweep_tows_at_its_speed_and_keeps_afloat():
    """`sweep-200m`: 66 segments ride the waves with their waterline at the surface; none sinks or flies."""
    assembly, _ = run_bare("sweep-200m", 6.0)
    layout = assembly.fleet.booms["main"]
    heights = [assembly.world.pose(segment.name)[2] + layout.segment.waterline for segment in layout.segments]
    assert len(heights) == 66
    assert np.abs(heights).max() < 0.5  # m: a crest of the sea, which is 0.5 m high


def test_each_oil_is_recorded_and_exported_as_what_it_is(tmp_path):
    """Maya crude leaks beside the slick of lighter oil: each has its own parcels in the recording, its density and volume in the export."""
    leak = "emitters.leak={phase='maya', mouth=[6.0, 2.5, 0.5], radius=0.1, speed=0.6366}"
    path = tmp_path / "two.rrd"
    changes = [BARE, "run.duration=1.0", "run.communication_step=0.1", "phases.maya={oil='maya'}", leak]
    run_scenario(load_scenario("u-sweep", overrides=changes).scenario, options=RunOptions(record=path))
    recorded = Replay(path)
    assert oil_names(recorded) == ["oil", "maya"]
    last = list(oil_frames(recorded))[-1]
    volumes = [float(last.volume[last.phase == number].sum()) for number in (0, 1)]
    assert volumes == pytest.approx([1.2 * 1.0 * 0.16, 0.02], rel=0.01)
    write_netcdf(recorded, tmp_path / "two.nc", Site(latitude=54.0, longitude=8.0))
    with xarray.open_dataset(tmp_path / "two.nc", decode_times=False) as data:
        mass = float(data.mass[-len(last.id) :].sum())
    densities = [phase.rest_density for phase in recorded.run.phases if phase.is_oil]
    assert densities[1] > densities[0] + 20.0
    assert mass == pytest.approx(1e3 * np.dot(volumes, densities), rel=1e-5)


def test_pipes_of_oil_become_parcels_also_by_order():
    """A leak of 20 l/s in the file, and one of 10 l/s ordered at 2 s: both pour what they should, and water pours nothing."""
    leak = "emitters.{}={{phase='{}', mouth=[6.0, 2.5, 0.5], radius=0.1, speed={}}}"
    speed = 0.02 / (np.pi * 0.1**2)
    scenario = load_scenario(
        "u-sweep", overrides=[BARE, "run.communication_step=0.1", leak.format("first", "oil", speed)]
    ).scenario
    assembly = build(scenario)
    simulation = assembly.co_simulation()
    simulation.initialize()
    slick = assembly.slicks[0].slick
    begun = slick.oil.spilled
    simulation.run(2.0)
    assert slick.oil.spilled - begun == pytest.approx(0.04, abs=0.021)
    ordered = load_scenario(
        "u-sweep",
        overrides=[
            BARE,
            "run.communication_step=0.1",
            leak.format("first", "oil", speed),
            leak.format("next", "oil", 0.5 * speed),
        ],
    ).scenario
    assembly.controls.order(ordered)
    simulation.run(4.0)
    assert slick.oil.spilled - begun == pytest.approx(0.08 + 0.02, abs=0.031)
    wet = load_scenario(
        "u-sweep", overrides=[BARE, leak.format("first", "oil", speed), leak.format("wet", "water", 0.1)]
    ).scenario
    with pytest.raises(ScenarioError, match=r"emitters\.wet"):
        assembly.controls.order(wet)
