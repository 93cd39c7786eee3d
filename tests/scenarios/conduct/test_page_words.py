"""Words and orders that the page's own scripts make of a state; Node runs them, without a browser."""

from __future__ import annotations

import json
import shutil
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest

from scenarios.running.plan import Plan
from scenarios.spec.load import scenario_from
from tests.scenarios.small_tow import small_tow

NODE = shutil.which("node")
PAGE = Path(__file__).parents[3] / "scenarios" / "conduct" / "page"
pytestmark = pytest.mark.skipif(NODE is None, reason="Node is not installed: apt-get install nodejs")


def called(file: str, function: str, *arguments: Any) -> Any:
    """Call a function of one of the page's scripts."""
    text = f"""
        import {{ {function} as called }} from {json.dumps((PAGE / file).as_uri())};
        console.log(JSON.stringify(called(...{json.dumps(arguments)})));
    """
    assert NODE is not None
    done = subprocess.run(
        [NODE, "--input-type=module", "--experimental-default-type=module", "--eval", text],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    ("engine", "words"),
    [
        ("running", ""),
        ("stopped", "engine stopped"),
        ("port stopped", "port engine stopped"),
        ("starboard stopped", "starboard engine stopped"),
    ],
)
def test_each_engine_that_has_stopped_is_shown(engine: str, words: str) -> None:
    assert called("units.js", "engineFault", engine) == words


@pytest.mark.parametrize(
    ("part", "whole", "words"),
    [
        (0.354, 0.354, "354 litres, 100 %"), (0.02, 0.36, "20 litres, 5.56 %"), (1e-5, 2.0, "0.01 litres, 0.0005 %"),
        (0.0, 0.36, "0 litres"), (2.0, 0.0, "2 m³"), (None, 1.0, "–"),
    ],
)  # fmt: skip
def test_shares_are_written_without_exponents(part: float | None, whole: float, words: str) -> None:
    assert called("units.js", "shareOf", part, whole) == words


def test_what_helmsmen_keep_is_written_as_orders_that_a_run_takes() -> None:
    """The field of "what if" begins with them: speed in knots, course by compass; who steers by hand is left out."""
    text = f"""
        import {{ compass, KNOT }} from {json.dumps((PAGE / "units.js").as_uri())};
        import {{ heldOrders, settings }} from {json.dumps((PAGE / "orders.js").as_uri())};
        const state = {{ vessels: {{ port: {{ ordered: {{ speed: 0.5 * KNOT, heading: 0, by_hand: null }} }},
          starboard: {{ ordered: {{ speed: 0, heading: 0, by_hand: [0.5, 0] }} }} }} }};
        console.log(JSON.stringify(settings(heldOrders(state, (way) => compass(way, Math.PI / 2), KNOT) + " sea.wind.speed=5")));
    """
    assert NODE is not None
    command = [NODE, "--input-type=module", "--experimental-default-type=module", "--eval", text]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    held, wind = json.loads(done.stdout)
    assert (held, wind) == ("vessels.port.legs=[{speed_kn=0.50,heading_compass=90}]", "sea.wind.speed=5")
    plan = Plan(scenario=scenario_from(tomllib.loads(small_tow(duration=9.0, communication_step=0.1, frame_rate=10))))
    leg = plan.ordered([held], 0).scenario_at(0).vessels["port"].legs[0]
    assert (leg.speed, leg.heading) == (pytest.approx(0.2572, abs=1e-4), pytest.approx(0.0, abs=1e-9))


@pytest.mark.parametrize(
    ("wind", "direction"),
    [({"speed": 8.0, "direction": 3.0}, 3.0), (None, 0.0), ({"speed": 8.0, "direction": None}, 0.0)],
)
def test_new_waves_run_with_the_wind(wind: dict[str, float] | None, direction: float) -> None:
    weather = {"current": None, "wind": wind, "waves": None}
    (order,) = called("orders.js", "waves", weather, 0.5)
    text = small_tow(duration=9.0, communication_step=0.1, frame_rate=10)
    plan = Plan(scenario=scenario_from(tomllib.loads(text))).ordered([order], 0)
    sea = plan.scenario_at(0).sea
    assert sea is not None and sea.waves is not None
    assert (sea.waves.height, sea.waves.period, sea.waves.direction) == (0.5, 3.5, direction)


def test_waves_that_are_there_only_get_another_height() -> None:
    weather = {
        "wind": {"speed": 8.0, "direction": 3.0},
        "waves": {
            "key": "significant_height",
            "height": 1.0,
            "period": 5.0,
            "direction": 0.0,
            "period_key": "peak_period",
        },
    }
    assert called("orders.js", "waves", weather, 0.5) == ["sea.waves.significant_height=0.5"]
    both = ["sea.waves.significant_height=0.5", "sea.waves.peak_period=4"]
    assert called("orders.js", "waves", weather, 0.5, 4.0) == both
    weather["waves"] = None
    assert called("orders.js", "waves", weather, 0.5) == [
        'sea.waves={kind="regular",height=0.5,period=3.5,direction=3}'
    ]
