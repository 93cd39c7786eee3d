"""Orders during a run: how they reach helmsmen, current, waves, wind and pipes."""

from __future__ import annotations

from oilsim.forcing import AiryWaves, Wind
from scenarios.running.assembly import Assembly
from scenarios.scenario import Scenario
from scenarios.setup.fleet import course_of
from scenarios.signals.weather_inputs import set_current, set_wind


def give_orders(assembly: Assembly, scenario: Scenario) -> None:
    """Bring every part to what `scenario` says of it; it differs from the assembly's own in `plan.ORDER_KEYS` only."""
    for control in assembly.controls:
        course = course_of(scenario.vessels[control.vessel.name], scenario)
        if course is not None and course != control.vessel.course:
            control.change_course(course)
    assembly.scoring.take_orders([control.vessel for control in assembly.controls])
    for emitter, pipe in zip(assembly.fluid.emitters, scenario.emitters.values(), strict=True):
        emitter.speed = pipe.speed
    _drive(assembly, scenario)


def _drive(assembly: Assembly, scenario: Scenario) -> None:
    """Set current, waves and wind as in `scenario`."""
    settings = scenario.forcing
    if settings.current is not None:
        set_current(assembly.fluid, assembly.scoring, settings.current.speed, settings.current.direction)
    if settings.wind is not None:
        parts = assembly.parts
        set_wind(
            parts.fluid, parts.controls.values(), parts.wind_on_bodies, settings.wind.speed, settings.wind.direction
        )
    for forcing in assembly.fluid.forcings:
        if isinstance(forcing, AiryWaves) and settings.waves is not None:
            forcing.height = settings.waves.height
        elif isinstance(forcing, Wind) and settings.wind is not None:
            forcing.gustiness = settings.wind.gustiness
