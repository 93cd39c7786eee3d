"""How orders given during a run reach its parts: helmsmen, current, waves, wind and pipes."""

from __future__ import annotations

import numpy as np

from oilsim.forcing import AiryWaves, Current, Wind
from scenarios.build import Assembly, set_wind
from scenarios.build_fluid import horizontal
from scenarios.fleet import course_of
from scenarios.scenario import Scenario


def give_orders(assembly: Assembly, scenario: Scenario) -> None:
    """Bring every part to what `scenario` says of it; it differs from the assembly's own in `plan.ORDERS` only."""
    for control in assembly.controls:
        course = course_of(scenario.vessels[control.vessel.name], scenario)
        if course != control.vessel.course:
            control.change_course(course)
    assembly.scoring.take_orders([control.vessel for control in assembly.controls])
    set_wind(scenario, assembly.controls)
    for emitter, pipe in zip(assembly.fluid.emitters, scenario.emitters.values(), strict=True):
        emitter.speed = pipe.speed
    _drive(assembly, scenario)


def _drive(assembly: Assembly, scenario: Scenario) -> None:
    """Current, waves and wind as `scenario` has them."""
    settings = scenario.forcing
    water = (0.0, 0.0, 0.0)
    if settings.current is not None:
        water = horizontal(settings.current.speed, settings.current.direction)
        assembly.scoring.take_current(np.array(water))
    for forcing in assembly.fluid.forcings:
        if isinstance(forcing, Current):
            forcing.velocity = water
        elif isinstance(forcing, AiryWaves) and settings.waves is not None:
            forcing.height, forcing.drift = settings.waves.height, water[:2]
        elif isinstance(forcing, Wind) and settings.wind is not None:
            forcing.speed, forcing.direction = settings.wind.speed, settings.wind.direction
            forcing.gustiness = settings.wind.gustiness
