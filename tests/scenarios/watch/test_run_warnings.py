"""What a run falls short of is said once, by name, and not again after a restart."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from scenarios.running.assembly import Assembly, build
from scenarios.setup.solids.placed_solids import swollen_bodies
from scenarios.spec.load import load_scenario, scenario_from
from scenarios.spec.resolve import resolve
from scenarios.watch.run_warnings import Remarks

SHELF: dict[str, Any] = {
    "name": "shelf",
    "run": {"duration": 1.0, "communication_step": 0.02},
    "fluid": {"particle_spacing": 0.05, "divergence_tolerance": 1e-12},
    "phases": {"water": {"density": 1000.0, "dynamic_viscosity": 0.0}},
    "tank": {"lower": [0.0, 0.0, 0.0], "upper": [1.0, 0.5, 0.8], "open": ["+z", "+x"]},
    "fill": {"block": {"shape": "block", "phase": "water", "lower": [0.0, 0.0, 0.0], "upper": [0.4, 0.5, 0.4]}},
    "bodies": {
        "ball": {
            "shape": "sphere",
            "radius": 0.1,
            "density": 2000.0,
            "position": [0.8, 0.25, 0.3],
            "velocity": [3.0, 0.0, 0.0],
        }
    },
}


def said(assembly: Assembly, steps: int) -> list[tuple[str, str]]:
    """Sources and texts of the remarks on so many steps."""
    simulation, found = assembly.co_simulation(), []
    simulation.initialize()
    for _ in range(steps):
        simulation.step()
        found += [(remark.source, remark.text) for remark in assembly.remarks.look(assembly.report())]
    simulation.terminate("completed")
    return found


def test_solves_that_miss_their_tolerance_and_bodies_that_leave_are_told_once() -> None:
    found = dict(told := said(build(scenario_from(SHELF)), 20))
    assert len(told) == len(found) == 2
    assert "products per step with a mean compression of" in found["fluid divergence"]
    assert "above 1e-12; a shorter fluid.maximum_time_step helps" in found["fluid divergence"]
    assert found["body ball"] == "has left the tank through its open side +x"


def test_no_body_leaves_a_sea_without_walls() -> None:
    """Its boom hangs far behind the boats that hold it, and nothing that is placed tells how far the sea reaches."""
    told = said(build(load_scenario("sweep-200m").scenario), 1)
    assert not [text for _, text in told if "has left the tank" in text]


def test_a_viscous_solve_that_stops_early_is_told() -> None:
    tar = {"water": {"density": 1000.0, "dynamic_viscosity": 1e5}}
    fluid = {"particle_spacing": 0.05}
    scenario = scenario_from(SHELF | {"phases": tar, "fluid": fluid, "bodies": {}})
    assembly = build(scenario)
    assembly.fluid.advance(0.02)
    report = replace(assembly.fluid.advance(0.02), viscosity_error=0.1, iterations={"viscosity": 3.0})
    (remark,) = Remarks(resolve(scenario), None, {}, {}).look(report)
    assert remark.source == "fluid viscosity"
    assert remark.text.startswith(
        "stopped after 3 iterations per step with a share of the drag left of 0.1, above 0.0001;"
    )


def test_a_pipe_that_pours_into_a_full_box_is_told() -> None:
    """A closed box of 0.5 x 0.5 x 0.5 m, full, into which 5 litres more are poured: 4 % more than it holds."""
    box = {"lower": [0.0, 0.0, 0.0], "upper": [0.5, 0.5, 0.5]}
    fill = {"all": {"shape": "block", "phase": "water", **box}}
    pipe = {"phase": "water", "mouth": [0.25, 0.25, 0.3], "radius": 0.08, "speed": 2.5, "volume": 0.005}
    full = {"fluid": {"particle_spacing": 0.05}, "bodies": {}, "tank": box, "fill": fill, "emitters": {"pipe": pipe}}
    told = dict(said(build(scenario_from(SHELF | full)), 20))
    assert "liquid that fills its box is pressed together by" in told["fluid crowded"]


def test_run_that_keeps_its_tolerances_is_not_remarked_on() -> None:
    calm = {"fluid": {"particle_spacing": 0.05}, "bodies": {}}
    assert said(build(scenario_from(SHELF | calm)), 10) == []


def test_drops_that_rise_by_a_model_are_told_once() -> None:
    """One particle of oil amid water."""
    liquids = SHELF["phases"] | {"oil": {"density": 850.0, "dynamic_viscosity": 0.1}}
    fill = {"all": {"shape": "block", "phase": "water", "lower": [0.0, 0.0, 0.0], "upper": [0.5, 0.5, 0.5]}}
    fill |= {"drop": {"shape": "block", "phase": "oil", "lower": [0.2, 0.2, 0.1], "upper": [0.25, 0.25, 0.15]}}
    tank = {"lower": [0.0, 0.0, 0.0], "upper": [0.5, 0.5, 0.8], "open": ["+z"]}
    rising = {"fluid": {"particle_spacing": 0.05}, "bodies": {}, "phases": liquids, "tank": tank, "fill": fill}
    told = [text for source, text in said(build(scenario_from(SHELF | rising)), 40) if source == "fluid"]
    assert told == ["drops of a few particles rise or sink as drops of their volume do (modelled; reported once)"]


def test_a_body_too_thin_for_its_particles_is_told() -> None:
    # 2 cm of aluminium, which the fluid takes for 5 but at its rim
    sheet = {"shape": "box", "size": [0.2, 0.2, 0.02], "density": 2700.0, "position": [0.2, 0.25, 0.5]}
    calm = {"fluid": {"particle_spacing": 0.05}, "bodies": {"sheet": sheet}}
    (source, text), (leak, way) = said(build(scenario_from(SHELF | calm)), 3)
    assert source == "thin sheet" and leak == "leak sheet"
    assert way.startswith(
        "sheet has plates 0.02 m thin, 0.4 particle spacings: the fluid keeps its particles on their side"
    )
    assert text.startswith("sheet has parts thinner than a particle: the fluid meets and lifts 2 times its volume;")
    assert text.endswith("fluid.particle_spacing below 0.05 m resolves them")


def test_a_boom_of_thin_segments_is_told_once() -> None:
    swelling = {f"boom/main/segment-{k:02d}": 1.5 + 0.1 * k for k in range(5)} | {
        "boom/other/segment-00": 1.2,
        "rock": 1.0,
    }
    remarks = Remarks(
        resolve(scenario_from(SHELF)),
        None,
        {},
        swollen_bodies(swelling, dict.fromkeys(swelling, "a particle"), 0.05),
    )
    main, other = remarks.look(None)
    assert main.source == "thin boom/main/segment-00"
    assert main.text.startswith("boom/main/segment-00 and 4 more have parts thinner than a particle: ")
    assert "lifts 1.9 times their volume" in main.text
    assert "lifts 1.2 times its volume" in other.text


def test_what_has_been_said_is_remembered() -> None:
    first, second = build(scenario_from(SHELF)), build(scenario_from(SHELF))
    assert said(first, 20)
    second.remarks.restore_state(first.remarks.save_state())
    assert said(second, 20) == []
    with pytest.raises(KeyError):
        second.remarks.restore_state({})
