"""Numbers and plans that no water, oil or crew can have: refused, or told, in the units in which they were written."""

from __future__ import annotations

import pytest

from scenarios.cli import main


@pytest.mark.parametrize(
    ("scenario", "settings", "told"),
    [
        ("u-sweep", ["tow.speed_kn=50"], "tow.speed_kn is 50, allowed: 0 or more and at most 38.87 kn"),
        ("u-sweep", ["tow.speed_kn=fast"], "tow.speed_kn is 'fast', allowed: a number, 0 or more and at most 38.87 kn"),
        ("u-sweep", ["tow.heading_deg=1e20"], "tow.heading_deg is 1e+20, allowed: magnitudes up to 1e+12"),
        ("still-column", ["tank.upper=[1, nan, 1]"], "tank.upper.1 is nan, allowed: finite, in m"),
        (
            "still-column",
            ["phases.water.color=[0, -1, 0, 0]"],
            "phases.water.color.1 is -1, allowed: 0 or more and at most 255",
        ),
        (
            "inlet-exclusion",
            ["sea.current='0.2 kn'"],
            "sea.current is '0.2 kn', allowed: a table with kind = one of 'steady', 'tide', 'file'",
        ),
        (
            "still-column",
            ["tank.open=['z']"],
            "tank.open.0 is 'z', did you mean '+z' or '-z'? allowed: '-x', '+x', '-y', '+y', '-z', '+z'",
        ),
        ("calm-spread", ["tank.open=['+z', '+z']"], "tank.open has '+z' twice, allowed: each once"),
        (
            "calm-spread",
            ["fluid.particle_spacing=30"],
            "fill.ocean has no particle at fluid.particle_spacing = 30 m, allowed: a larger region, "
            "or a smaller spacing",
        ),
        (
            "two-layer",
            ["fill.more={shape='slab', phase='water', bottom=0.0, top=0.5}"],
            "fill.oil is covered by fill.more, which comes later; allowed: the other order, or places of its own",
        ),
        (
            "floating-box",
            ["bodies.box.position=[0, 0, -50]"],
            "bodies.box has body 'box' outside the tank at the start, by 50.2 m, allowed: inside it",
        ),
        (
            "inlet-exclusion",
            ["booms.main.stream_deg=180"],
            "booms.main cannot be laid: its ends lie 0 % of its length apart across the stream, from "
            "left to right, allowed: above 0.1 %; no boom hangs between ends that lie in line with the stream",
        ),
        (
            "still-column",
            ["phases.water.density=1.027"],
            "phases.water.density is 1.027 kg/m3, allowed of a liquid: 100 kg/m3 or more; sea water has 1025",
        ),
        (
            "still-column",
            ["phases.water.density=1e11"],
            "phases.water.density is 100000000000.0, allowed: above 0 and at most 25000 kg/m3",
        ),
        (
            "still-column",
            ["phases.water.dynamic_viscosity=1e12"],
            "phases.water.dynamic_viscosity is 1000000000000.0, allowed: 0 or more and at most 1e+09 Pa s",
        ),
        (
            "still-column",
            ["fluid.gravity=[0, 0, 9.81]"],
            "fluid.gravity is [0.0, 0.0, 9.81], allowed: 0 or less along z, which points up",
        ),
        (
            "still-column",
            ["fluid.gravity=[0, 0, -1e9]"],
            "fluid.gravity.2 is -1000000000.0, allowed: -1000 or more and at most 1000 m/s2",
        ),
        (
            "inlet-exclusion",
            ["booms.main.area=[[0, 0], [1, 1], [1, 0], [0, 1]]"],
            "booms.main.area crosses or touches itself, allowed: corners in their order round the water",
        ),
        (
            "inlet-exclusion",
            ["fill.slick.lower=[-16, -3, 4.0]", "fill.slick.upper=[16, 28, 5.0]"],
            "fill.slick reaches from z = 4 to 5 m, allowed of "
            "oil without particles: a top within 1 m of the water's surface, 0 m",
        ),
        (
            "u-sweep",
            ["injects.x={at=1, orders=['tow.speed_kn=0.2', 'tow.speed=0.4']}"],
            "injects.x.orders has tow.speed, which is given beside tow.speed_kn, allowed: one of the two",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_words(
    scenario: str, settings: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", scenario, *(word for setting in settings for word in ("--set", setting))]) == 2
    assert told in [line.strip() for line in capsys.readouterr().err.splitlines()]


@pytest.mark.parametrize("fidelity", ["fine", "none"])
def test_check_tells_what_comes_after_the_end(fidelity: str, capsys: pytest.CaptureFixture[str]) -> None:
    late = ["--set", "tow.start=70", "--set", "injects.x={at=80, spread=5, orders=['tow.speed_kn=0.2']}"]
    late += ["--set", "emitters.leak={phase='oil', mouth=[6.0, 2.5, 0.8], radius=0.1, speed=0.1, start=90}"]
    assert main(["check", "u-sweep", "--until", "60", *late, "--set", f"fidelity={fidelity}"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "tow.start is 70 s: the vessels never get under way, as the run ends at 60 s (run.duration)" in told
    assert "injects.x.at is 80 s: it never comes, as the run ends at 60 s (run.duration)" in told
    assert "emitters.leak.start is 90 s: nothing flows, as the run ends at 60 s (run.duration)" in told
