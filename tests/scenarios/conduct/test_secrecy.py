"""Secrets and talk: what each page of a console is told, and under whose name it stands in the recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from recordings.replay.recording import Replay
from scenarios.conduct.access import OBSERVER, VESSEL, Role, line_seen
from tests.scenarios.conduct.consoles import TOW, Page, console

SECRETS = (
    TOW
    + """
[exercise]
group = "sweeping"
goal = "The crew keeps the boom."
brief = "Tow the boom."
notes = "The engine of starboard quits."

[injects.quits]
orders = ["vessels.starboard.engine=stopped"]
to = ["starboard"]
text = "The engine coughs and stops"

[injects.parts]
orders = ["booms.main.parted=[4]"]

[injects.veers]
orders = ["sea.current.speed=0.12"]
text = "The stream makes up"
"""
)
SCENE = {
    "bearing": 0.0,
    "vessels": [{"name": "port", "skimmers": ["brush"]}, {"name": "starboard", "skimmers": []}],
    "injects": [{"name": "quits", "text": "It stops", "to": ["starboard"]}, {"name": "parts", "text": "", "to": []}],
}
PORT, STARBOARD, CLASS = Role(VESSEL, "port"), Role(VESSEL, "starboard"), Role(OBSERVER)


def line(text: str, source: str, **more: Any) -> dict[str, Any]:
    return {"time": 1.0, "text": text, "words": text, "level": "warning", "source": source, "mark": None} | more


def words(role: Role, one: dict[str, Any]) -> str | None:
    seen = line_seen(role, one, SCENE)
    return None if seen is None else seen["words"]


def test_a_crew_is_told_what_it_notices_and_nothing_else() -> None:
    told = line("It stops", "inject quits")
    assert [words(role, told) for role in (PORT, STARBOARD, CLASS)] == [None, "It stops", "It stops"]
    assert "quits" not in str(line_seen(STARBOARD, told, SCENE))
    assert words(CLASS, line("parts", "inject parts")) is None
    assert words(PORT, line("orders tow.speed=0.1", "injects", order=True)) is None
    assert words(PORT, line("marks the engine is next", "instructor", order=True, mark="the engine is next")) is None
    assert words(PORT, line("paused", "instructor", order=True)) == "paused"
    assert words(PORT, line("boom main loses oil", "boom main")) == "boom main loses oil"


def test_of_an_order_each_crew_hears_its_part() -> None:
    many = "orders tow.speed=0.5 booms.main.parted=[4] vessels.starboard.engine=stopped skimmers.brush.nameplate=20"
    order = line(many, "instructor", order=True)
    assert words(PORT, order) == "tow at 0.97 kn; skimmer brush pumps 20 m³/h at most"
    assert words(STARBOARD, order) == "tow at 0.97 kn; the engine of starboard has stopped"
    assert words(PORT, line("orders booms.main.parted=[4]", "instructor", order=True)) is None
    by_hand = line("orders tow.speed=0.5 injects.quits.given=true", "instructor", order=True)
    assert words(STARBOARD, by_hand) is None


def _texts(page: Page) -> list[str]:
    return [one["words"] for one in page.lines]


def test_injects_talk_and_names_over_three_pages(tmp_path: Path) -> None:
    with (
        console(tmp_path, SECRETS) as one,
        one.page("instructor") as instructor,
        one.page("port") as port,
        one.page("starboard") as starboard,
    ):
        assert [inject["name"] for inject in instructor.told["scene"]["injects"]] == ["quits", "parts", "veers"]
        assert instructor.told["scene"]["notes"].startswith("The engine of starboard")
        for page in (port, starboard):
            assert page.told["scene"]["brief"] == "Tow the boom."
            assert not {"injects", "notes"} & set(page.told["scene"]) and "given" not in page.state
        instructor.give("introduce", name="Ana")
        port.give("introduce", name="Bo")
        assert "told" in port.give("steer", vessel="port", speed=0.1, heading=0.0, keeps_line=False)
        for name in ("quits", "parts", "veers"):
            assert "told" in instructor.give("order", settings=[f"injects.{name}.given=true"])
        assert "told" in instructor.give("mark", name="after the engine")
        assert "told" in port.give("say", to="starboard", text="we slow down")
        refusals = [port.give("say", to=to, text="hello")["problems"] for to in ("nobody", "port")]
        assert "allowed: all stations, instructor, starboard" in refusals[0][0][1] and refusals[1]
        said = "starboard, this is port, Bo: we slow down"
        for page in (instructor, port, starboard):
            page.hear(lambda page: said in _texts(page))
        assert instructor.told["given"]["injects"] == ["quits", "parts", "veers"]
        for page, noticed in (
            (port, ["The stream makes up"]),
            (starboard, ["The engine coughs and stops", "The stream makes up"]),
        ):
            texts = [
                text
                for text in _texts(page)
                if "inject" in text or text[:4] == "The " or "part" in text or "after" in text
            ]
            assert texts == noticed
            assert not any("injects" in str(line) or line["source"].startswith("inject ") for line in page.lines)
            assert page.told["session"]["marks"] == [] != instructor.told["session"]["marks"]
        ordered = [line for line in starboard.lines if line["source"] == "crew port (Bo)"]
        assert [line["words"][:5] for line in ordered] == ["port:"]
        with one.page("observer") as observer:
            assert "not for observer" in str(observer.give("say", to="port", text="I am not here"))
    events = {(event.source, event.text.split(" ")[0]) for event in Replay(tmp_path / "whole.rrd").events}
    assert {
        ("crew port (Bo)", "orders"),
        ("instructor (Ana)", "orders"),
        ("VHF", "starboard,"),
        ("inject parts", "parts"),
    } <= events
