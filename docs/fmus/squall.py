"""A squall: a wind that freshens to a peak and dies down again, in knots."""

import math

from coupling.fmu.scalar_model import ScalarModel, given, parameter


class Squall(ScalarModel):
    """A squall of the shape base + (peak - base) sin^2, from `start` on for `duration`."""

    base = parameter("kn", 4.0)
    peak = parameter("kn", 20.0)
    start = parameter("s", 1.0)
    duration = parameter("s", 4.0)
    speed = given("kn", 4.0)

    def advance(self, time: float, step_size: float) -> None:
        """The wind at the end of the step."""
        phase = min(max((time + step_size - self.start) / self.duration, 0.0), 1.0)
        self.speed = self.base + (self.peak - self.base) * math.sin(math.pi * phase) ** 2
