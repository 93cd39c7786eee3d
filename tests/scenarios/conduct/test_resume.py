"""A console that was killed goes on from its recording: with its orders, its log and its marks, and it can go back before the kill."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from recordings.replay.joined import JoinedReplay
from tests.scenarios.conduct.consoles import TOW, console


def _killed(folder: Path, left: Path) -> float:
    """Conduct a run, and leave in `left` the files that were on the disk at some moment; return the time [s] of its mark."""
    with console(folder, TOW, "--pace", "10") as one, one.page("instructor") as page:
        page.give("go-on")
        page.hear(lambda told: told.state["time"] > 1.0)
        page.give("order", settings=["tow.speed_kn=0.3"])
        page.give("mark", name="before the slick")
        page.hear(lambda told: bool(told.told["session"]["marks"]))
        (mark,) = page.told["session"]["marks"]
        page.hear(lambda told: told.state["time"] > mark["time"] + 4.0)
        shutil.copytree(folder / "whole.checkpoints", left / "whole.checkpoints")
        shutil.copyfile(folder / "whole.rrd", left / "whole.rrd")
    return float(mark["time"])


@pytest.mark.timeout(300)
def test_a_killed_console_goes_on_where_its_recording_ends(tmp_path: Path) -> None:
    first, left, second = (tmp_path / name for name in ("first", "left", "second"))
    for folder in (first, left, second):
        folder.mkdir()
    marked = _killed(first, left)
    end = max(series.time[-1] for series in JoinedReplay(left / "whole.rrd").scalars.values())
    assert (
        end >= marked - 1e-6
    )  # [s] times of a recording are whole nanoseconds; a mark is written at once, what follows it within seconds
    with console(second, TOW, resumed=left / "whole.rrd") as one, one.page("instructor") as page:
        page.hear(lambda told: bool(told.lines) and told.state["paused"])
        assert page.state["time"] == pytest.approx(end, abs=1e-6)
        assert page.state["tow"]["speed"] == pytest.approx(0.3 * 1852 / 3600)
        assert "before the slick" in " ".join(line["words"] for line in page.lines)
        (mark,) = page.told["session"]["marks"]
        assert mark == {"name": "before the slick", "time": pytest.approx(marked), "recording": "whole.rrd"}
        assert page.give("step")["told"].startswith("makes a step")
        assert page.give("branch", time=mark["time"], recording="whole.rrd", settings=[])["told"].startswith(
            "goes back"
        )
        page.hear(lambda told: told.told["session"]["run"] == 2 and told.state["time"] == pytest.approx(marked))
