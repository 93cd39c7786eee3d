"""The page in a real browser: an instructor and two crews steer at once, a browser that is killed comes back, and all can read it.

It needs Playwright, axe, and a Chromium of the system; without one of them it is left out, and says so.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.scenarios.conduct.consoles import Console, console
from tests.scenarios.conduct.test_console import TOW

sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed: apt-get install chromium")

PATIENCE = 120_000  # [ms]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Console]:
    with console(tmp_path_factory.mktemp("browser"), TOW, "--pace", "2") as one:
        yield one


def browser(player: sync_api.Playwright) -> sync_api.Browser:
    return player.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])


def opened(one: sync_api.Browser, served: Console, role: str, *, checked: bool = False) -> sync_api.Page:
    """Open a page in a context of its own; one that axe checks must let it in."""
    page = one.new_context(bypass_csp=checked, viewport={"width": 1280, "height": 800}).new_page()
    page.set_default_timeout(PATIENCE)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on(
        "request",
        lambda asked: asked.url.startswith((f"http://{served.host}/", "blob:", "data:")) or faults.append(asked.url),
    )
    page.goto(served.addresses[role])
    page.faults = faults  # type: ignore[attr-defined]
    sync_api.expect(page.locator("#phase")).to_have_text("paused" if checked else "running", timeout=PATIENCE)
    return page


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_an_exercise_is_conducted_in_a_browser(served: Console) -> None:
    expect = sync_api.expect
    expect.set_options(timeout=PATIENCE)
    with sync_api.sync_playwright() as player:
        first, second = browser(player), browser(player)
        instructor = opened(first, served, "instructor", checked=True)
        for page in (instructor, opened(first, served, "port", checked=True)):
            found = axe.Axe().run(page).response["violations"]
            assert [
                (one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")
            ] == []
        instructor.keyboard.press("Space")
        expect(instructor.locator("#phase")).to_have_text("running")
        expect(instructor.get_by_role("button", name="Pause")).to_be_visible()
        crews = [opened(second, served, name) for name in ("port", "starboard")]
        for page, key in zip(crews, ("ArrowRight", "ArrowLeft"), strict=True):
            page.keyboard.press(key)
            page.keyboard.press("ArrowUp")
            page.get_by_role("button", name="Order", exact=True).click()
        log = instructor.locator("#log")
        expect(log).to_contain_text("port: make 0.68 kn over the ground, heading 095")
        expect(log).to_contain_text("starboard: make 0.68 kn over the ground, heading 085")
        expect(crews[0].locator("#log")).to_contain_text("starboard: make 0.68 kn")
        instructor.locator("#part-main").fill("4")
        instructor.get_by_role("button", name="Part", exact=True).click()
        expect(log).to_contain_text("boom main parts at joint 4")
        time = instructor.locator("#time").inner_text()
        first.close()  # as if it were killed: the run goes on
        expect(crews[1].locator("#phase")).to_have_text("running")
        back = opened(browser(player), served, "instructor")
        expect(back.locator("#log")).to_contain_text("boom main parts at joint 4")
        assert back.locator("#time").inner_text() > time
        back.get_by_role("button", name="End").click()
        expect(back.locator("#phase")).to_have_text("ended")
        for page in (*crews, back):
            assert page.faults == []  # type: ignore[attr-defined]


def test_the_page_is_served_from_the_package_alone() -> None:
    page = Path(__file__).parents[3] / "scenarios" / "conduct" / "page"
    for file in page.glob("*.*"):
        text = file.read_text(encoding="utf-8")
        assert "https://" not in text
        assert "http://" not in text
