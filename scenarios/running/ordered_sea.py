"""The sea of a run without particles under orders: another current, other waves or another wind take over from those that there are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from oilsim.loads.morison import FloatingBodies
from oilsim.sea import Continuation, SteadyFlow
from scenarios.running.assembly import Assembly
from scenarios.scenario import Scenario
from scenarios.setup.at_sea.build_sea import build_sea
from scenarios.setup.fleet import water_density

if TYPE_CHECKING:
    from oilsim.sea import Sea


def ordered_sea(assembly: Assembly, scenario: Scenario) -> Sea | None:
    """Return the sea of `scenario` as it goes on from the present one; None in a run whose bodies no such sea loads.

    Gusts go on at the middle of the bodies afloat. Raises ScenarioError for a sea that cannot be built.
    """
    afloat, world = _afloat(assembly), assembly.world
    sea = None if afloat is None else build_sea(scenario, water_density(scenario))
    if sea is None or afloat is None or world is None:
        return None
    middle = world.poses(world.loaded_names)[:, :2].mean(axis=0)
    return afloat.sea.followed_by(sea.description, world.time, middle)


def change_sea(assembly: Assembly, sea: Sea) -> None:
    """Let another sea load the bodies and carry the slick from now on."""
    afloat = _afloat(assembly)
    if afloat is None or assembly.world is None:
        return
    assembly.world.change_environment(afloat.in_sea(sea))
    if assembly.slick is not None:
        from scenarios.setup.at_sea.parcels import carry_slick  # only a run with parcels pays for its kernels

        carry_slick(assembly.slick, sea, assembly.fleet.booms)


def saved_sea(assembly: Assembly) -> dict[str, Any]:
    """Return what the sea took over from those before it; nothing where there is none, so that other runs keep the hash of their state."""
    afloat = _afloat(assembly)
    carried = Continuation() if afloat is None else afloat.sea.description.carried
    return {} if carried == Continuation() else {"sea": asdict(carried)}


def restore_sea(assembly: Assembly, state: Mapping[str, Any]) -> None:
    """Let the sea go on as in a state with what `saved_sea` returned."""
    afloat, saved = _afloat(assembly), state.get("sea", {})
    made_in = saved.get("made_in")
    flow = None if made_in is None else SteadyFlow(**made_in)
    carried = Continuation(**{**saved, "made_in": flow})
    if afloat is not None and carried != afloat.sea.description.carried:
        change_sea(assembly, type(afloat.sea)(replace(afloat.sea.description, carried=carried)))


def _afloat(assembly: Assembly) -> FloatingBodies | None:
    """Return the bodies that a sea of formulas loads; None in another run, and with windows, whose water keeps its sea."""
    present = None if assembly.world is None else assembly.world.environment
    return present if isinstance(present, FloatingBodies) else None
