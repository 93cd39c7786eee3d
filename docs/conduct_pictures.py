"""Draw the pictures of the guide "Conduct an exercise": the instructor's page and a crew's at three moments, and a branch beside its run.

`python docs/conduct_pictures.py [FOLDER]` needs Playwright and a Chromium. It writes instructor-1.webp and more into docs/pictures/conduct.
"""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright import sync_api

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

from tests.scenarios.conduct.browsers import browser  # noqa: E402
from tests.scenarios.conduct.consoles import TOW, console  # noqa: E402

PATIENCE = 300_000  # [ms]
WEATHER = """
sea.waves = {kind = "regular", height = 0.25, period = 3.0, direction_deg = 200.0}
sea.wind = {kind = "steady", speed = 6.0, direction_deg = 200.0}

[vessels]
"""
EXERCISE = (
    TOW.replace("\n[vessels]\n", WEATHER, 1)
    .replace("Two vessels tow a boom", "Two launches sweep oil with 24 m of boom")
    .replace("checkpoint_interval = 0", "checkpoint_interval = 10")  # from which a branch goes on
)


def shoot(page: sync_api.Page, path: Path) -> None:
    """Save what a page shows."""
    image = Image.open(io.BytesIO(page.screenshot(timeout=PATIENCE)))
    image.convert("RGB").save(path, quality=88, method=6)
    print(path, f"{path.stat().st_size / 1e3:.0f} kB")


def run_to(page: sync_api.Page, seconds: float) -> None:
    """Let the run go on to a time [s], and pause it there."""
    page.evaluate("conduct.link.give('pace', { value: null }).then(() => conduct.link.give('go-on'))")
    page.wait_for_function(f"conduct.state.time >= {seconds}", timeout=PATIENCE)
    page.evaluate("conduct.link.give('pause')")
    sync_api.expect(page.locator("#phase")).to_have_text("paused", timeout=PATIENCE)


def opened(one: sync_api.Browser, address: str, width: int) -> sync_api.Page:
    """Open a page."""
    page = one.new_context(bypass_csp=True, viewport={"width": width, "height": 860}).new_page()
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    sync_api.expect(page.locator("#phase")).to_have_text("paused", timeout=PATIENCE)
    return page


def draw_both(instructor: sync_api.Page, crew: sync_api.Page, folder: Path) -> None:
    """Draw the crew's page before the run, and plan and 3-D view side by side; 3-D drawing takes a whole processor."""
    shoot(crew, folder / "crew-1.webp")
    instructor.get_by_role("tab", name="Both").click()
    words = instructor.frame_locator("#view-scene iframe").locator("#words")
    sync_api.expect(words).to_be_hidden(timeout=PATIENCE)
    run_to(instructor, 12.0)
    instructor.wait_for_timeout(15_000)
    shoot(instructor, folder / "instructor-1.webp")
    instructor.close()


def draw(instructor: sync_api.Page, crew: sync_api.Page, folder: Path) -> None:
    """Draw the pages at the moments after that."""
    crew.keyboard.press("ArrowLeft")
    crew.keyboard.press("ArrowLeft")
    crew.get_by_role("button", name="Order", exact=True).click()
    instructor.keyboard.press("m")
    run_to(instructor, 45.0)
    shoot(instructor, folder / "instructor-2.webp")
    shoot(crew, folder / "crew-2.webp")
    crew.get_by_role("slider", name="Thrust").fill("40")
    crew.get_by_role("slider", name="Rudder").fill("-15")
    crew.get_by_role("button", name="Take the levers").click()
    run_to(instructor, 60.0)
    crew.get_by_role("button", name="Take the levers").scroll_into_view_if_needed()
    shoot(crew, folder / "crew-3.webp")
    instructor.get_by_role("button", name="Debrief", exact=True).click()
    sync_api.expect(instructor.locator("#view-debrief iframe")).to_have_count(1, timeout=PATIENCE)
    instructor.wait_for_timeout(5000)
    shoot(instructor, folder / "instructor-3.webp")
    instructor.locator("#what-if-orders").fill("tow.speed_kn=0.4")
    instructor.get_by_role("button", name="Try").click()
    sync_api.expect(instructor.locator("#view-debrief iframe")).to_have_count(2, timeout=2 * PATIENCE)
    instructor.wait_for_timeout(5000)
    shoot(instructor, folder / "debrief.webp")


def main(folder: Path) -> None:
    """Draw all pictures."""
    with (
        tempfile.TemporaryDirectory() as place,
        console(Path(place), EXERCISE, has_scene=True) as one,
        sync_api.sync_playwright() as player,
    ):
        program = browser(player)
        crew = opened(program, one.addresses["port"], 1100)
        draw_both(opened(program, one.addresses["instructor"], 1360), crew, folder)
        draw(opened(program, one.addresses["instructor"], 1360), crew, folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "pictures" / "conduct")
