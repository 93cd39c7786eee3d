"""The dataclasses take in Python what a file may say, and nothing else; numbers of numpy are numbers."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from decimal import Decimal
from typing import Any

import numpy as np
import pytest

from scenarios.schema.bodies import RockBody, SineMotion, SphereBody
from scenarios.schema.exercise import BoomSettings, LegSettings, VesselSettings
from scenarios.schema.fmu_settings import FmuSettings
from scenarios.schema.liquid import FluidSettings, PhaseSettings, SlabFill, Tank
from scenarios.schema.parsing.structuring import as_data
from scenarios.spec.scenario import RunSettings, Scenario
from scenarios.text.problems import ScenarioError

BOX: Mapping[str, Any] = {"lower": (0.0, 0.0, 0.0), "upper": (1.0, 1.0, 1.0)}
BALL: Mapping[str, Any] = {"radius": 0.1, "position": (0.5, 0.5, 0.5), "density": 600.0}
HULL: Mapping[str, Any] = {
    "length": 1.0, "beam": 0.3, "draft": 0.1, "depth": 0.2, "position": (0.5, 0.5), "bollard_pull": 1.0, "yaw_moment": 1.0
}  # fmt: skip
BOOM: Mapping[str, Any] = {"length": 1.0, "skirt_depth": 0.1, "freeboard": 0.1}


def small(**changes: Any) -> Scenario:
    parts: dict[str, Any] = {
        "name": "small",
        "run": RunSettings(duration=1.0),
        "fluid": FluidSettings(particle_spacing=0.1),
        "phases": {"water": PhaseSettings(density=1000.0, dynamic_viscosity=1e-3)},
        "tank": Tank(**BOX),
        "fill": {"sea": SlabFill(phase="water", bottom=0.0, top=0.3)},
    }
    return Scenario(**(parts | changes))


@pytest.mark.parametrize(
    ("make", "path", "part"),
    [
        (lambda: Tank(**BOX, open=("+Z",)), "open.0", "is '+Z', allowed: '-x', '+x'"),
        (lambda: Tank(**BOX, open="+z"), "open", "is '+z', allowed: a list of entries, each '-x', '+x'"),
        (lambda: Tank(**BOX, periodic=("X",)), "periodic.0", "is 'X', allowed: 'x', 'y'"),
        (lambda: Tank(lower=(0, 0), upper=(1, 1, 1)), "lower", "is (0, 0), allowed: a list of 3 numbers, finite, in m"),
        (lambda: PhaseSettings(oil="brent", role="Oil"), "role", "did you mean 'oil'?"),
        (lambda: VesselSettings(**HULL, shape="wigly"), "shape", "did you mean 'wigley'?"),
        (lambda: VesselSettings(**HULL, control="auto"), "control", "is 'auto', allowed: 'helmsman', 'manual'"),
        (lambda: VesselSettings(**HULL, legs=({"speed": 1.0},)), "legs.0", "allowed: LegSettings"),
        (lambda: FluidSettings(particle_spacing=0.1, scheme="papr"), "scheme", "did you mean 'paper'?"),
        (lambda: FluidSettings(particle_spacing=None), "particle_spacing", "is None, allowed: a number, above 0 m"),
        (lambda: FluidSettings(particle_spacing=10**400), "particle_spacing", "allowed: a number, above 0 m"),
        (lambda: FluidSettings(particle_spacing=0.1, dimension=2.0), "dimension", "a whole number"),
        (lambda: RunSettings(duration=1.0, budget="no"), "budget", "is 'no', allowed: true or false"),
        (lambda: RunSettings(duration=Decimal(1)), "duration", "allowed: a number"),
        (lambda: SphereBody(**BALL, motion="fixed"), "motion", "is 'fixed', allowed: Free or Fixed or"),
        (lambda: SphereBody(**(BALL | {"position": (0, 0)})), "position", "a list of 3 numbers"),
        (lambda: SphereBody(**(BALL | {"radius": None, "position": None})), "radius", "is None, allowed"),
        (lambda: BoomSettings(ends=("port",), **BOOM), "ends", "allowed: a list of 2 entries, each text in quotes or a list of 2 numbers"),
        (lambda: BoomSettings(ends=("port", (0.0,)), **BOOM), "ends.1", "allowed: text in quotes or a list of 2 numbers"),
        (lambda: FmuSettings(file="a.fmu", start={"gain": "1"}), "start.gain", "allowed: a number or true or false"),
        (lambda: FmuSettings(file="a.fmu", inputs={"u": 1}), "inputs.u", "is 1, allowed: text in quotes"),
        (lambda: small(phases={"water": {"density": 1000.0}}), "phases.water", "allowed: PhaseSettings"),
        (lambda: small(phases={1: PhaseSettings(oil="brent")}), "phases", "a table of names"),
        (lambda: small(name=5), "name", "is 5, allowed: text in quotes"),
        (lambda: small(run={"duration": 1.0}), "run", "allowed: RunSettings"),
        (lambda: small(fluid=None), "fluid", "is None, allowed: FluidSettings"),
    ],
)  # fmt: skip
def test_what_is_not_of_its_kind_is_refused(make: Callable[[], object], path: str, part: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        make()
    found = {problem.path: problem.text for problem in caught.value.problems}
    assert part in found[path]


def test_every_field_is_told_at_once() -> None:
    with pytest.raises(ScenarioError) as caught:
        SphereBody(radius=None, position=(0, 0), motion="fixed", density=600.0)  # type: ignore[arg-type]
    assert {problem.path for problem in caught.value.problems} == {"radius", "position", "motion"}


def test_numbers_of_numpy_and_lists_are_taken_as_plain_ones() -> None:
    """They go into recordings as JSON."""
    ball = SphereBody(radius=np.float32(0.5), position=[1, np.int64(2), 3], mass=np.float64(2.0), motion=SineMotion(
        direction=(1, 0, 0), amplitude=np.float32(0.25), period=2))  # type: ignore[arg-type]  # fmt: skip
    assert (ball.radius, ball.position, ball.mass) == (0.5, (1.0, 2.0, 3.0), 2.0)
    assert json.loads(json.dumps(as_data(ball)))["motion"]["amplitude"] == 0.25
    rock = RockBody(size=(1, 1, 1), position=(0, 0, 0), density=2000, seed=np.int64(3))  # type: ignore[arg-type]
    assert type(rock.seed) is int
    assert isinstance(rock.density, float)
    assert LegSettings(speed=1, heading=0, through=[0, 1]).through == (0.0, 1.0)  # type: ignore[arg-type]
    assert FmuSettings(file="a.fmu", start={"gain": np.float32(2.0), "on": True}).start == {"gain": 2.0, "on": True}
