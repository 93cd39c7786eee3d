"""Run, recording, camera and site of a scenario."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from oilsim.core.quantity import quantity
from scenarios.schema.parsing.quantity_fields import Section, Vector
from scenarios.text.problems import Problem

Level = Literal["easy", "normal", "hard"]
Fidelity = Literal["live", "fine", "none"]
SHORTEST_STEP = 1e-6  # [s] of communication, a thousandth of what impacts need
MOST_STEPS = 1e9  # communication steps of a run: a year at 30 a second; their times are still told apart


@dataclass(frozen=True, kw_only=True)
class RunSettings(Section):
    """Duration and steps of a run.

    duration            [s] simulated
    communication_step  [s] after which fluid, bodies and controllers exchange values; where bodies move, the fluid's steps are not longer
    threads             number of threads of the fluid; the default is all cores
    seed                of everything random: gusts, waves, and when injects come
    budget              true: the summary gives the changes of the liquid's energy and momentum by cause (`oilsim.accounts.ledger`), with
                        energy_residual and momentum_residual, the shares without a cause; false: all three are null
    """

    duration: float = quantity("s", at_least=SHORTEST_STEP, at_most=1e8)
    communication_step: float = quantity("s", default=0.01, at_least=SHORTEST_STEP, at_most=1.0)
    threads: int | None = quantity("", default=None, at_least=1, at_most=1024, whole=True)
    seed: int = quantity("", default=1, at_least=0, whole=True)
    budget: bool = False

    def problems(self) -> Iterator[Problem]:
        """Check that a run has at least one step, and not more than can be counted, written and waited for."""
        if self.communication_step > self.duration:
            yield Problem(
                "communication_step", f"is {self.communication_step:g} s, allowed: up to duration = {self.duration:g} s"
            )
        elif self.duration / self.communication_step > MOST_STEPS:
            steps = f"{self.duration / self.communication_step:.3g} steps in duration = {self.duration:g} s"
            least = f"{self.duration / MOST_STEPS:g} s or more"
            yield Problem(
                "communication_step", f"is {self.communication_step:g} s, which makes {steps}, allowed: {least}"
            )


@dataclass(frozen=True, kw_only=True)
class RecordingSettings(Section):
    """The contents of the recording, and how often the whole state is saved beside it.

    frame_rate           frames a simulated second
    precision            [m] particles are recorded on a grid of the next power of two that is not coarser; 0: with every bit;
                         by default a 32nd of the particle spacing, so that no particle is shown off its place by more than a 64th
    checkpoint_interval  [s] simulated, after which the whole state is saved beside the recording, so that the run can go on from
                         there; 0: only when asked for by SIGUSR1, and at the end; by default 1 s, and 10 s in a run without particles,
                         in which saving takes longer than simulating a second
                         When there would be more than 100, every second one is deleted and the interval doubles; the first and the
                         last stay, and so do those that were asked for: --at reaches every time as before, from farther back

    Water is recorded in every second frame of a scenario with oil.
    """

    frame_rate: float = quantity("1/s", default=30.0, above=0.0, at_most=1e6)
    precision: float | None = quantity("m", default=None, at_least=0.0)
    checkpoint_interval: float | None = quantity("s", default=None, at_least=0.0)


@dataclass(frozen=True, kw_only=True)
class CameraSettings(Section):
    """The opening view: `eye` looks at `target` [m]."""

    eye: Vector = quantity("m")
    target: Vector = quantity("m")

    def problems(self) -> Iterator[Problem]:
        """Check that the camera looks at another point."""
        if self.eye == self.target:
            yield Problem("target", f"is {self.target}, allowed: another point than eye")


@dataclass(frozen=True, kw_only=True)
class SiteSettings(Section):
    """Place of the exercise on Earth, for far-field models that continue from its recording; the run itself does not use it.

    latitude, longitude  of the world's origin, WGS 84
    bearing              [rad] of the x axis, clockwise from north
    start                date and time of the start, ISO 8601, such as 2026-05-01T08:00:00Z
    """

    latitude: float = quantity("degrees north", at_least=-89.0, at_most=89.0)
    longitude: float = quantity("degrees east", at_least=-180.0, at_most=360.0)
    bearing: float = quantity("rad", default=0.5 * math.pi, at_least=-2.0 * math.pi, at_most=2.0 * math.pi)
    start: str = "2000-01-01T00:00:00Z"

    def problems(self) -> Iterator[Problem]:
        """Check that the start is a date and time."""
        try:
            datetime.fromisoformat(self.start)
        except ValueError:
            yield Problem("start", f"is {self.start!r}, allowed: ISO 8601, for example 2026-05-01T08:00:00Z")
