"""The autopilot on a body that moves in the plane: it reaches its orders, holds them against a pull, and stays within its limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from docs.fmus.autopilot import Autopilot

STEP, MASS, INERTIA = 0.02, 50.0, 4.0


class Ship:
    """m du/dt = thrust - k u |u| - pull; I dr/dt = moment - c r + twist."""

    def __init__(self, pull: float = 0.0, twist: float = 0.0, **settings: float) -> None:
        self.pilot = Autopilot()
        self.speed, self.heading, self.turn_rate = 0.0, 0.0, 0.0
        self.pull, self.twist = pull, twist
        for name, value in ({"mass": MASS, "yaw_inertia": INERTIA} | settings).items():
            self.pilot.set(name, np.array([value]))
        self.pilot.enter_initialization_mode(0.0)
        self.pilot.exit_initialization_mode()

    def run(self, seconds: float) -> Ship:
        for k in range(round(seconds / STEP)):
            for name, value in (
                ("vessel_speed", self.speed),
                ("heading", math.remainder(self.heading, 2.0 * math.pi)),
                ("turn_rate", self.turn_rate),
            ):
                self.pilot.set(name, np.array([value]))
            self.pilot.do_step(k * STEP, STEP)
            drag = 20.0 * self.speed * abs(self.speed)
            self.speed += STEP / MASS * (self.pilot.thrust - drag - self.pull)
            self.turn_rate += STEP / INERTIA * (self.pilot.yaw_moment - 2.0 * self.turn_rate + self.twist)
            self.heading += STEP * self.turn_rate
        return self


def test_orders_are_reached_and_held_against_steady_forces() -> None:
    ship = Ship(pull=10.0, twist=1.0, speed_order=0.6, heading_order=1.2).run(120.0)
    assert ship.speed == pytest.approx(0.6, abs=1e-3)
    assert ship.heading == pytest.approx(1.2, abs=1e-3)
    assert ship.pilot.thrust == pytest.approx(10.0 + 20.0 * 0.36, rel=1e-2)
    assert ship.pilot.yaw_moment == pytest.approx(-1.0, rel=2e-2)


def test_it_turns_the_short_way() -> None:
    ship = Ship(heading_order=math.radians(-170.0))
    ship.heading = math.radians(170.0)
    ship.run(60.0)
    assert ship.heading == pytest.approx(math.radians(190.0), abs=1e-2)


def test_limits_hold_and_nothing_winds_up() -> None:
    ship = Ship(pull=30.0, speed_order=1.0, acceleration=100.0, maximum_thrust=25.0)
    ship.run(30.0)
    assert ship.pilot.thrust == 25.0
    ship.pull = 0.0
    speeds = [ship.run(1.0).speed for _ in range(40)]
    assert max(speeds) < 1.1  # an integral that had grown all the while would drive it far beyond
    assert speeds[-1] == pytest.approx(1.0, abs=0.01)


def test_orders_are_approached_at_the_set_rates() -> None:
    ship = Ship(speed_order=1.0, heading_order=2.0, acceleration=0.05, maximum_turn_rate=0.1).run(10.0)
    assert ship.pilot.memory["speed_now"] == pytest.approx(0.5)
    assert ship.pilot.memory["heading_now"] == pytest.approx(1.0)


def test_switched_off_it_gives_nothing_and_takes_over_smoothly() -> None:
    ship = Ship(speed_order=1.0, heading_order=1.0, engaged=0.0).run(5.0)
    assert (ship.pilot.thrust, ship.pilot.yaw_moment) == (0.0, 0.0)
    ship.pilot.set("engaged", np.array([1.0]))
    ship.run(STEP)
    assert abs(ship.pilot.thrust) < 1.0
    assert abs(ship.pilot.yaw_moment) < 0.5


def test_impossible_settings_are_refused() -> None:
    with pytest.raises(ValueError, match="mass is -1 kg, allowed: above 0"):
        Ship(mass=-1.0)
