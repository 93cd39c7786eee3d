"""The events beside the diagrams: which of many are shown, and in which order."""

from __future__ import annotations

from matplotlib.figure import Figure

from recordings.model.frame import Event
from recordings.pictures.picture import draw_events


def shown(events: list[Event]) -> list[str]:
    """Return the texts that are written, without the numbers at the axis."""
    axes = Figure().subplots()
    draw_events(axes, events, (0.0, 100.0))
    return [text.get_text() for text in axes.texts if " s " in text.get_text()]


def test_losses_are_shown_whatever_is_ordered_after_them() -> None:
    orders = [Event(10.0 * k, "make 1 kn", source="orders") for k in range(1, 8)]
    loss = Event(25.0, "has lost more than 0.5 % of its oil", "warning", "boom main")
    inject = Event(5.0, "the wind freshens", "warning", "inject wind")
    told = shown([inject, *orders[:2], loss, *orders[2:]])
    assert [text.partition(" s ")[0] for text in told] == ["5.0", "25.0", "60.0", "70.0"]
    assert "has lost" in told[1]


def test_of_equally_urgent_events_the_last_are_shown() -> None:
    told = shown([Event(float(k), f"event {k}") for k in range(9)])
    assert [text.split()[-1] for text in told] == ["5", "6", "7", "8"]


def test_urgency_goes_by_level_and_source() -> None:
    levels = {
        ("info", "boom main"): 0,
        ("warning", "fluid"): 1,
        ("error", ""): 1,
        ("warning", "boom main"): 2,
        ("error", "boom a"): 2,
    }
    assert {key: Event(0.0, "", *key).urgency for key in levels} == levels
