"""Runs from end to end, small and short: what they leave behind, and how they end. The recorded runs have every shipped scenario."""

from __future__ import annotations

import json
import math
import signal
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from coupling.master.errors import CoSimulationError
from coupling.participants.fluid import FluidParticipant
from recordings.model.frame import Frame
from recordings.replay.recording import Replay
from recordings.replay.repair import damage_of
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.running.assembly import Assembly, build
from scenarios.running.run import RunOptions, recording_grid, run_scenario, thinning
from scenarios.running.summary import SummaryObserver
from scenarios.schema.bodies import BoxBody, Fixed
from scenarios.schema.liquid import FluidSettings, PhaseSettings, SlabFill, Tank
from scenarios.schema.run_settings import BodyProbe, PressureProbe, VelocityProbe, WaveGauge
from scenarios.setup.layout import lay_out
from scenarios.spec.load import load_scenario, scenario_from
from scenarios.spec.resolve import resolve
from scenarios.spec.scenario import RunSettings, Scenario
from scenarios.text.problems import ScenarioError
from tests.poison import Poison
from tests.scenarios.kills import started_run

SPACINGS = {"dam-break": 0.1, "floating-box": 0.1, "rock-coating": 0.03, "two-layer": 0.1, "u-sweep": 0.125}


def small(name: str, *overrides: str, steps: int = 3) -> Scenario:
    """A shipped scenario with few particles that ends after some steps of 5 ms."""
    settings = [
        f"fluid.particle_spacing={SPACINGS[name]}",
        "run.communication_step=0.005",
        f"run.duration={0.005 * steps}",
    ]
    return load_scenario(name, overrides=[*settings, "run.threads=1", *overrides]).scenario


def run_steps(scenario: Scenario) -> tuple[Assembly, Frame, SummaryObserver]:
    """Run to the end; the parts, the last frame with its particles, and the summary's observer."""
    with ScenarioRun(scenario) as run:
        summary = SummaryObserver(run.assembly)
        run.watch(summary)
        run.run()
        return run.assembly, run.last_frame(), summary


@pytest.mark.parametrize("kind", ["speed=3.0 wind", "speed=0.2 current", "height=0.05 period=1.0 waves"])
def test_weather_along_minus_x_runs_in_a_plane(kind: str) -> None:
    *terms, table = kind.split()
    overrides = [f"sea.{table}.{term}" for term in (*terms, "direction_deg=180.0")]
    assert run_steps(small("dam-break", *overrides))[1].index == 3


def test_u_sweep_has_vessels_and_a_jointed_boom() -> None:
    """20 segments or more, joined one to the next, towed at both ends; the account of the oil is in the frame."""
    assembly, frame, summary = run_steps(small("u-sweep"))
    segments = [name for name in assembly.body_names if name.startswith("boom/main/segment")]
    assert len(segments) >= 20
    assert assembly.world is not None
    assert len(assembly.world.joint_names) == len(segments) - 1 + 4
    scalars = frame.scalars
    assert {"metrics/oil_inside", "metrics/oil_outside", "metrics/tow_tension/port"} <= set(scalars)
    oil = len(frame.phases["oil"].position) * 0.125**3
    assert scalars["metrics/oil_inside"] + scalars["metrics/oil_outside"] == pytest.approx(oil)
    assert set(summary.summary(0.015)["scores"]["main"]["tow_tension_n"]) == {"port", "starboard"}


def test_python_api_and_file_give_the_same_run() -> None:
    """The same scenario said in Python and in a file: equal objects, and the same particles to the last bit."""
    said = Scenario(
        name="twice",
        run=RunSettings(duration=0.02, communication_step=0.01, threads=1),
        fluid=FluidSettings(particle_spacing=0.1),
        phases={"water": PhaseSettings(density=1000.0, dynamic_viscosity=1e-3), "oil": PhaseSettings(oil="brent")},
        tank=Tank(lower=(0.0, 0.0, 0.0), upper=(0.8, 0.8, 0.8), open=("+z",)),
        fill={
            "water": SlabFill(phase="water", bottom=0.0, top=0.3),
            "oil": SlabFill(phase="oil", bottom=0.3, top=0.5, velocity=(0.1, 0.0, 0.0)),
        },
        bodies={
            "box": BoxBody(
                size=(0.2, 0.2, 0.2), position=(0.4, 0.4, 0.6), density=300.0, rotation=(0.0, 0.0, math.pi / 4)
            )
        },
        probes={"box": BodyProbe(body="box")},
    )
    written = scenario_from(
        {
            "name": "twice",
            "run": {"duration": 0.02, "communication_step": 0.01, "threads": 1},
            "fluid": {"particle_spacing": 0.1},
            "phases": {"water": {"density": 1000, "dynamic_viscosity": 1e-3}, "oil": {"oil": "brent"}},
            "tank": {"lower": [0, 0, 0], "upper": [0.8, 0.8, 0.8], "open": ["+z"]},
            "fill": {
                "water": {"shape": "slab", "phase": "water", "bottom": 0, "top": 0.3},
                "oil": {"shape": "slab", "phase": "oil", "bottom": 0.3, "top": 0.5, "velocity": [0.1, 0, 0]},
            },
            "bodies": {
                "box": {
                    "shape": "box",
                    "size": [0.2, 0.2, 0.2],
                    "position": [0.4, 0.4, 0.6],
                    "density": 300,
                    "rotation_deg": [0, 0, 45],
                }
            },
            "probes": {"box": {"kind": "body", "body": "box"}},
        }
    )
    assert written == said
    frames = [run_steps(scenario)[1] for scenario in (said, written)]
    for phase in ("water", "oil"):
        np.testing.assert_array_equal(frames[0].phases[phase].position, frames[1].phases[phase].position)
    np.testing.assert_array_equal(frames[0].bodies["box"].position, frames[1].bodies["box"].position)


