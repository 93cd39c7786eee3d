"""A window's spacing in a word becomes numbers, by boom and machine; what comes of it is told, what cannot be is refused."""

from __future__ import annotations

import math

import pytest

from scenarios.setup.cost import estimate
from scenarios.spec.load import load_scenario
from scenarios.spec.resolve import numbered
from scenarios.spec.scenario import Scenario
from scenarios.spec.window_choice import COARSE, FINE, live_spacing, seconds_per_particle_step
from scenarios.text.problems import ScenarioError

SKIRT = 0.75
WINDOW = "fidelity=live"


def sweep(*settings: str) -> Scenario:
    return load_scenario("sweep-200m", overrides=[WINDOW, *settings]).scenario


def test_metres_and_fine_are_spacings_and_a_size_by_the_skirt() -> None:
    given = numbered(sweep("window.spacing=0.2"))
    window = given.window
    assert window.settings(given.fluid).spacing == given.fluid.particle_spacing == 0.2
    assert window.size == (16.0, 16.0)
    fine = numbered(sweep('window={target="main", spacing="fine"}'))
    window = fine.window
    assert window.size == pytest.approx((10.0 * SKIRT, 10.0 * SKIRT))
    assert window.outer.size == pytest.approx((21.0 * SKIRT, 21.0 * SKIRT))
    assert window.outer.spacing == pytest.approx(2.0 * SKIRT / FINE)
    assert window.settings(fine.fluid).spacing == fine.fluid.particle_spacing == pytest.approx(SKIRT / FINE)
    assert numbered(fine) is fine


def test_live_is_as_fine_as_the_machine_is_fast() -> None:
    scenario = sweep()
    window = scenario.window
    found = [live_spacing(scenario, window, SKIRT, speed) for speed in (1e-9, 3e-7, 1e-3)]
    assert found[0] == pytest.approx(SKIRT / FINE)
    assert found[0] < found[1] < found[2]
    assert found[2] == pytest.approx(SKIRT / COARSE)
    assert 0.0 < seconds_per_particle_step(1) < math.inf


@pytest.mark.parametrize(
    "name", ["sweep-200m", "j-sweep-skimmer", "v-sweep", "anchored-containment", "tow-speed-trial"]
)
@pytest.mark.parametrize(("fidelity", "least"), [("live", COARSE), ("fine", FINE)])
def test_exercises_offer_a_window_at_the_apex_or_the_skimmer(name: str, fidelity: str, least: float) -> None:
    scenario = numbered(load_scenario(name, overrides=[f"fidelity={fidelity}"]).scenario)
    window = scenario.window
    target = str(window.target)
    draft = scenario.booms[scenario.skimmers[target].on if target in scenario.skimmers else target].skirt_depth
    assert draft / window.spacing_in(scenario.fluid) > 0.99 * least


def test_an_outer_window_costs_its_own_particles_and_is_told() -> None:
    alone = sweep("window.size=[6.0, 6.0]", "window.depth=1.25", "window.spacing=0.125")
    nested = sweep(
        "window.size=[6.0, 6.0]",
        "window.depth=1.25",
        "window.spacing=0.125",
        "window.outer={spacing=0.25, size=[16.0, 16.0]}",
    )
    one, both = estimate(alone), estimate(nested)
    assert sum(both.particles.values()) - sum(one.particles.values()) == 64 * 64 * 5
    assert both.seconds > one.seconds
    assert "outer window: 16 by 16 m, 1.25 m deep, 20,480 particles of 0.25 m" in "\n".join(both.told)
    speeds = (3e-8, 1e-7, 3e-7)
    finest = [[live_spacing(one, one.window, SKIRT, speed) for speed in speeds] for one in (alone, nested)]
    assert finest[0] < finest[1], "the outer window's time is not there for the inner one"


