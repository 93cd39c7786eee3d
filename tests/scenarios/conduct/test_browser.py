"""The page in a real browser: an instructor and two crews steer at once, a browser that is killed comes back, and all can read it.

It needs Playwright, axe, and a Chromium of the system; without one of them it is left out, and says so.
"""

from __future__ import annotations

import io
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from recordings.model.exercise import Site
from scenarios.conduct.server import other_origin
from tests.scenarios.conduct.browsers import CHROMIUM, browser
from tests.scenarios.conduct.consoles import TOW, Console, console
from tests.scenarios.setup.chart_images import chart_text, draw_chart

sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed: apt-get install chromium")

PATIENCE = 120_000  # [ms]
ROOT = Path(__file__).parents[3]
WINCHED = (
    TOW
    + """line_stiffness = 2000.0
winch_speed = 0.5

[injects.engine]
orders = ["vessels.starboard.engine=stopped"]
text = "The starboard engine stops"
"""
)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Console]:
    """A console of the test's own, whose exercise nobody has begun."""
    with console(tmp_path, TOW, "--pace", "2") as one:
        yield one


def opened(
    one: sync_api.Browser, served: Console, role: str, *, checked: bool = False, is_paused: bool = False
) -> sync_api.Page:
    """Open a page in a context of its own; one that axe checks must let it in, without the page's policy."""
    page = one.new_context(bypass_csp=checked, viewport={"width": 1280, "height": 800}).new_page()
    page.set_default_timeout(PATIENCE)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    own = (f"http://{served.host}/", f"{other_origin(served.host)}/", "http://127.0.0.1:", "blob:", "data:")
    page.on("response", lambda answer: answer.url.startswith(own) or faults.append(answer.url))
    page.on("requestfailed", lambda asked: asked.url.startswith(own) or _is_blocked(asked) or faults.append(asked.url))
    page.goto(served.addresses[role])
    page.faults = faults  # type: ignore[attr-defined]
    sync_api.expect(page.locator("#phase")).to_have_text(
        "paused" if checked or is_paused else "running", timeout=PATIENCE
    )
    return page


def _is_blocked(asked: sync_api.Request) -> bool:
    """Return whether the browser has kept a request back by the page's policy: the viewer's calls home."""
    return "csp" in (asked.failure or "").lower()


def order(page: sync_api.Page, group: str, button: str, **fields: object) -> None:
    """Fill fields of a group of controls by their ids, and press one of its buttons."""
    box = page.locator("fieldset").filter(has=page.get_by_text(group, exact=True))
    for name, entry in fields.items():
        box.locator(f"#{name.replace('_', '-')}").fill(str(entry))
    box.get_by_role("button", name=button, exact=True).first.click()