def test_probes_read_what_they_are_told_to() -> None:
    """Still water 0.5 m deep: surface within half a spacing, uniform initial velocity, a held body stays in its place."""
    scenario = Scenario(
        name="probes",
        run=RunSettings(duration=0.002, communication_step=0.002, threads=1),
        fluid=FluidSettings(particle_spacing=0.1),
        phases={"water": PhaseSettings(density=1000.0, dynamic_viscosity=1e-3)},
        tank=Tank(lower=(0.0, 0.0, 0.0), upper=(1.0, 1.0, 1.0), open=("+z",), periodic=("x", "y")),
        fill={"water": SlabFill(phase="water", bottom=0.0, top=0.5, velocity=(0.3, 0.0, 0.0))},
        bodies={"box": BoxBody(size=(0.3, 0.3, 0.3), position=(0.5, 0.5, 0.85), motion=Fixed())},
        probes={
            "gauge": WaveGauge(point=(0.2, 0.2)),
            "flow": VelocityProbe(point=(0.5, 0.5, 0.25)),
            "bottom": PressureProbe(point=(0.5, 0.5, 0.0)),
            "box": BodyProbe(body="box"),
        },
    )
    _, frame, summary = run_steps(scenario)
    scalars = frame.scalars
    assert scalars["probes/gauge"] == pytest.approx(0.5, abs=0.05)
    assert scalars["probes/flow/x"] == pytest.approx(0.3, abs=0.03)
    assert scalars["probes/box/z"] == pytest.approx(0.85, abs=1e-12)
    assert math.isfinite(scalars["probes/bottom"])
    series = summary.summary(0.002)["probes"]
    assert set(series) == {name.removeprefix("probes/") for name in scalars if name.startswith("probes/")}
    assert series["gauge"]["time_s"] == [0.0, 0.002]


def test_budget_is_summed_up_where_it_is_asked_for() -> None:
    """Nothing is left over, gravity's momentum is weight times time; what was not asked for is null."""
    _, _, silent = run_steps(small("floating-box"))
    assembly, _, told = run_steps(small("floating-box", "run.budget=true"))
    keys = ("energy_residual", "momentum_residual", "budget")
    assert all(silent.summary(0.015)[key] is None for key in keys)
    summary = json.loads(json.dumps(told.summary(0.015), allow_nan=False))
    assert summary["energy_residual"] < 1e-6
    assert summary["momentum_residual"] < 1e-6
    mass = float(np.sum([len(assembly.fluid.phase_ids(p.name)) * p.rest_density for p in assembly.fluid.config.phases]))
    weight = mass * assembly.fluid.config.rest_volume * assembly.scenario.fluid.gravity[2]
    assert summary["budget"]["parts"]["gravity"]["momentum_Ns"][2] == pytest.approx(weight * 0.015, rel=1e-6)


def test_body_displaces_the_liquid_it_stands_in() -> None:
    """No particle starts inside a body; what is missing is its submerged volume, to one layer around it."""
    scenario = small("floating-box")
    positions = np.concatenate(list(_start(scenario).values()))
    inside = (np.abs(positions - 0.45) < 0.15).all(axis=1)
    assert not inside.any()
    without = small("floating-box", "bodies.box.position=[0.45, 0.45, 0.75]")
    missing = len(_start(without)["water"]) - len(positions)
    assert 0 < missing * 0.1**3 <= 0.5**2 * 0.3


def _start(scenario: Scenario) -> Mapping[str, np.ndarray]:
    return lay_out(resolve(scenario)).positions


