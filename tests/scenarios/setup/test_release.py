"""A body that is held until it is released: it stays, and falls or floats freely from then on, also from a saved state."""

from __future__ import annotations

from typing import Any

import pytest

from coupling.bullet.rigid_body_world import RigidBodyWorld
from scenarios.running.assembly import build
from scenarios.spec.load import scenario_from
from scenarios.text.problems import ScenarioError

POOL: dict[str, Any] = {
    "name": "release",
    "run": {"duration": 1.0, "communication_step": 0.02, "threads": 1},
    "fluid": {"particle_spacing": 0.1, "maximum_time_step": 0.02},
    "phases": {"water": {"density": 1000.0, "dynamic_viscosity": 0.001}},
    "tank": {"lower": [0.0, 0.0, 0.0], "upper": [1.2, 1.2, 2.0], "open": ["+z"]},
    "fill": {"water": {"shape": "slab", "phase": "water", "bottom": 0.0, "top": 0.6}},
    "bodies": {
        "float": {
            "shape": "box", "size": [0.4, 0.4, 0.4], "density": 300.0, "position": [0.6, 0.6, 0.3],
            "motion": {"kind": "free", "release": 0.1},
        },
        "drop": {
            "shape": "sphere", "radius": 0.1, "density": 500.0, "position": [0.2, 0.2, 1.5],
            "motion": {"kind": "free", "release": 0.1},
        },
    },
}  # fmt: skip


def world_of(scenario: Any) -> tuple[Any, RigidBodyWorld]:
    assembly = build(scenario)
    assert assembly.world is not None
    return assembly.co_simulation(), assembly.world


def test_a_held_body_stays_and_then_moves_freely() -> None:
    simulation, world = world_of(scenario_from(POOL))
    simulation.initialize()
    for _ in range(5):
        simulation.step()
        assert world.pose("float")[:3] == pytest.approx([0.6, 0.6, 0.3], abs=1e-12)
        assert not world.twist("float").any() and not world.twist("drop").any()
    assert world.inverse_mass("drop")[0, 0] > 0.0  # released at 0.1 s
    saved = simulation.save_state()
    for _ in range(5):
        simulation.step()
    fallen = world.pose("drop")[2]
    assert fallen == pytest.approx(1.5 - 0.5 * 9.81 * 0.1**2, abs=0.01)
    assert world.pose("float")[2] > 0.305  # 0.3 of the water's density, and half of it too deep: it rises
    simulation.terminate("completed")
    again, other = world_of(scenario_from(POOL))
    again.initialize(saved)
    for _ in range(5):
        again.step()
    assert other.pose("drop")[2] == fallen
    again.terminate("completed")


def test_a_state_from_before_the_release_holds_again() -> None:
    simulation, world = world_of(scenario_from(POOL))
    simulation.initialize()
    simulation.step()
    saved = simulation.save_state()
    for _ in range(6):
        simulation.step()
    assert world.twist("drop")[2] < 0.0
    simulation.restore_state(saved)
    assert not world.inverse_mass("drop").any()
    simulation.step()
    assert world.pose("drop")[2] == pytest.approx(1.5, abs=1e-12)
    simulation.terminate("completed")


def test_a_held_body_has_no_velocity_of_its_own() -> None:
    bodies = {"drop": POOL["bodies"]["drop"] | {"velocity": [0.0, 0.0, 1.0]}}
    with pytest.raises(ScenarioError, match="only for a body that is free from the start"):
        scenario_from(POOL | {"bodies": bodies})
