"""A tow winch: a drum with a drive that gives way, a brake that slips, and render and recover by tension.

Paid-out line x [m] from where the drum stood at the start, positive outward; drum speed v [m/s] at the line; T the tension:

    brake set:           v = max(0, T - brake_holding) / brake_slip
    constant tension:    v* = maximum_speed clip((T - tension_order) / tension_band, -1, 1), 0 within the dead band
    by hand:             v* = clip(speed_order, -maximum_speed, maximum_speed), the hauling part of it times 1 - T / stall_pull
    drive, brake free:   response_time dv/dt = v* - v, solved exactly over a step

Rendering is paying out above the ordered tension, recovering is hauling in below it. The drum stops when its line is out
(`line_out`) or in (`line_in`), and its brake's slip pays out only.
"""

from __future__ import annotations

import math

from coupling.fmu.scalar_model import ScalarModel, given, parameter, taken


class TowWinch(ScalarModel):
    """A tow winch with a brake that slips and a drive that renders and recovers.

    `brake` and `constant_tension` are switches, on above 0.5; see the module for the rest.
    """

    tension = taken("N")
    speed_order = taken("m/s")
    tension_order = taken("N", 20.0)
    brake = taken("1")
    constant_tension = taken("1")
    maximum_speed = parameter("m/s", 0.2)
    response_time = parameter("s", 0.2)
    stall_pull = parameter("N", 100.0)
    tension_band = parameter("N", 10.0)
    dead_band = parameter("N", 1.0)
    brake_holding = parameter("N", 60.0)
    brake_slip = parameter("N s/m", 400.0)
    line_out = parameter("m", 5.0)
    line_in = parameter("m", 0.0)
    paid_out = given("m")
    speed = given("m/s")

    def check(self) -> None:
        """Every parameter above 0, but dead_band, line_out and line_in 0 or more."""
        for name, variable in self.variables.items():
            if variable.causality.value != "parameter":
                continue
            may_be_zero = name in ("dead_band", "line_out", "line_in")
            value = self.memory[name]
            if not (value > 0.0 or (may_be_zero and value == 0.0)):
                raise ValueError(
                    f"{name} is {value:g} {variable.unit}, allowed: {'0 or more' if may_be_zero else 'above 0'}"
                )

    def advance(self, time: float, step_size: float) -> None:
        """Brake or drive, then the ends of the line."""
        if self.brake > 0.5:
            self.speed = max(0.0, self.tension - self.brake_holding) / self.brake_slip
            moved = self.speed * step_size
        else:
            wanted, kept = self._wanted_speed(), math.exp(-step_size / self.response_time)
            moved = wanted * step_size + (self.speed - wanted) * self.response_time * (1.0 - kept)
            self.speed = wanted + (self.speed - wanted) * kept
        reached = min(max(self.paid_out + moved, -self.line_in), self.line_out)
        if reached != self.paid_out + moved:
            self.speed = 0.0
        self.paid_out = reached

    def _wanted_speed(self) -> float:
        """v* of the drive [m/s]."""
        if self.constant_tension > 0.5:
            excess = self.tension - self.tension_order
            if abs(excess) <= self.dead_band:
                return 0.0
            return self.maximum_speed * min(max(excess / self.tension_band, -1.0), 1.0)
        speed = min(max(self.speed_order, -self.maximum_speed), self.maximum_speed)
        return speed if speed >= 0.0 else speed * max(0.0, 1.0 - self.tension / self.stall_pull)
