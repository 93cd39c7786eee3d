"""Skimmers with their storage, and the lines that hold booms: mooring legs down to anchors, ties and cross bridles; as pages show them."""

from __future__ import annotations

from typing import Any

from coupling.multibody.mooring_leg import MooringLeg
from scenarios.conduct.averages import Means
from scenarios.running.assembly import Assembly
from scenarios.setup.afloat.moorings import leg_name, tie_name
from scenarios.spec.resolve import RunSpec
from scenarios.spec.scenario import Scenario


def skimmers_of_crew(vessel: str, scenario: Scenario | RunSpec) -> list[str]:
    """Return the names of the skimmers that a vessel's crew works with: on it, on a boom that it holds, or on none that a vessel holds."""
    found = []
    for name, one in scenario.skimmers.items():
        boom = scenario.booms.get(one.on or "")
        holders = {one.on} if boom is None else set(boom.ends)
        if vessel in holders or holders.isdisjoint(scenario.vessels):
            found.append(name)
    return found


def skimmers_of(assembly: Assembly, scenario: Scenario, time: float, means: Means) -> dict[str, Any]:
    """Return what each skimmer does at `time` [s]: its place [m], rates [m3/s], volumes [m3], and why it stands; `scenario` has all orders.

    The rate of oil is averaged by `means`.
    """
    found = {}
    for one in assembly.skimmers:
        skimmer, x_y = one.skimmer, one.mouth
        is_ashore = skimmer.ashore_until is not None
        why = "" if skimmer.works else "stopped" if not skimmer.is_running else "emptied" if is_ashore else "full"
        found[one.short_name] = {
            "x": x_y[0],
            "y": x_y[1],
            "rate": float(means.mean(one.name, time, one.get("rate"))),
            "place": list(scenario.skimmers[one.short_name].place),
            "moves": bool((one.target != one.offset).any()),
            "nameplate": scenario.skimmers[one.short_name].nameplate / 3600.0,
            "swath": skimmer.design.swath,
            "stands": why,
            "oil": skimmer.account.oil,
            "oil_aboard": skimmer.oil_aboard,
            "water_aboard": skimmer.water_aboard,
            "storage": skimmer.design.storage,
        }
    return found


def lines_of(assembly: Assembly, scenario: Scenario) -> dict[str, Any]:
    """Return each leg and tie: ends [m] in plan, tension [N], whether it holds; of a leg how far [m] its anchor has dragged."""
    world, found = assembly.world, dict[str, Any]()
    if world is None:
        return found
    for name, line_name in (
        *((name, leg_name(name)) for name in scenario.moorings),
        *((name, tie_name(name)) for name in scenario.ties),
    ):
        line = world.lines[line_name]
        is_leg = isinstance(line, MooringLeg)
        found[line_name] = {
            "name": name,
            "kind": "mooring" if is_leg else "tie",
            "ends": world.line_ends(line_name)[:, :2].round(2).tolist(),
            "tension": line.tension,
            "holds": not line.parted if isinstance(line, MooringLeg) else line.holds,
            "dragged": line.dragged if isinstance(line, MooringLeg) else None,
        }
    return found
