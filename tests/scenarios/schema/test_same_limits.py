"""A scenario file allows what the class behind a setting allows: every shared quantity, inside, at and outside its limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pytest

from booms.boom import BoomDesign
from oilsim import BoundaryParticles, FluidConfig, Phase, PipeEmitter
from oilsim.core.quantity import LARGEST, Quantity, quantities
from oilsim.sea import KaimalGusts, RegularWaves, SteadyFlow, Zone
from scenarios.schema.exercise import BoomSettings, LegSettings, VesselSettings
from scenarios.schema.liquid import FluidSettings, PhaseSettings, PipeEmitterSettings, Tank, ZoneSettings
from scenarios.schema.parsing.quantity_fields import Section
from scenarios.schema.parsing.structuring import as_data, structure
from scenarios.schema.sea import RegularSeaWaves, SteadySeaCurrent, SteadySeaWind
from scenarios.text.problems import ScenarioError
from vessels.course import CourseLeg
from vessels.hull_size import HullSize
from vessels.vessel import ControlGains, Propulsion

Core = Callable[[dict[str, Any]], object]
HULL = {"length": 2.0, "beam": 0.5, "draft": 0.1, "depth": 0.3}


@dataclass(frozen=True)
class Pair:
    """A section of a scenario, and the class behind some of its settings, with sound values of both.

    shared: names of the settings, each by the owner's own name where that is another; make: the owner from its values.
    """

    section: type[Section]
    settings: dict[str, Any]
    owner: type
    values: dict[str, Any]
    shared: dict[str, str]
    make: Core


def _same(*names: str) -> dict[str, str]:
    return {name: name for name in names}


def _built(owner: type) -> Core:
    return lambda values: owner(**values)


def _fluid(values: dict[str, Any]) -> object:
    """In a domain that is as large as a particle, so that no spacing is too fine for it."""
    spacing = values["particle_spacing"]
    size = spacing if isinstance(spacing, float) and 0.0 < spacing <= LARGEST else 1.0
    return FluidConfig(**values, upper=(size, size, size))


FLUID = tuple(name for name in quantities(FluidSettings))
PAIRS = {
    "fluid": Pair(
        FluidSettings,
        {"particle_spacing": 0.1, "minimum_time_step": 1e-9, "maximum_time_step": 1e12},
        FluidConfig,
        {"particle_spacing": 0.1, "minimum_time_step": 1e-9, "maximum_time_step": 1e12, "lower": (0, 0, 0),
         "phases": (Phase(name="water", rest_density=1000.0),)},
        _same(*FLUID),
        _fluid,
    ),
    "phase": Pair(
        PhaseSettings, {"density": 1000.0, "dynamic_viscosity": 1e-3}, Phase, {"name": "water", "rest_density": 1000.0},
        {"density": "rest_density", **_same("dynamic_viscosity", "adhesion")}, _built(Phase),
    ),
    "wind": Pair(SteadySeaWind, {"speed": 5.0}, SteadyFlow, {"speed": 5.0}, _same("speed", "direction"), _built(SteadyFlow)),
    "gusts": Pair(
        SteadySeaWind, {"speed": 5.0}, KaimalGusts, {}, {"gust_intensity": "intensity"}, _built(KaimalGusts),
    ),
    "current": Pair(SteadySeaCurrent, {"speed": 5.0}, SteadyFlow, {"speed": 5.0}, _same("speed", "direction"), _built(SteadyFlow)),
    "waves": Pair(
        RegularSeaWaves, {"height": 0.1, "period": 1.0}, RegularWaves, {"height": 0.1, "period": 1.0},
        _same("height", "period", "direction"), _built(RegularWaves),
    ),
    "zone": Pair(
        ZoneSettings, {}, Zone, {"lower": (0, 0, 0), "upper": (1, 1, 1)}, _same("relaxation_time"), _built(Zone),
    ),
    "walls": Pair(
        Tank, {"lower": (0, 0, 0), "upper": (1, 1, 1)}, BoundaryParticles,
        {"name": "tank", "position": np.zeros((1, 3)), "volume": np.ones(1), "area": np.ones(1)},
        _same("contact_angle"), _built(BoundaryParticles),
    ),
    "pipe": Pair(
        PipeEmitterSettings, {"phase": "oil", "mouth": (0, 0, 0), "radius": 0.1, "speed": 1.0}, PipeEmitter,
        {"phase": "oil", "mouth": (0, 0, 0), "direction": (0, 0, -1), "radius": 0.1, "speed": 1.0, "spacing": 0.1},
        _same("mouth", "speed", "start", "volume"), _built(PipeEmitter),
    ),
    "boom": Pair(
        BoomSettings, {"ends": ("a", "b"), "length": 5.0, "skirt_depth": 0.3, "freeboard": 0.1}, BoomDesign,
        {"length": 5.0, "segment_count": 20, "skirt_depth": 0.3, "freeboard": 0.1, "buoyancy_to_weight": 5.0, "skirt_thickness": 0.01},
        {"segments": "segment_count",
         **_same("length", "skirt_depth", "freeboard", "buoyancy_to_weight", "skirt_thickness", "ballast_fraction")},
        _built(BoomDesign),
    ),
    "hull": Pair(
        VesselSettings, {**HULL, "position": (0, 0), "bollard_pull": 1.0, "yaw_moment": 1.0}, HullSize, HULL,
        _same("length", "beam"), _built(HullSize),
    ),
    "propulsion": Pair(
        VesselSettings, {**HULL, "position": (0, 0), "bollard_pull": 1.0, "yaw_moment": 1.0}, Propulsion,
        {"bollard_pull": 1.0, "astern_pull": 1.0, "yaw_moment": 1.0}, _same("bollard_pull", "yaw_moment", "side_thrust"),
        _built(Propulsion),
    ),
    "gains": Pair(
        VesselSettings, {**HULL, "position": (0, 0), "bollard_pull": 1.0, "yaw_moment": 1.0}, ControlGains, {},
        _same("acceleration"), _built(ControlGains),
    ),
    "leg": Pair(
        LegSettings, {"speed": 1.0, "heading": 0.0}, CourseLeg, {"start_time": 0.0, "speed": 1.0, "heading": 0.0},
        {"start": "start_time", **_same("speed", "heading")}, _built(CourseLeg),
    ),
}  # fmt: skip


def probes(declared: Quantity) -> Iterator[float | int | str | bool]:
    """Values inside, at and on both sides of every limit, and what is no number."""
    step = 1 if declared.whole else 0.0
    for limit in (declared.above, declared.at_least, declared.below, declared.at_most, -LARGEST, LARGEST):
        if limit is None:
            continue
        if declared.whole:
            yield from (int(limit) - step, int(limit), int(limit) + step)
        else:
            yield from (math.nextafter(limit, -math.inf), limit, math.nextafter(limit, math.inf))
    yield from (1, 2.5, 0.05, math.nan, math.inf, -math.inf, "1", True)


def refused(make: Callable[[], object]) -> bool:
    try:
        make()
    except ValueError:  # a ScenarioError is one
        return True
    return False


CASES = [(pair, setting) for pair in PAIRS for setting in PAIRS[pair].shared]


@pytest.mark.parametrize(("pair", "setting"), CASES)
def test_both_give_the_same_verdict(pair: str, setting: str) -> None:
    """In a scenario file, in Python's settings and in the class behind them."""
    case = PAIRS[pair]
    name = case.shared[setting]
    declared = quantities(case.owner)[name]
    vector = isinstance(case.values.get(name, getattr(case.owner, name, 0.0)), tuple)
    assert not refused(lambda: case.section(**case.settings))
    assert not refused(lambda: case.make(case.values))
    verdicts = set()
    for value in probes(declared):
        given: Any = (0.0, 0.0, value) if vector else value
        settings, values = case.settings | {setting: given}, case.values | {name: given}
        verdict = refused(lambda values=values: case.make(values))
        assert refused(lambda settings=settings: case.section(**settings)) == verdict, given
        assert refused(lambda settings=settings: structure(settings, case.section)) == verdict, given
        verdicts.add(verdict)
    assert verdicts == {True, False}


