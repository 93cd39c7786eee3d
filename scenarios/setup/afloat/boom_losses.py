"""The closures of a scenario's booms: which booms have them, and the oils and sizes that they go by."""

from __future__ import annotations

from collections.abc import Mapping

from booms.deployment import BoomLayout
from booms.losses.closure_losses import ClosureLosses, LostBoom
from booms.losses.liquids import ASSUMED_TENSION, OilOnWater
from booms.losses.rates import Closures
from booms.losses.resolution import Resolution
from scenarios.schema.exercise import BoomSettings
from scenarios.schema.liquid import PhaseSettings
from scenarios.spec.resolve import RunSpec


def has_closures(boom: BoomSettings, phases: Mapping[str, PhaseSettings]) -> bool:
    """Tell whether closures act at a boom: its settings ask for them, and there are oil and water."""
    oils = [phase.is_oil for phase in phases.values()]
    return boom.losses == "closures" and any(oils) and not all(oils)


def closure_losses(settings: BoomSettings, layout: BoomLayout, liquid: RunSpec) -> ClosureLosses | None:
    """Create the closures of a boom among particles of a tank; None where it has none."""
    if not has_closures(settings, liquid.phases) or not liquid.in_tank:
        return None
    spacing = liquid.spacing
    breadth = layout.segment.mesh.bounds[:, 1]
    return ClosureLosses(
        LostBoom(
            closures=Closures(
                skirt_depth=settings.skirt_depth,
                resolution=Resolution(spacing=spacing, skirt_depth=settings.skirt_depth),
            ),
            oils=oils_of(liquid.phases),
            waters=[name for name, phase in liquid.phases.items() if not phase.is_oil],
            segments=len(layout.segments),
            segment_length=settings.length / settings.segments,
            freeboard=settings.freeboard,
            float_width=float(breadth[1] - breadth[0]),
            spacing=spacing,
            period=liquid.domain.period,
        )
    )


def oils_of(phases: Mapping[str, PhaseSettings]) -> dict[str, OilOnWater]:
    """Return the oils among phases by their names, on the first of the waters."""
    water = next(phase.rest_density for phase in phases.values() if not phase.is_oil)
    return {
        name: OilOnWater(
            oil_density=phase.rest_density,
            water_density=water,
            kinematic_viscosity=phase.viscosity / phase.rest_density,
            interfacial_tension=tension_of(phase),
        )
        for name, phase in phases.items()
        if phase.is_oil
    }


def has_tension(phase: PhaseSettings) -> bool:
    """Tell whether a phase has a tension against water."""
    return phase.is_oil or phase.is_air


def tension_of(phase: PhaseSettings) -> float:
    """Return the interfacial tension [N/m] of an oil or of air on water, the assumed one if none is given."""
    return ASSUMED_TENSION if phase.tension is None else phase.tension


def assumed_tensions(spec: RunSpec) -> list[str]:
    """Say which interfacial tension is assumed for each oil that has none, where booms' closures or particles go by it."""
    if not spec.fluid.interfacial_tension and not any(has_closures(boom, spec.phases) for boom in spec.booms.values()):
        return []
    return [
        f"the interfacial tension of {name!r} is not given: {tension_of(phase):g} N/m is assumed"
        for name, phase in spec.phases.items()
        if phase.is_oil and phase.tension is None
    ]
