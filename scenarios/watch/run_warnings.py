"""Warnings about a run, each given once.

They concern solves that stop before their tolerance is met, and bodies that leave the tank, are thinner than particles, or displace
liquid at the start.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from coupling.rigid.rigid_body_world import RigidBodyWorld
from oilsim.advance_report import AdvanceReport
from recordings.frame import EventLevel
from scenarios.scenario import Scenario
from scenarios.setup.placed_solids import table_entry
from scenarios.watch.boom_scoring import Happening

TOLD = 2.0  # residual that is worth a warning, in tolerances; with less the flow is the same


class Remarks:
    """The warnings of a run, checked after every communication step."""

    def __init__(
        self,
        scenario: Scenario,
        world: RigidBodyWorld | None,
        left_out: Mapping[str, str],
        swelling: Mapping[str, float],
    ) -> None:
        """Prepare the warnings.

        `left_out`: liquid that bodies displace at the start, by region; `swelling`: a body's volume for the fluid / its own, by name.
        """
        self._fluid, self._tank, self._world = scenario.fluid, scenario.tank, world
        self._left_out = left_out
        self._oil = {name for name, fill in scenario.fill.items() if scenario.phases[fill.phase].is_oil}
        self._swollen: dict[str, dict[str, float]] = {}
        for name, times in swelling.items():
            if times > 1.0:
                self._swollen.setdefault(table_entry(name), {})[name] = times
        self._made: set[str] = set()

    def look(self, report: AdvanceReport | None) -> list[Happening]:
        """Return the new warnings after a step with this report of the fluid."""
        short = {} if report is None else dict(self._solves(report))
        short |= dict(self._thin()) | dict(self._bodies())
        found = dict(self._fills())
        found |= {about: Happening(text, level="warning", source=about) for about, text in short.items()}
        new = {about: remark for about, remark in found.items() if about not in self._made}
        self._made |= set(new)
        return list(new.values())

    def save_state(self) -> dict[str, Any]:
        """Return the warnings given so far."""
        return {"made": sorted(self._made)}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to a state that `save_state` returned."""
        self._made = set(saved["made"])

    def _fills(self) -> Iterator[tuple[str, Happening]]:
        """Yield the liquid that bodies displace: for water this is normal, for oil it is a warning, since the slick is smaller."""
        for name, text in self._left_out.items():
            level: EventLevel = "warning" if name in self._oil else "info"
            yield f"fill {name}", Happening(text, level=level, source="oilsim")

    def _solves(self, report: AdvanceReport) -> Iterator[tuple[str, str]]:
        solves = {
            "density": (report.density_error, self._fluid.density_tolerance, "passes"),
            "divergence": (report.divergence_error, self._fluid.divergence_tolerance, "products"),
        }
        for name, (error, tolerance, unit) in solves.items():
            if error > TOLD * tolerance:
                text = f"stopped after {report.iterations[name]:.0f} {unit} per step with a mean compression of {error:.2g}"
                keys = f"fluid.{name}_tolerance is {tolerance:.2g}, fluid.{name}_iterations {getattr(self._fluid, f'{name}_iterations')}"
                yield f"fluid {name}", f"{text}; {keys} (reported once)"

    def _thin(self) -> Iterator[tuple[str, str]]:
        """Yield warnings about thin bodies; a boom's segments share one."""
        spacing = self._fluid.particle_spacing
        for all_times in self._swollen.values():
            times, (first, *others) = max(all_times.values()), all_times
            which, have, its = (f"{first} and {len(others)} more", "have", "their") if others else (first, "has", "its")
            text = f"the fluid sees and lifts {times:.2g} times {its} volume; a fluid.particle_spacing below {spacing:g} m resolves them"
            yield f"thin {first}", f"{which} {have} parts thinner than a particle: {text}"

    def _bodies(self) -> Iterator[tuple[str, str]]:
        if self._world is None:
            return
        for name in self._world.free_body_names:
            for axis, at, low, high in zip(
                "xyz", self._world.pose(name), self._tank.lower, self._tank.upper, strict=False
            ):
                side = f"-{axis}" if at < low else f"+{axis}" if at > high else ""
                if side in self._tank.open and side != "+z":  # through the top, from where it falls back
                    yield f"body {name}", f"has left the tank through its open side {side}"
