"""A tow winch: a drum whose drive gives way, a brake that slips, and rendering and recovering by tension.

x [m] is the paid-out line, counted from the drum's position at the start, positive outward, and hauled = -x; v [m/s] the speed of the
line at the drum; T [N] the tension:

    brake set:           v = max(0, T - brake_holding) / brake_slip
    constant tension:    v* = maximum_speed clip((T - tension_order) / tension_band, -1, 1), 0 within the dead band
    by hand:             v* = clip(speed_order, -maximum_speed, maximum_speed); while hauling in, times 1 - T / stall_pull
    drive, brake free:   response_time dv/dt = v* - v, solved exactly over a step

Above the ordered tension the winch renders (pays out), below it the winch recovers (hauls in). The drum stops when its line is fully
out (`line_out`) or in (`line_in`). The slipping brake only pays out.
"""

from __future__ import annotations

import math

from coupling.fmu.scalar_model import ScalarModel, given, parameter, taken


class TowWinch(ScalarModel):
    """A tow winch with a brake that slips and a drive that renders and recovers.

    `brake` and `constant_tension` are switches, on above 0.5; the module has the laws. Raises ValueError for a parameter out of its range.
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
    hauled = given("m")
    speed = given("m/s")

    def check(self) -> None:
        """Raise ValueError for a parameter not above 0; dead_band, line_out and line_in may be 0."""
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
        """Move the line by brake or drive, then stop it at its ends."""
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
        self.paid_out, self.hauled = reached, -reached

    def _wanted_speed(self) -> float:
        """Compute the speed v* [m/s] that the drive aims at."""
        if self.constant_tension > 0.5:
            excess = self.tension - self.tension_order
            if abs(excess) <= self.dead_band:
                return 0.0
            return self.maximum_speed * min(max(excess / self.tension_band, -1.0), 1.0)
        speed = min(max(self.speed_order, -self.maximum_speed), self.maximum_speed)
        return speed if speed >= 0.0 else speed * max(0.0, 1.0 - self.tension / self.stall_pull)
