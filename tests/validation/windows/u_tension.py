"""How hard a U of boom pulls, by its gap and draft: particles around all of it against formulas.

    python -m tests.validation.windows.u_tension [--gap 0.25 0.33 0.5] [--draft 0.3 0.45] [--resolution 3] [--formulas]

prints a row a run; the rows that were measured with particles stand in `u_tension.csv` beside this file, and `tests/booms` holds the
formulas against them. The boom is that of case 34 in a current of 0.5 m/s, in a window 10.7 m wide and 5 drafts deep; the last 10 of 24 s
count.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scenarios.running.assembly import build
from scenarios.schema.exercise import BoomSettings
from scenarios.schema.liquid import SlabFill
from scenarios.schema.sea import SteadySeaCurrent
from scenarios.schema.window import WindowTable
from scenarios.spec.scenario import Scenario
from tests.validation.bodies.without_particles import ASLEEP, ENDS, LENGTH, WIDTH, bare, boom_scene

GAPS, DRAFTS = (0.25, 0.33, 0.5), (0.3, 0.45)  # of the length; m
SPEED, STEP, DURATION, COUNTED = 0.5, 0.04, 24.0, 10.0  # m/s, s, s, s
SEGMENTS, DEPTHS = 24, 5.0  # of the boom; drafts: of the water
SIZE, RIM = 10.67, 2.0  # m: of the window and its rim
SAG = {0.25: 4.0, 0.33: 3.7, 0.5: 2.2}  # m: from the ends to the middle of the window
HEADER = "gap,draft,resolution,tension"


def u_in_current(gap: float, draft: float, resolution: int) -> Scenario:
    """The boom with a gap [of its length] and a draft [m], in a window whose particles are a `resolution`-th of the draft."""
    scene = boom_scene(draft / resolution, 1, 0.0)
    fill = scene.fill["water"]
    assert isinstance(fill, SlabFill) and isinstance(scene.sea.current, SteadySeaCurrent)
    sides = [(ENDS, 0.5 * (WIDTH + sign * gap * LENGTH)) for sign in (1.0, -1.0)]
    depth, boom = DEPTHS * draft, scene.booms["main"]
    assert isinstance(boom, BoomSettings)
    return replace(
        scene,
        run=replace(scene.run, communication_step=STEP, duration=DURATION),
        fluid=replace(scene.fluid, sleep_speed=ASLEEP, maximum_time_step=None),
        sea=replace(scene.sea, current=replace(scene.sea.current, speed=SPEED)),
        fill={"water": replace(fill, top=depth, velocity=(-SPEED, 0.0, 0.0))},
        booms={"main": replace(boom, ends=(sides[0], sides[1]), segments=SEGMENTS, skirt_depth=draft, skirt_thickness=draft / resolution)},
        window=WindowTable(target=(ENDS - SAG[gap], 0.5 * WIDTH), size=(SIZE, SIZE), depth=depth, rim=RIM),
    )  # fmt: skip


def tension(scenario: Scenario) -> float:
    """Run to the end and return the mean tension [N] of both ends over the time that counts."""
    assembly = build(scenario)
    world, simulation = assembly.world, assembly.co_simulation()
    assert world is not None
    joints, found = list(assembly.fleet.tensions_of("main").values()), list[float]()
    simulation.initialize()
    for index in range(round(DURATION / STEP)):
        simulation.step()
        if index * STEP >= DURATION - COUNTED:
            found.append(float(np.mean([world.tension(joint) for joint in joints])))
    simulation.terminate()
    return float(np.mean(found))


def main(arguments: Sequence[str] | None = None) -> None:
    """Run what is asked for and print a row each."""
    parser = argparse.ArgumentParser(description="Tension of a U in a current.")
    parser.add_argument("--gap", type=float, nargs="*", choices=GAPS, default=GAPS, help="of the boom's length")
    parser.add_argument("--draft", type=float, nargs="*", default=DRAFTS, help="of the skirt [m]")
    parser.add_argument("--resolution", type=int, default=3, help="spacings of draft")
    parser.add_argument("--formulas", action="store_true", help="without particles")
    options = parser.parse_args(arguments)
    print(HEADER)
    for draft in options.draft:
        for gap in options.gap:
            scene = u_in_current(gap, draft, options.resolution)
            found = tension(bare(scene) if options.formulas else scene)
            print(f"{gap},{draft},{options.resolution},{found:.0f}", flush=True)


if __name__ == "__main__":
    main()
