"""The wind's drag on what stands above the water: by formula on a box however it is turned, and as drift of a high-sided boat."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from oilsim.core.physical_constants import AIR_DENSITY
from scenarios.running.assembly import build
from scenarios.spec.load import scenario_from
from vessels.windage import Windage, WindOnBodies

BOX = trimesh.creation.box((2.0, 1.0, 1.0))
WIND = np.array([8.0, 0.0, 0.0])
HALF = 0.5 * AIR_DENSITY * 8.0**2


def wrench(
    turn: float = 0.0, level: float = -0.25, twist: tuple[float, ...] = (0.0,) * 6, height: float = 0.0
) -> np.ndarray:
    pose = np.array([5.0, -3.0, height, *Rotation.from_euler("z", turn).as_quat()])
    return Windage(BOX, level).wrench(pose, np.array(twist), WIND)


@pytest.mark.parametrize("turn", [0.0, 0.3, 0.5 * math.pi, 2.5])
def test_drag_is_that_of_the_area_above_the_water_that_faces_the_wind(turn: float) -> None:
    area = 0.75 * (1.0 * abs(math.cos(turn)) + 2.0 * abs(math.sin(turn)))
    found = wrench(turn)
    assert found[:3] == pytest.approx([HALF * area, 0.0, 0.0], abs=0.03 * HALF * area)


def test_drag_acts_in_the_middle_of_the_dry_side_and_on_the_relative_wind() -> None:
    found = wrench()
    assert found[4] == pytest.approx(found[0] * 0.125, rel=0.15)  # 0.125 m above the middle: it heels to lee
    assert wrench(twist=(8.0, 0.0, 0.0, 0.0, 0.0, 0.0)) == pytest.approx(np.zeros(6))
    assert wrench(twist=(4.0, 0.0, 0.0, 0.0, 0.0, 0.0))[0] == pytest.approx(0.25 * found[0])
    assert wrench(height=-0.8)[0] == 0.0  # under water
    assert wrench(height=5.0)[0] == pytest.approx(HALF * 1.0, rel=1e-9)


@pytest.mark.parametrize("angles", [(0.4, 0.0, 0.0), (0.0, 0.5, 0.0), (0.7, -0.4, 1.1)])
def test_a_heeled_and_pitched_box_shows_the_wind_the_sides_that_face_it(angles: tuple[float, float, float]) -> None:
    """High above the water each face that looks to windward counts with its projected area, and acts in its middle."""
    turn = Rotation.from_euler("xyz", angles)
    outward = turn.apply(np.concatenate([np.eye(3), -np.eye(3)]))
    middle = outward * np.tile([1.0, 0.5, 0.5], 2)[:, None]  # of the faces, from the box's middle
    facing = np.maximum(0.0, -outward[:, 0]) * np.tile([1.0, 2.0, 2.0], 2)
    force = np.array([HALF * facing.sum(), 0.0, 0.0])
    moment = np.cross(facing @ middle / facing.sum(), force)
    pose = np.array([5.0, -3.0, 10.0, *turn.as_quat()])
    found = Windage(BOX, -0.25).wrench(pose, np.zeros(6), WIND)
    assert found == pytest.approx([*force, *moment], rel=1e-9, abs=1e-9)


def test_the_participant_gives_each_body_its_wrench_and_goes_on_from_its_state() -> None:
    wind = WindOnBodies({"box": Windage(BOX, -0.25)}, lambda place, time: WIND)
    wind.do_step(0.0, 0.1)
    force = wind.get("box.applied_wrench")
    assert force == pytest.approx(wrench())
    other = WindOnBodies({"box": Windage(BOX, -0.25)}, lambda place, time: WIND)
    other.restore_state(wind.save_state())
    assert other.get("box.applied_wrench") == pytest.approx(force)
    with pytest.raises(TypeError, match="restore_state got a int"):
        other.restore_state(3)


SEA: dict[str, Any] = {
    "name": "leeway",
    "run": {"duration": 10.0, "communication_step": 0.04, "threads": 1},
    "fluid": {"particle_spacing": 0.1, "maximum_time_step": 0.04},
    "phases": {"sea": {"density": 1025.0, "dynamic_viscosity": 0.001}},
    "tank": {"lower": [0.0, 0.0, 0.0], "upper": [2.0, 1.6, 2.0], "open": ["+z"], "periodic": ["x", "y"]},
    "fill": {"sea": {"shape": "slab", "phase": "sea", "bottom": 0.0, "top": 0.5, "velocity": [0.0, 0.0, 0.0]}},
    "bodies": {"boat": {"shape": "box", "size": [0.6, 0.4, 0.6], "density": 340.0, "position": [1.0, 0.8, 0.6]}},
    "sea": {"wind": {"speed": 12.0}},
}


@pytest.mark.slow
def test_a_high_sided_boat_drifts_as_the_balance_of_its_drags_says() -> None:
    """Air on 0.4 m x 0.4 m against water on 0.4 m x 0.2 m: v / U = sqrt(rho_a A_a / (rho_w A_w Cd)), Cd of the water about 1.

    It gets there within several v / a, and Cd of a floating box at this spacing lies between 0.5 and 2.
    """
    assembly = build(scenario_from(SEA))
    simulation = assembly.co_simulation()
    simulation.initialize()
    ways = []
    for _ in range(150):
        simulation.step()
        ways.append(float(assembly.world.pose("boat")[0]))  # type: ignore[union-attr]
    simulation.terminate("completed")
    force = 0.5 * AIR_DENSITY * 12.0**2 * 0.4 * 0.4
    mass = 340.0 * 0.6 * 0.4 * 0.6
    fastest = 0.5 * force / mass * 6.0**2  # without any water
    final = 12.0 * math.sqrt(AIR_DENSITY * 0.4 / (1025.0 * 0.2))
    drift = (ways[-1] - ways[-51]) / 2.0
    assert ways[-1] - 1.0 < fastest
    assert 0.5 * final < drift < 1.5 * final