def accessible(page: sync_api.Page) -> list[tuple[str, str]]:
    """Return what axe finds wrong: labels, contrast, roles, keyboard."""
    found = axe.Axe().run(page).response["violations"]
    return [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")]


def not_reached(page: sync_api.Page) -> list[str]:
    """Return the controls that the Tab key alone does not come to; each that it comes to shows that it has the focus."""
    controls = "button, select, input, textarea, a[href], [tabindex='0']"
    shown = "(one) => !one.disabled && one.tabIndex >= 0 && one.checkVisibility()"
    count = page.evaluate(f"[...document.querySelectorAll(`{controls}`)].filter({shown}).length")
    for _ in range(count + 5):  # the browser's own places between the last and the first
        page.keyboard.press("Tab")
        page.evaluate(
            """() => {
                const one = document.activeElement, style = getComputedStyle(one);
                if (style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1) one.dataset.reached = "yes";
            }"""
        )
    left = f"[...document.querySelectorAll(`{controls}`)].filter({shown}).filter((one) => !one.dataset.reached)"
    return list(page.evaluate(f"{left}.map((one) => one.outerHTML.slice(0, 80))"))


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_an_exercise_is_conducted_in_a_browser(served: Console) -> None:
    expect = sync_api.expect
    expect.set_options(timeout=PATIENCE)
    with sync_api.sync_playwright() as player:
        first, second = browser(player), browser(player)
        instructor = opened(first, served, "instructor", checked=True)
        for page in (instructor, *(opened(first, served, role, checked=True) for role in ("port", "observer"))):
            assert accessible(page) == []
            assert not_reached(page) == []
            page.locator("#title").click()  # the focus is nowhere again
        _starts(instructor)
        crews = [opened(second, served, name) for name in ("port", "starboard")]
        _crews_steer(instructor, crews)
        _instructor_acts(instructor)
        time = instructor.locator("#time").inner_text()
        first.close()  # as if it were killed: the run goes on
        expect(crews[1].locator("#phase")).to_have_text("running")
        back = opened(browser(player), served, "instructor")
        expect(back.locator("#log")).to_contain_text("boom main parts at joint 4")
        assert back.locator("#time").inner_text() > time
        for page in (*crews, back):
            assert page.faults == []  # type: ignore[attr-defined]


SCREENS = [(1280, 720), (1440, 900), (1920, 1080), (3840, 2160)]  # [px] that projectors and screens have
HULL = [34, 52, 92]  # colour of a vessel on the plan


def test_the_observers_page_fills_the_screen_and_hides_no_vessel(served: Console) -> None:
    """It is the one that is projected: the plan has most of it, letters grow with it, and what stands in corners lies under vessels."""
    with sync_api.sync_playwright() as player:
        context = browser(player).new_context(bypass_csp=True)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        page.goto(served.addresses["observer"])
        page.wait_for_function("conduct.state")
        sync_api.expect(page.locator("#state-port")).to_contain_text("ordered")
        for width, height in SCREENS:
            page.set_viewport_size({"width": width, "height": height})
            page.wait_for_timeout(500)
            main, plan = page.locator("main").bounding_box(), page.locator("#plan").bounding_box()
            assert main is not None and plan is not None
            assert main["y"] + main["height"] == pytest.approx(height, abs=1.0)
            assert page.evaluate("document.documentElement.scrollHeight <= innerHeight")
            assert plan["height"] > 0.6 * height
            assert plan["width"] > 0.6 * width
            letters = page.evaluate("parseFloat(getComputedStyle(document.documentElement).fontSize)")
            assert letters == pytest.approx(max(15.0, min(0.0079 * width, 0.014 * height)), rel=0.01)
            for corner in ([60, 60], [-40, 40], [-60, -30]):  # weather, north arrow, scale
                assert _color_of_a_vessel_moved_to(page, corner) == HULL


def _color_of_a_vessel_moved_to(page: sync_api.Page, corner: list[int]) -> list[int]:
    """Move the plan until a vessel lies in a corner [px], from the right and bottom if negative; return the colour there."""
    return page.evaluate(
        """async ([left, top]) => {
            const { plan, state } = conduct, vessel = state.vessels.port;
            const there = [left < 0 ? plan.width + left : left, top < 0 ? plan.height + top : top];
            plan.setFollow(false);
            const [x, y] = plan.at(vessel.x, vessel.y);
            plan.move((x - there[0]) / plan.scale, (there[1] - y) / plan.scale);
            while (plan.isAsked) await new Promise((done) => setTimeout(done, 20)); // until it is drawn
            const ratio = devicePixelRatio * plan.unit;
            return [...plan.context.getImageData(Math.round(there[0] * ratio), Math.round(there[1] * ratio), 1, 1).data.slice(0, 3)];
        }""",
        corner,
    )


def test_oil_on_the_plan_has_the_area_of_its_volume(served: Console) -> None:
    """100 litres that were lost, 1 mm thick: a film of 100 m2, and on it a red spot of 10 m2; the legend says what it means."""
    with sync_api.sync_playwright() as player:
        page = opened(browser(player), served, "observer", checked=True)
        sync_api.expect(page.locator("#legend")).to_contain_text("no spot below 2 px")
        sync_api.expect(page.locator("#legend")).to_contain_text("lost: 1 m² for 10 litres")
        film, spot = page.evaluate(
            """async () => {
                const { plan, scene, state } = conduct, fate = scene.fates.findIndex((one) => one.startsWith("lost_"));
                plan.draw(); // the first picture fits the scale: a slow page has not drawn it yet
                plan.setFollow(false);
                plan.scale = 15;
                const [x, y] = plan.placeAt(0.5 * plan.width * plan.unit, 0.5 * plan.height * plan.unit);
                plan.spots = new Float32Array([x, y, Math.sqrt(0.1 / (Math.PI * 1e-3)), 1.0001e-3, fate]);
                const booms = Object.fromEntries(scene.booms.map((one) => [one.name, { line: [], parted: [] }]));
                plan.state = { ...state, vessels: {}, booms };
                plan.tracks = {};
                plan.scene = { ...scene, vessels: [] };
                plan.draw();
                const pixels = plan.context.getImageData(0, 0, plan.canvas.width, plan.canvas.height).data;
                let red = 0, brown = 0;
                for (let k = 0; k < pixels.length; k += 4) {
                    if (pixels[k] > 180 && pixels[k + 1] < 80) red++;
                    else if (pixels[k] > 1.2 * pixels[k + 2] && pixels[k] < 180) brown++;
                }
                const square = (plan.scale * plan.unit * devicePixelRatio) ** 2;
                return [(red + brown) / square, red / square];
            }"""
        )
        assert spot == pytest.approx(10.0, rel=0.05)
        assert film == pytest.approx(100.0, rel=0.05)


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_chart_lies_under_the_land_for_every_role(tmp_path: Path) -> None:
    """The black rectangle of a chart and the land with its corners are the same pixels but for one along the edge."""
    draw_chart(tmp_path / "chart.png")
    land = chart_text(Site(latitude=57.66, longitude=11.7, bearing=250.0), tmp_path / "chart.png")
    with console(tmp_path, TOW + land) as one, sync_api.sync_playwright() as player:
        program = browser(player)
        for role in ("instructor", "port", "observer"):
            page = opened(program, one, role, is_paused=True)
            page.wait_for_function("conduct.plan.chart")
            dark, sand, apart, around = page.evaluate(
                """() => {
                    const { plan, scene } = conduct, there = plan.chart, { width, height } = plan.canvas, [{ outline: land }] = scene.land;
                    const shown = { ...scene, areas: {}, vessels: [], booms: [], bodies: {} };
                    plan.draw(); // the first picture fits the scale
                    plan.setFollow(false);
                    plan.state = { ...plan.state, vessels: {}, booms: {}, skimmers: {}, lines: {} };
                    plan.tracks = {}; plan.spots = new Float32Array(0); plan.own = null;
                    plan.center = plan.toMap(...[0, 1].map((axis) => (land[0][axis] + land[2][axis]) / 2));
                    plan.scale = 6;
                    const pixels = () => {
                        plan.draw();
                        const { data } = plan.context.getImageData(width / 2 - 140, height / 2 - 140, 280, 280);
                        return Array.from({ length: data.length / 4 }, (_, k) => [data[4 * k], data[4 * k + 2]]);
                    };
                    plan.scene = { ...shown, land: [] };
                    const chart = pixels().map(([red]) => red < 140);
                    plan.scene = shown; plan.chart = null;
                    const ground = pixels().map(([red, blue]) => red > blue);
                    plan.chart = there; plan.scene = scene;
                    const count = (list) => list.filter(Boolean).length, side = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
                    const edge = 2 * (side(land[0], land[1]) + side(land[1], land[2])) * plan.scale * plan.unit * devicePixelRatio;
                    return [count(chart), count(ground), count(chart.map((one, k) => one !== ground[k])), edge];
                }"""
            )
            assert dark == pytest.approx(sand, rel=0.05) and dark > 20_000
            assert apart < 1.2 * around, role
            assert page.faults == []  # type: ignore[attr-defined]


@pytest.mark.slow
def test_the_boxes_show_what_is_ordered_until_somebody_types(served: Console) -> None:
    """An order that came elsewhere is in the box; what is typed stays until it is ordered."""
    sync_api.expect.set_options(timeout=PATIENCE)
    with sync_api.sync_playwright() as player:
        page = browser(player).new_context(bypass_csp=True).new_page()
        page.set_default_timeout(PATIENCE)
        page.goto(served.addresses["instructor"])
        speed, heading = page.locator("#speed-port"), page.locator("#course-port")
        sync_api.expect(heading).not_to_have_value("")
        page.evaluate("conduct.link.give('go-on')")
        for ordered in ("0.31", "0.32"):
            page.evaluate(
                f"conduct.link.give('steer', {{vessel: 'port', speed: {ordered} * 1852 / 3600, heading: 0, keeps_line: true}})"
            )
            sync_api.expect(speed).to_have_value(ordered)
        speed.fill("0.4")
        page.evaluate("conduct.link.give('steer', {vessel: 'port', speed: 0.2, heading: 0.1, keeps_line: true})")
        sync_api.expect(heading).to_have_value("84")
        sync_api.expect(speed).to_have_value("0.4")
        sync_api.expect(speed).to_have_class("typed")
        order(page, "Vessel port", "Order")
        sync_api.expect(page.locator("#state-port")).to_contain_text("ordered 0.40 kn, course 084")
        sync_api.expect(speed).to_have_value("0.40")
        sync_api.expect(speed).not_to_have_class("typed")
        page.evaluate("conduct.link.give('pause')")


def _starts(page: sync_api.Page) -> None:
    """The keyboard makes a step, starts the run, changes its pace and sets a mark; the time scale is the clock's again."""
    page.keyboard.press(".")
    sync_api.expect(page.locator("#time")).to_have_text("0:00.1")
    page.keyboard.press("Space")
    sync_api.expect(page.locator("#phase")).to_have_text("running")
    sync_api.expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.keyboard.press("-")
    sync_api.expect(page.locator("#scale")).to_have_value("1")
    page.keyboard.press("+")
    sync_api.expect(page.locator("#scale")).to_have_value("2")
    page.keyboard.press("m")
    sync_api.expect(page.locator("#marks")).to_contain_text("moment 1")


def _crews_steer(instructor: sync_api.Page, crews: list[sync_api.Page]) -> None:
    """Two crews steer at once, one of them by hand at the end; all see it."""
    for page, key in zip(crews, ("ArrowRight", "ArrowLeft"), strict=True):
        page.keyboard.press(key)
        page.keyboard.press("ArrowUp")
        page.get_by_role("button", name="Order", exact=True).click()
    log = instructor.locator("#log")
    sync_api.expect(log).to_contain_text("port: make 0.68 kn over the ground, heading 095")
    sync_api.expect(log).to_contain_text("starboard: make 0.68 kn over the ground, heading 085")
    sync_api.expect(crews[0].locator("#log")).to_contain_text("starboard: make 0.68 kn")
    crews[0].get_by_role("slider", name="Thrust").fill("50")
    crews[0].get_by_role("slider", name="Rudder").fill("-20")
    crews[0].get_by_role("button", name="Take the levers").click()
    sync_api.expect(log).to_contain_text("port: 50 % ahead, 20 % rudder to port, by hand")
    sync_api.expect(instructor.locator("#state-port")).to_contain_text("by hand 50 % ahead")


def _instructor_acts(page: sync_api.Page) -> None:
    """Weather, release, engine and boom are the instructor's, each with a line of the log."""
    log = page.locator("#log")
    box = page.locator("#plan").bounding_box()
    assert box is not None
    page.locator("#plan").dblclick(position={"x": 0.7 * box["width"], "y": 0.5 * box["height"]})
    order(page, "Release oil", "Release", spill_volume=50, spill_time=5)
    sync_api.expect(log).to_contain_text("pipe release-1 releases 50 litres within 5 s")
    weather = page.locator("fieldset").filter(has=page.get_by_text("Weather", exact=True))
    for entries, what, words in (
        ({"wind-speed": 12, "wind-from": 45}, "wind", "wind"),
        ({"current-speed": 0.3, "current-to": 270}, "current", "current 0.30 kn; current towards 270"),
        ({"waves-height": 0.2}, "waves", "waves"),
    ):
        for name, entry in entries.items():
            weather.locator(f"#{name}").fill(str(entry))
        weather.locator(f"[data-what={what}]").click()
        sync_api.expect(log).to_contain_text(words)
    order(page, "Vessel starboard", "Engine fails")
    sync_api.expect(log).to_contain_text("the engine of starboard has stopped")
    order(page, "Vessel starboard", "Engine runs again")
    sync_api.expect(log).to_contain_text("the engine of starboard runs again")
    order(page, "Boom main", "Part", part_main=4)
    sync_api.expect(log).to_contain_text("boom main parts at joint 4")
    page.locator("#free").fill("tow.speed_kn=9999")
    page.locator("fieldset").filter(has=page.locator("#free")).get_by_role("button").click()
    sync_api.expect(page.locator("#notice")).to_contain_text("tow.speed")


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_lines_injects_branches_and_debriefs_in_a_browser(tmp_path: Path) -> None:
    """Winches haul, an inject comes, and what was typed outlives a break of the link; then a branch is debriefed and tried again."""
    sync_api.expect.set_options(timeout=PATIENCE)
    with console(tmp_path, WINCHED, "--pace", "2") as one, sync_api.sync_playwright() as player:
        program = browser(player)
        page, crew = opened(program, one, "instructor", checked=True), opened(program, one, "port", checked=True)
        page.keyboard.press("m")
        page.keyboard.press("Space")
        sync_api.expect(page.locator("#phase")).to_have_text("running")
        _hauls_and_injects(page, crew)
        crew.close()
        _branches_and_debriefs(page)
        assert page.faults == []  # type: ignore[attr-defined]


def _hauls_and_injects(page: sync_api.Page, crew: sync_api.Page) -> None:
    """The crew hauls in its own line, the instructor pays out both, and gives an inject, which its button then shows."""
    log = page.locator("#log")
    order(crew, "Tow line", "Order", own_line=1.5)
    sync_api.expect(log).to_contain_text("tow line of port: 0.5 m shorter")
    sync_api.expect(crew.locator("#state-port")).to_contain_text("tow line 1.5 m")
    page.locator("#line-main").fill("3")
    page.evaluate("conduct.link.socket.close()")
    sync_api.expect(page.locator("#phase")).to_have_text("away")
    sync_api.expect(page.locator("#phase")).to_have_text("running")
    order(page, "Boom main", "Order")
    sync_api.expect(log).to_contain_text("tow lines of boom main: 3.0 m")
    inject = page.get_by_role("button", name="The starboard engine stops")
    inject.click()
    sync_api.expect(log).to_contain_text("the engine of starboard has stopped; the inject engine is given")
    sync_api.expect(inject).to_be_disabled()
    sync_api.expect(crew.locator("#log")).to_contain_text("The starboard engine stops")
    sync_api.expect(crew.locator("#log")).not_to_contain_text("inject")
    sync_api.expect(crew.locator("[data-inject]")).to_have_count(0)
    crew.locator("#person").fill("Bo")
    crew.locator("#person").press("Enter")
    order(crew, "Radio", "Say", radio_text="the port line is slack")
    sync_api.expect(log).to_contain_text("all stations, this is port, Bo: the port line is slack")
    order(crew, "Tow line", "Order", own_line=2.0)
    sync_api.expect(log).to_contain_text("crew port (Bo): tow line of port")


def _branches_and_debriefs(page: sync_api.Page) -> None:
    """A run from a mark is debriefed, tried again with a slower tow beside it, and saved as one file that needs nothing else."""
    page.locator("#marks").get_by_role("button", name="Go back").first.click()
    sync_api.expect(page.locator("#phase")).to_have_text("paused")
    sync_api.expect(page.locator("#log")).to_contain_text("goes back to")
    page.locator("#scale").select_option("null")
    page.keyboard.press("Space")
    sync_api.expect(page.locator("#phase")).to_have_text("running")
    page.wait_for_timeout(2000)
    page.get_by_role("button", name="Debrief", exact=True).click()
    sync_api.expect(page.locator("#view-debrief iframe")).to_have_count(1, timeout=4 * PATIENCE)
    with page.expect_download() as saved:
        page.get_by_role("link", name="as one HTML file").click()
    text = Path(saved.value.path()).read_text(encoding="utf-8")
    assert "<html" in text
    assert 'src="http' not in text
    page.evaluate(
        "document.querySelector('#view-debrief iframe').contentWindow.print = () => { window.isPrinted = true; }"
    )
    page.get_by_role("button", name="Print or save as PDF").click()
    assert page.evaluate("window.isPrinted")
    page.locator("#what-if-orders").fill("tow.speed_kn=0.2 sea.wind={kind='steady',speed=12.0,direction=1.5}")
    page.get_by_role("button", name="Try").click()
    sync_api.expect(page.locator("#view-debrief iframe")).to_have_count(2, timeout=4 * PATIENCE)
    sync_api.expect(page.locator("#what-if-said")).to_contain_text("The runs differ from 0:00")
    sync_api.expect(page.locator(".compared > table")).to_contain_text("mean tow tension, port")
    sync_api.expect(page.locator(".compared .chart canvas")).to_have_count(2)
    page.locator("#what-if-orders").fill("tow.sped_kn=0.2")
    page.get_by_role("button", name="Try").click()
    sync_api.expect(page.locator("#notice")).to_contain_text("tow.sped_kn")
    sync_api.expect(page.locator("#phase")).to_have_text("ended")


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_skimmer_is_started_stopped_and_told_how_much_to_pump(tmp_path: Path) -> None:
    """It stands at the start; gauges, words and log follow the orders of instructor and crew, on the observer's page too; it moves."""
    text = (ROOT / "scenarios" / "library" / "j-sweep-skimmer.toml").read_text(encoding="utf-8")
    with console(tmp_path, text, "--pace", "10") as one, sync_api.sync_playwright() as player:
        program = browser(player)
        page, other, crew = (
            opened(program, one, role, is_paused=True) for role in ("instructor", "observer", "skimming")
        )
        told = sync_api.expect(page.locator("#skimmer-brush"))
        told.to_contain_text("stopped")
        sync_api.expect(other.locator("#skimmer-brush")).to_contain_text("tank 0 % of 10 m³")
        order(page, "Skimmer brush", "Start")
        told.to_contain_text("works")
        sync_api.expect(other.locator("#gauges")).to_contain_text("Water in the tank")
        sync_api.expect(page.locator("#pump-brush")).to_have_value("60.0")
        order(page, "Skimmer brush", "Order", pump_brush=20)
        sync_api.expect(page.locator("#log")).to_contain_text("skimmer brush pumps 20 m³/h at most")
        sync_api.expect(other.locator("#log")).to_contain_text("skimmer brush starts")
        sync_api.expect(crew.locator("#port-brush")).to_have_value("2.0")
        order(crew, "Skimmer brush", "Move", ahead_brush=1, port_brush=3)
        sync_api.expect(page.locator("#log")).to_contain_text("skimmer brush moves to 1 and 3 m")
        told.to_contain_text("works, moves")
        page.evaluate("conduct.link.give('go-on')")
        sync_api.expect(crew.locator("#skimmer-brush")).not_to_contain_text("moves", timeout=PATIENCE)
        order(crew, "Skimmer brush", "Stop")
        told.to_contain_text("stopped", timeout=PATIENCE)
        assert page.evaluate("conduct.state.skimmers.brush.nameplate * 3600") == pytest.approx(20.0)
        assert page.faults == other.faults == crew.faults == []  # type: ignore[attr-defined]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_sea_is_seen_in_three_dimensions_and_looks_back_with_the_plan(tmp_path: Path) -> None:
    """Water, oil and sky are there in colours that nothing else of the page has, and an earlier moment is another picture."""
    import matplotlib.image

    from recordings.model import palette

    with console(tmp_path, TOW, "--pace", "2", has_scene=True) as one, sync_api.sync_playwright() as player:
        page = opened(browser(player), one, "instructor", is_paused=True)
        page.keyboard.press("Space")
        sync_api.expect(page.locator("#phase")).to_have_text("running", timeout=PATIENCE)
        page.get_by_role("tab", name="Both").click()
        words = page.frame_locator("#view-scene iframe").locator("#words")
        sync_api.expect(words).to_be_hidden(timeout=PATIENCE)
        sync_api.expect(page.locator("#scene-lag")).to_contain_text("3-D shows 0:")
        _obeys_while_the_view_stalls(page)

        def shares() -> tuple[float, float]:
            """Return the parts of the view that are blue as water is, and brown as oil."""
            image = matplotlib.image.imread(io.BytesIO(page.locator("#view-scene").screenshot()))[..., :3]
            sea = np.array(palette.SEA[:3]) / 255.0
            hue, brown = image / np.maximum(image.sum(axis=2, keepdims=True), 1e-6), image[..., 0] > 1.1 * image[..., 2]
            return float((np.abs(hue - sea / sea.sum()).max(axis=2) < 0.06).mean()), float(brown.mean())

        deadline = time.monotonic() + 60.0
        while (found := shares())[0] < 0.2 and time.monotonic() < deadline:
            page.wait_for_timeout(1000)
        assert found[0] >= 0.2
        assert found[1] > 0.001
        moved: list[str] = []
        page.on("console", lambda line: moved.append(line.text) if "did not move" in line.text else None)
        page.keyboard.press("Space")
        sync_api.expect(page.locator("#phase")).to_have_text("paused", timeout=PATIENCE)
        page.locator("#moment").fill("0.5")
        sync_api.expect(page.locator("#looking")).to_contain_text("looks at 0:00.5")
        page.wait_for_timeout(3000)
        assert shares()[0] >= 0.2
        page.locator("#present").click()
        page.wait_for_timeout(3000)
        assert moved == []
        assert page.faults == []  # type: ignore[attr-defined]


@pytest.mark.slow
def test_fog_veils_the_three_dimensional_view_of_crews(tmp_path: Path) -> None:
    """A crew sees nothing in dense fog, and all but a tenth in clear air; the instructor sees all."""
    with console(tmp_path, TOW, "--pace", "2", has_scene=True) as one, sync_api.sync_playwright() as player:
        program = browser(player)
        instructor, crew = (opened(program, one, role, is_paused=True) for role in ("instructor", "port"))
        for page in (instructor, crew):
            page.get_by_role("tab", name="Both").click()
        veil = "getComputedStyle(document.querySelector('.veil')).opacity"
        for visibility, least, most in ((20000, 0.0, 0.1), (10, 0.9, 1.0)):
            instructor.evaluate(f"conduct.link.give('order', {{settings: ['sea.visibility={visibility}']}})")
            instructor.evaluate("conduct.link.give('step')")
            crew.wait_for_function(f"conduct.state.weather.visibility == {visibility}")
            assert least <= float(crew.evaluate(veil)) <= most
            assert instructor.evaluate(veil) == "0"


def _obeys_while_the_view_stalls(page: sync_api.Page) -> None:
    """An order by a key is obeyed while the 3-D view does nothing but compute."""
    frame = page.frames[1]
    assert page.evaluate("document.querySelector('#view-scene iframe').contentDocument") is None  # of another origin
    page.evaluate("addEventListener('message', (event) => { if (event.data === 'free again') window.isFree = true; })")
    frame.evaluate(
        """setTimeout(() => {
            for (const end = Date.now() + 30000; Date.now() < end;);
            parent.postMessage("free again", "*");
        })"""
    )
    page.wait_for_timeout(500)
    sync_api.expect(page.locator("#scene-lag")).to_contain_text("s behind")
    page.keyboard.press("m")
    sync_api.expect(page.locator("#marks")).to_contain_text("moment 1")
    assert not page.evaluate("window.isFree ?? false"), "the page has waited for its 3-D view"
    while not page.evaluate("window.isFree ?? false"):  # the test's own time limit ends it
        page.wait_for_timeout(500)


def test_the_page_is_served_from_the_package_alone() -> None:
    page = ROOT / "scenarios" / "conduct" / "page"
    for file in page.glob("*.*"):
        text = file.read_text(encoding="utf-8")
        assert "https://" not in text
        assert "http://" not in text
