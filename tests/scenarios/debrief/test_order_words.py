"""Words of the deck: orders, courses, forces, volumes; never an exponent, and courses by the compass."""

from __future__ import annotations

import math

import pytest

from recordings.model.words import cause_in_words, course_in_words, force_in_words, three_figures, volume_in_words
from scenarios.debrief.order_words import order_in_words

EAST = 0.5 * math.pi


@pytest.mark.parametrize(
    ("order", "words"),
    [
        ("orders tow.speed=0.36", "tow at 0.70 kn"),
        ("orders tow.speed_kn=0.5 tow.heading_deg=90", "tow at 0.50 kn; tow heading 000"),
        ("orders sea.wind.speed_kn=20 sea.wind.from_compass=225", "wind 20 kn; wind from 225"),
        ("orders sea.wind.direction=0", "wind from 270"),
        ("orders sea.current.toward_compass=10", "current towards 010"),
        ("orders sea.waves.height=0.5 emitters.leak.speed=0", "waves 0.5 m high; pipe leak shut"),
        ("orders vessels.port.legs=[]", "a new course for port"),
        (
            "orders vessels.port.hauled=1.5 vessels.tug.hauled=-2",
            "tow line of port: 1.5 m shorter; tow line of tug: 2.0 m longer",
        ),
        (
            "orders skimmers.brush.running=true skimmers.brush.nameplate=40",
            "skimmer brush starts; skimmer brush pumps 40 m³/h at most",
        ),
        ("orders skimmers.brush.running=false", "skimmer brush stops"),
        ("orders vessels.tug.engine=stopped", "the engine of tug has stopped"),
        ("orders 'vessels.tug.engine=port stopped'", "the port engine of tug has stopped"),
        ("orders vessels.tug.engine=running", "the engine of tug runs again"),
        ("orders vessels.port.hauled=0", "tow line of port: as it was laid"),
        (
            "orders booms.main.tow_line=20 injects.storm.given=true",
            "tow lines of boom main: 20.0 m; the inject storm is given",
        ),
        (
            "orders vessels.port.legs=[{speed=0,heading=0,by_hand=[0.5,-0.2]}]",
            "port: 50 % ahead, 20 % rudder to starboard, by hand",
        ),
        (
            "orders vessels.port.legs=[{speed=0,heading=0,by_hand=[-1,0]}]",
            "port: 100 % astern, rudder amidships, by hand",
        ),
        (
            "orders 'emitters.leak={phase=\"oil\",mouth=[1,2,0.3],radius=0.1,speed=0.5305,volume=1.0}'",
            "pipe leak releases 1 m3 within 60 s",
        ),
        ("orders vessels.port.engine=stopped", "the engine of port has stopped"),
        ("orders 'vessels.port.engine=port stopped'", "the port engine of port has stopped"),
        ("orders vessels.port.engine=running", "the engine of port runs again"),
        ("orders 'booms.main.parted=[5,20]'", "boom main parts at joints 5 and 20"),
        ("orders run.duration=5", "run.duration=5"),
        ("the exercise is stopped", "the exercise is stopped"),
    ],
)
def test_orders_are_told_in_knots_and_compass_courses(order: str, words: str) -> None:
    assert order_in_words(order, EAST) == words


def test_courses_turn_with_the_site() -> None:
    assert [course_in_words(direction, EAST) for direction in (0.0, 0.5 * math.pi, math.pi, 0.75 * math.pi)] == [
        "090",
        "000",
        "270",
        "315",
    ]
    assert course_in_words(0.0, 0.0) == "000"
    assert course_in_words(math.radians(90.3), EAST) == "000"  # 359.7 degrees are written as north
    assert order_in_words("orders tow.heading_compass=30", 0.0) == "tow heading 030"


def test_figures_have_no_exponents() -> None:
    assert [three_figures(x) for x in (237836.3, 16600.0, 12.34, 0.01234, 0.0, -3.0, 999.7, 5.55e-17)] == [
        "238,000", "16,600", "12.3", "0.0123", "0", "-3", "1,000", "0"
    ]  # fmt: skip
    assert (
        volume_in_words(237.8363) == "238 m3"
        and volume_in_words(0.24) == "240 litres"
        and volume_in_words(23783.6) == "23,800 m3"
    )
    assert (
        force_in_words(16600.0) == "16.6 kN (1.69 t)"
        and force_in_words(250.0) == "0.25 kN"
        and force_in_words(60.0) == "60 N"
    )
    assert cause_in_words("around_ends") == "swept past the boom's end" and cause_in_words("of_old") == "of old"