def test_settings_and_owners_share_their_declarations() -> None:
    """The same unit and the same limits, and the owner's default unless the section has its own."""
    for case in PAIRS.values():
        for setting, name in case.shared.items():
            assert quantities(case.section)[setting] == quantities(case.owner)[name]
    config = FluidConfig(
        particle_spacing=0.1, phases=(Phase(name="a", rest_density=1.0),), lower=(0, 0, 0), upper=(1, 1, 1)
    )
    settings = FluidSettings(particle_spacing=0.1)
    shared = [
        item.name for item in fields(settings) if item.name != "interfacial_tension"
    ]  # the config has it in its phases
    assert {name: getattr(settings, name) for name in shared} == {name: getattr(config, name) for name in shared}


def test_settings_at_odds_are_refused_alike() -> None:
    water = (Phase(name="water", rest_density=1000.0),)
    for odd in (
        {"minimum_time_step": 0.1, "maximum_time_step": 0.05},
        {"sleep_speed": 0.1, "scheme": "paper"},
        {"sleep_speed": 0.1, "gravity": (0.0, 0.0, 0.0)},
    ):
        with pytest.raises(ScenarioError) as told:
            FluidSettings(particle_spacing=0.1, **odd)
        with pytest.raises(ValueError) as refused_:
            FluidConfig(particle_spacing=0.1, phases=water, lower=(0, 0, 0), upper=(1, 1, 1), **odd)
        assert [str(problem) for problem in told.value.problems] == [str(refused_.value).removeprefix("fluid: ")]


def test_a_file_still_tells_path_value_limits_and_unit() -> None:
    with pytest.raises(ScenarioError) as caught:
        structure({"speed": -1.0, "gust_intensity": "a lot"}, SteadySeaWind)
    assert {str(problem) for problem in caught.value.problems} == {
        "speed is -1.0, allowed: 0 or more and at most 100 m/s",
        "gust_intensity is 'a lot', allowed: a number, 0 or more and at most 0.5",
    }
    assert as_data(SteadySeaWind(speed=1.0))["gust_intensity"] == 0.0
