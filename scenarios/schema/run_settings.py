"""Run, recording, probes, camera and site of a scenario, and its training side: group, learning goal, brief and notes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import ClassVar, Literal

from oilsim.core.quantity import quantity
from recordings.model.exercise import Site
from scenarios.schema.parsing.quantity_fields import Point2, Section, Vector
from scenarios.text.problems import Problem

Level = Literal["easy", "normal", "hard"]
Fidelity = Literal["live", "fine", "none"]
SHORTEST_STEP = 1e-6  # [s] of communication, a thousandth of what impacts need
LONGEST_BRIEF = 4000  # [1] letters; a printed page has some 60 lines of 70
Group = Literal["sweeping", "containment", "protection", "deployment", "trial"]
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
class ChartSettings(Section):
    """An image of a chart, which the console's plan and the debrief's map show under all else; the run does not use it.

    file    PNG or JPEG
    points  two or more points of it whose place is known, far apart, each [pixel x, pixel y, longitude, latitude]: pixels right of and
            below the image's upper left corner, WGS 84 in degrees. The chart is laid so that it turns and grows, but is not sheared
    """

    file: str
    points: tuple[tuple[float, float, float, float], ...] = quantity("pixels and degrees")

    def problems(self) -> Iterator[Problem]:
        """Check that there are two points."""
        if len(self.points) < 2:
            yield Problem("points", f"has {len(self.points)} points, allowed: 2 or more")


@dataclass(frozen=True, kw_only=True)
class SiteSettings(Section):
    """Place of the exercise on Earth, for far-field models that continue from its recording; the run itself does not use it.

    latitude, longitude  of the world's origin, WGS 84
    bearing              [rad] of the x axis, clockwise from north
    start                date and time of the start, ISO 8601, such as 2026-05-01T08:00:00Z
    chart                under plans and maps
    """

    latitude: float = quantity("degrees north", at_least=-89.0, at_most=89.0)
    longitude: float = quantity("degrees east", at_least=-180.0, at_most=360.0)
    bearing: float = quantity("rad", default=0.5 * math.pi, at_least=-2.0 * math.pi, at_most=2.0 * math.pi)
    start: str = "2000-01-01T00:00:00Z"
    chart: ChartSettings | None = None

    @property
    def recorded(self) -> Site:
        """The site in sailors' units, as recordings have it, without its chart."""
        return Site(
            latitude=self.latitude, longitude=self.longitude, bearing=math.degrees(self.bearing), start=self.start
        )

    def problems(self) -> Iterator[Problem]:
        """Check that the start is a date and time."""
        try:
            datetime.fromisoformat(self.start)
        except ValueError:
            yield Problem("start", f"is {self.start!r}, allowed: ISO 8601, for example 2026-05-01T08:00:00Z")


@dataclass(frozen=True, kw_only=True)
class ExerciseSettings(Section):
    """An exercise for crews; it changes nothing in the run.

    group  under which `oilsim list` shows it: "sweeping", "containment", "protection", "deployment" or "trial"
    goal   what a trainee can do afterwards, in one sentence
    brief  text for the trainee, a page: situation, task, means, and how it is graded
    notes  text for the instructor: what to look at, what to say, what usually goes wrong, and the variants
    needs_orders  whether who gives no order has not passed, as where `oilsim conduct` lets vessels and skimmers begin at rest
    """

    group: Group
    goal: str
    brief: str = ""
    notes: str = ""
    needs_orders: bool = False

    def problems(self) -> Iterator[Problem]:
        """Check that there is a goal, and that the brief is a page."""
        if not self.goal.strip():
            yield Problem("goal", "is empty, allowed: one sentence")
        if len(self.brief) > LONGEST_BRIEF:
            text = f"has {len(self.brief)} letters, allowed: up to {LONGEST_BRIEF}, a page"
            yield Problem("brief", text)


@dataclass(frozen=True, kw_only=True)
class PressureProbe(Section):
    """Pressure [Pa] at a point, as a transducer in a wall measures it."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "pressure")
    point: Vector = quantity("m")


@dataclass(frozen=True, kw_only=True)
class WaveGauge(Section):
    """Height of the liquid's surface [m] over a point (x, y), without spray; the tank's floor where it is dry."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "wave-gauge")
    point: Point2 = quantity("m")


@dataclass(frozen=True, kw_only=True)
class VelocityProbe(Section):
    """Velocity of the liquid [m/s] at a point: series x, y, z."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "velocity")
    point: Vector = quantity("m")


@dataclass(frozen=True, kw_only=True)
class BodyProbe(Section):
    """Pose of a body and the fluid's force on it: series x, y, z [m], roll, pitch, yaw [deg], force and torque."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "body")
    body: str


Probe = PressureProbe | WaveGauge | VelocityProbe | BodyProbe
