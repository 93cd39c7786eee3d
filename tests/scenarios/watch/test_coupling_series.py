"""The account of the exchange between fluid and bodies is right: impulse and work against what bodies gain."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.spec.load import scenario_from

STEP = 0.01
STEPS = 12


@pytest.fixture(scope="module")
def series() -> list[dict[str, float]]:
    """A box is let go in water that it is too deep in; budget kept."""
    settings = [
        "fluid.particle_spacing=0.075",
        f"run.communication_step={STEP}",
        "bodies.box.position=[0.45, 0.45, 0.4]",
    ]
    terms = ["run.duration=1.0", "run.budget=true"]
    frames: list[dict[str, float]] = [{} for _ in range(STEPS + 1)]
    with ScenarioRun("floating-box", *settings, *terms) as run:
        run.run(STEPS * STEP)
        for name, track in run.readings().series.items():
            for time, value in zip(track.time, track.value, strict=True):
                frames[round(time / STEP)][name] = value
    return frames


def test_the_bodies_gain_what_the_fluid_gave_and_gravity(series: list[dict[str, float]]) -> None:
    """p = sum H F + m g t: exact to rounding, whatever F is. Mass 0.3^3 * 500 = 13.5 kg."""
    for index, frame in enumerate(series):
        momentum = np.array([frame[f"ledger/bodies/momentum_{axis}"] for axis in "xyz"])
        impulse = np.array([frame[f"ledger/exchange/impulse_{axis}"] for axis in "xyz"])
        weight = 13.5 * np.array([0.0, 0.0, -9.81]) * index * STEP
        np.testing.assert_allclose(momentum, impulse + weight, atol=1e-9)
    assert series[-1]["ledger/bodies/momentum_z"] > 1.0  # it rises


def test_the_bodies_energy_changes_by_the_work_of_the_fluid(series: list[dict[str, float]]) -> None:
    """E - E_0 = W: kinetic energy and trapezoidal work agree exactly for a constant force over a step; what the symplectic Euler
    step of the rigid engine adds is its error in m g z, m g H (v_end - v_0) / 2 for its one step in each."""
    first, last = series[0], series[-1]
    gained = last["ledger/bodies/energy"] - first["ledger/bodies/energy"]
    speed = last["ledger/bodies/momentum_z"] / 13.5
    assert gained - last["ledger/exchange/work"] == pytest.approx(13.5 * 9.81 * STEP * speed / 2.0, rel=1e-3)
    assert last["ledger/exchange/work"] > 1.0


def test_a_free_body_does_what_the_fluid_expects(series: list[dict[str, float]]) -> None:
    """Fluid and rigid engine integrate the same impulse over the same mass; gyroscopic terms are of the order of its slow turn."""
    assert "coupling/residual/linear" not in series[0]
    for frame in series[1:]:
        assert frame["coupling/residual/linear"] < 1e-9
        assert frame["coupling/residual/angular"] < 1e-3


def test_the_ledger_of_causes_and_the_wall_time_are_there(series: list[dict[str, float]]) -> None:
    """Energy that the causes give in a step is what the fluid gains in it, to the share that no cause explains."""
    for before, frame in pairwise(series):
        now = frame["ledger/fluid/kinetic_energy"] + frame["ledger/fluid/potential_energy"]
        then = before["ledger/fluid/kinetic_energy"] + before["ledger/fluid/potential_energy"]
        causes = [value for name, value in frame.items() if name.startswith("ledger/cause/")]
        assert now - then == pytest.approx(sum(causes), abs=1e-3 * sum(map(abs, causes)))
        assert 0.0 <= frame["ledger/energy_residual"] < 1e-3
        assert 0.0 <= frame["ledger/momentum_residual"] < 1e-3
        assert frame["coupling/sub_steps"] >= 1.0
        assert {name for name in frame if "wall_seconds" in name} == {
            f"coupling/wall_seconds/{n}" for n in ("fluid", "bodies")
        }


THUD = {
    "name": "thud",
    "run": {"duration": 0.4, "communication_step": 0.05},
    "fluid": {"particle_spacing": 0.08},
    "phases": {"water": {"density": 1000.0, "dynamic_viscosity": 0.0}},
    "tank": {"lower": [0.0, 0.0, 0.0], "upper": [0.8, 0.8, 1.2], "open": ["+z"]},
    "fill": {"pool": {"shape": "slab", "phase": "water", "bottom": 0.0, "top": 0.48}},
    "bodies": {
        "shelf": {"shape": "box", "size": [0.4, 0.4, 0.16], "position": [0.4, 0.4, 0.36], "motion": "fixed"},
        "ball": {
            "shape": "sphere",
            "radius": 0.12,
            "density": 300.0,
            "position": [0.4, 0.4, 1.03],
            "velocity": [0.0, 0.0, -4.0],
        },
    },
}


def test_running_into_something_is_no_work_of_the_exchange() -> None:
    # a ball hits a shelf just under water: the fluid does not predict that it stops
    made, hit = 0.0, False
    with ScenarioRun(scenario_from(THUD)) as run:
        for _ in range(8):
            run.step()
            made += run.assembly.ledger.unexplained
            hit |= "ball" in run.assembly.world.disturbed
    assert hit
    assert made > 1.0  # J, which would have ended the run as unstable
    assert abs(run.assembly.ledger.energy_residual) < 0.1
