"""Winches: they bring tow lines, mooring legs and booms on reels to the lengths that orders ask for, each at its own speed."""

from __future__ import annotations

from coupling.bullet.rigid_body_world import RigidBodyWorld
from scenarios.scenario import Scenario
from scenarios.setup.boom_lines import laid_out, reel_name
from scenarios.setup.fleet import Fleet
from scenarios.setup.moorings import leg_name, tie_name


class Winches:
    """The winches of a run; `advance` belongs to each communication point. A line that nobody has ordered is left to others.

    Lengths are kept with the state of the world, and orders with the plan, so winches remember nothing.
    """

    def __init__(self, scenario: Scenario, world: RigidBodyWorld | None, fleet: Fleet) -> None:
        """Hold all lines as they were laid; legs that are hauled in or paid out at the start are ordered so."""
        self._world, self._fleet = world, fleet
        self._laid = {name: boom.tow_line for name, boom in scenario.booms.items()}
        self._step = scenario.run.communication_step
        self._waiting = {tie_name(name) for name, tie in scenario.ties.items() if tie.waits}
        self._ordered: dict[str, tuple[float, float]] = {}  # length [m] and speed [m/s] by line
        self.take_orders(scenario)

    def take_orders(self, scenario: Scenario) -> None:
        """Take the lengths of lines from a scenario with all orders so far."""
        if self._world is None:
            return
        lines = self._world.lines
        changes = {leg_name(name): (-leg.hauled, leg.winch_speed) for name, leg in scenario.moorings.items()}
        changes |= {tie_name(name): (-tie.hauled, tie.winch_speed) for name, tie in scenario.ties.items()}
        for boom, settings in scenario.booms.items():
            reel, mouth = settings.reel, settings.ends[0]
            if reel is not None and reel.paid_out is not None and not isinstance(mouth, str):
                more = reel.paid_out - laid_out(self._fleet.booms[boom], mouth)
                changes[reel_name(boom)] = more, reel.winch_speed
            grown = settings.tow_line - self._laid[boom]
            for end, line in self._fleet.tensions_of(boom).items():
                hauled = scenario.vessels[end].hauled if end in settings.ends else 0.0
                changes.setdefault(line, (grown - hauled, settings.winch_speed))
        fast = {tie_name(name) for name, tie in scenario.ties.items() if tie.made_fast}
        for name, (change, speed) in changes.items():
            if name in self._waiting and name not in fast:
                continue  # its line is still loose
            if name in lines.names and (change != 0.0 or name in self._ordered or name in fast):
                self._ordered[name] = lines.laid_length(name) + change, speed
        self.advance()

    def advance(self) -> None:
        """Order the length of each line at the end of the next communication step."""
        for name, (wanted, speed) in self._ordered.items():
            assert self._world is not None, "lines need a world"
            lines = self._world.lines
            most, present = speed * self._step, lines.length(name)
            lines.order_length(name, present + min(max(wanted - present, -most), most))