def test_failed_run_ends_with_1_and_keeps_recording_and_summary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A participant that fails at its second step: exit code 1, one readable frame or more, the reason in the summary."""
    healthy = FluidParticipant.do_step

    def failing(self: FluidParticipant, time: float, step_size: float) -> object:
        if time > 0.0:
            raise ValueError("the water has gone")
        return healthy(self, time, step_size)

    monkeypatch.setattr(FluidParticipant, "do_step", failing)
    options = RunOptions(record=tmp_path / "run.rrd", summary=tmp_path / "run.json")
    assert run_scenario(small("two-layer"), options=options) == 1
    result = json.loads((tmp_path / "run.json").read_text())
    assert result["steps"] == 1
    assert "the water has gone" in result["ended"]
    assert Replay(tmp_path / "run.rrd").scalars


def test_unwritable_results_are_refused_before_the_run(tmp_path: Path) -> None:
    options = RunOptions(record=tmp_path / "no" / "run.rrd", summary=tmp_path / "no" / "run.json")
    with pytest.raises(ScenarioError) as caught:
        run_scenario(small("two-layer"), options=options)
    assert {problem.path for problem in caught.value.problems} == {"--record", "--summary"}


def test_body_too_small_for_the_particles_is_refused() -> None:
    scenario = small("floating-box", "bodies.box.size=[0.01, 0.01, 0.01]")
    with pytest.raises(ScenarioError, match=r"bodies\.box cannot be sampled"):
        build(scenario)


def test_bodies_that_lie_in_each_other_are_refused() -> None:
    with pytest.raises(ScenarioError) as caught:
        build(small("floating-box", "bodies.box.position.2=0.0"))
    assert [problem.path for problem in caught.value.problems] == ["bodies.box"]
    assert "has body 'box' 0.15 m deep inside a side of the tank at the start" in caught.value.problems[0].text


def test_pipe_has_room() -> None:
    for height, part in (
        (0.78, "to 0.856 m, allowed: inside the tank, 0 to 0.8 m"),
        (0.3, "lies in body 'rock' at the start"),
    ):
        with pytest.raises(ScenarioError) as caught:
            build(small("rock-coating", f"emitters.pipe.mouth.2={height}"))
        assert [problem.path for problem in caught.value.problems] == ["emitters.pipe.mouth"]
        assert part in caught.value.problems[0].text


@pytest.mark.parametrize(
    ("number", "code"),
    [
        (signal.SIGINT, 130),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in ((signal.SIGTERM, 143), (signal.SIGHUP, 129))),
    ],
)
def test_signal_ends_a_run_in_order(number: signal.Signals, code: int, tmp_path: Path) -> None:
    """The step under way is finished, recording and summary are written, and the exit code names the signal."""
    record, summary = tmp_path / "run.rrd", tmp_path / "run.json"
    settings = ["--set", "fluid.particle_spacing=0.1", "--until", "1000", "--threads", "1"]
    files = ["--record", str(record), "--summary", str(summary)]
    process = started_run(tmp_path / "clock", "still-column", *settings, *files)
    process.send_signal(number)
    process.communicate(timeout=60)
    assert process.returncode == code
    result = json.loads(summary.read_text())
    assert result["ended"] == f"stopped by signal {int(number)}"
    assert 0.0 < result["simulated_s"] < 1000.0
    assert Replay(record).end_reason == result["ended"]
    assert damage_of(record).is_ended


@pytest.mark.slow
def test_signals_that_a_run_was_started_to_ignore_do_not_stop_it(tmp_path: Path) -> None:
    """So a script starts what it ends with &, and nohup its command."""
    clock, summary = tmp_path / "clock", tmp_path / "run.json"
    settings = ["--set", "fluid.particle_spacing=0.1", "--until", "1000", "--threads", "1", "--no-record"]
    ignored = (signal.SIGINT, signal.SIGHUP)
    process = started_run(clock, "still-column", *settings, "--summary", str(summary), ignoring=ignored)
    for number in ignored:
        process.send_signal(number)
    steps = clock.read_text().count("\n")
    while clock.read_text().count("\n") < steps + 3:  # it goes on
        assert process.poll() is None
        time.sleep(0.005)
    process.terminate()
    process.communicate(timeout=60)
    assert json.loads(summary.read_text())["ended"] == f"stopped by signal {int(signal.SIGTERM)}"


@pytest.mark.parametrize(
    ("name", "settings", "grid", "thinned"),
    [
        ("calm-spread", (), 1 / 2048, {"ocean": 2}),  # 30 mm / 32 = 1 / 1067 m
        ("calm-spread", ("recording.precision=0",), None, {"ocean": 2}),
        ("calm-spread", ("recording.precision=0.01",), 1 / 128, {"ocean": 2}),
        ("dam-break", (), 1 / 2048, {}),  # water is all there is to see
    ],
)
def test_terms_of_recording(name: str, settings: tuple[str, ...], grid: float | None, thinned: dict[str, int]) -> None:
    scenario = load_scenario(name, overrides=settings).scenario
    assert recording_grid(scenario.recording.precision, scenario.fluid.particle_spacing) == grid
    assert thinning(scenario.phases) == thinned


def test_failure_names_the_participant() -> None:
    """The error that observers and the caller see is the participant's."""
    with ScenarioRun(small("two-layer")) as run:
        _ = run.simulation
        run.assembly.fluid.add_forcing(Poison())
        with pytest.raises(CoSimulationError, match="'fluid'"):
            run.step()