def test_check_tells_what_comes_of_it() -> None:
    told = "\n".join(estimate(sweep("window.size=[8.0, 8.0]", "window.depth=1.2")).told)
    assert "window: 8 by 8 m, 1.25 m deep, 5,120 particles of 0.25 m in 1 step a" in told
    assert "oil thinner than 0.25 m stays parcels" in told
    assert "smaller than the sea's waves of" in told
    assert "window.rim =" in told
    assert "no body comes near 500, 0" in "\n".join(estimate(sweep("window.target=[500.0, 0.0]")).told)


@pytest.mark.parametrize(
    ("setting", "place", "text"),
    [
        ("window={target='main', spacing=0.8}", "window.spacing", "up to the skirt of boom 'main', 0.75 m"),
        (
            "window={target='main', size=[8.0, 8.0], depth=4.0, spacing=0.25, outer={spacing=0.8, size=[40.0, 40.0]}}",
            "window.outer.spacing",
            "up to the skirt of boom 'main', 0.75 m",
        ),
        (
            "window={target='main', spacing='live', outer={spacing=0.8, size=[40.0, 40.0]}}",
            "window.outer.spacing",
            "up to the skirt of boom 'main', 0.75 m",
        ),
        (
            "window={target='main', size=[1.2, 1.2], depth=2.0, spacing=0.25, rim=0.3}",
            "window",
            "allowed: 9 spacings of 0.25 m",
        ),
        ("window.spacing=-1.0", "window.spacing", "above 0"),
        ('window.spacing="best"', "window.spacing", "'live', 'fine'"),
        (
            'window={target="main", spacing="live", rim=9.0}',
            "window",
            "rim is 9 m on each side, allowed: less than half",
        ),
        (
            'window={target="main", spacing="live", size=[4.0, 4.0], outer={spacing=0.7, size=[30.0, 30.0]}}',
            "window.outer",
            "spacing is 0.7 m, allowed: up to a quarter",
        ),
        ('window={target="main"}', "window", "size and depth are not both given"),
        ("window.outer={spacing=0.5, size=[30.0, 30.0]}", "window", "outer.size leaves 15 by 15 m between its rims"),
        (
            "window.outer={spacing=0.1, size=[40.0, 40.0]}",
            "window",
            "outer.spacing is 0.1 m, allowed: 0.25 m, the window's, or more",
        ),
        (
            "window.outer={spacing=0.6, size=[40.0, 40.0]}",
            "window.outer",
            "spacing is 0.6 m, allowed: up to a quarter of the depth of both, 0.5 m",
        ),
    ],
)
def test_bad_detail_is_refused(setting: str, place: str, text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        numbered(sweep(setting))
    assert [problem.path for problem in caught.value.problems] == [place]
    assert text in str(caught.value)


def test_windows_that_do_not_fit_into_memory_are_refused_before_a_run() -> None:
    for setting, place in (
        ("window.spacing=0.002", "window"),
        (
            "window={target='main', size=[6.0, 6.0], depth=2.0, spacing=0.25, outer={size=[1e5, 1e5], spacing=0.25}}",
            "window.outer",
        ),
    ):
        with pytest.raises(ScenarioError, match="needs about") as caught:
            estimate(sweep(setting))
        assert [problem.path for problem in caught.value.problems] == [place]


@pytest.mark.parametrize("spacing", ["fluid.particle_spacing=0.25", "window.spacing=0.25", 'window.spacing="fine"'])
def test_water_too_shallow_for_the_particles_is_refused_before_a_run(spacing: str) -> None:
    scenario = sweep("sea.depth=0.3", spacing)
    with pytest.raises(ScenarioError, match=r"allowed in a window on water 0\.3 m deep: up to a quarter"):
        estimate(scenario)


def test_a_window_ends_at_the_bottom_of_its_sea() -> None:
    deep = sweep("sea.depth=1.5", "window.size=[8.0, 8.0]")
    window = numbered(deep).window
    assert window.depth == 1.5
    assert "8 by 8 m, 1.5 m deep, 6,144 particles" in "\n".join(estimate(deep).told)
