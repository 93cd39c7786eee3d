"""What a scene does not need costs nothing: run as ``python -m tests.benchmarks.needless``.

Part of the step that is not the fluid's, in the U-sweep; pairs of scenes, of which the second holds something that the fluid
does not need: walls at rest, a vast domain, a moving body far from the liquid, bodies that do not move; and water at rest that
sleeps or does not.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from coupling.bullet.pybullet_import import pybullet
from coupling.solids.bodies import box
from coupling.solids.surface_sampling import boundary_particles
from coupling.testkit import TankScene, tank
from oilsim.boundaries.walls import Walls
from scenarios.running.assembly import build
from scenarios.spec.load import load_scenario
from tests.coupling.motions import UniformMotion

SPACING, WARM_UP = 0.03, 5
SIZE = (0.9, 0.9, 0.9)
FAR = 200  # boxes far above the water
POOL, SLEEP_SPEED, SETTLED = (2.4, 2.4, 0.6), 0.02, 1.5  # m, m/s, and s after which what is still sleeps


@contextmanager
def counted(owner: object, name: str) -> Iterator[list[str]]:
    """Calls of a function while the block runs."""
    calls: list[str] = []
    original = getattr(owner, name)

    def counting(*arguments: object, **options: object) -> object:
        calls.append(name)
        return original(*arguments, **options)

    setattr(owner, name, counting)
    try:
        yield calls
    finally:
        setattr(owner, name, original)


def water() -> TankScene:
    """Still water, nothing else."""
    return tank(size=SIZE, depth=0.4, particle_spacing=SPACING)


def with_walls_far_away() -> TankScene:
    """The same with resting boxes outside the water's reach."""
    scene = water()
    for n in range(FAR):
        walls = boundary_particles(f"box-{n}", box((0.09, 0.09, 0.09)), SPACING)
        walls.position[:] += (0.1 + 0.07 * (n % 10), 0.1 + 0.07 * (n // 10 % 10), 0.7 + 0.1 * (n // 100))
        scene.fluid.add_boundary(walls)
    return scene


def in_a_vast_domain() -> TankScene:
    """The same in a domain of two hundred thousand times the water's volume."""
    config = replace(water().fluid.config, lower=(-20.0,) * 3, upper=(20.0,) * 3)
    return TankScene(config, SIZE, 0.4)


def with_fixed_body() -> TankScene:
    """The same with a body that is held, whose force is asked for."""
    scene = water()
    scene.add_body("rock", box((0.2, 0.2, 0.2)), density=2500.0, position=(0.45, 0.45, 0.7), motion="fixed")
    return scene


def with_moving_body_far_away() -> TankScene:
    """The same with a large plate that moves far above the water."""
    scene = water()
    motion = UniformMotion(position=(0.45, 0.45, 0.8), linear_velocity=(0.01, 0.0, 0.0))
    scene.add_body("plate", box((0.6, 0.6, 0.06)), density=500.0, position=(0.45, 0.45, 0.8), motion=motion)
    return scene


def pool(sleep_speed: float) -> TankScene:
    """A pool ten spacings deep that nothing disturbs."""
    return tank(size=POOL, depth=0.3, particle_spacing=SPACING, sleep_speed=sleep_speed)


def pool_with_raft(sleep_speed: float) -> TankScene:
    """The same with a raft afloat in one corner."""
    scene = pool(sleep_speed)
    scene.add_body("raft", box((0.24, 0.24, 0.12)), density=500.0, position=(0.45, 0.45, 0.3))
    return scene


def sleep_table(steps: int) -> Table:
    """Pools whose still water sleeps or does not, after they have settled."""
    table = Table(
        "scene", "particles", "asleep [%]", "step [ms]", "awake [ms]", "ratio", title="still water that sleeps"
    )
    for name, make in (("a pool at rest", pool), ("with a raft in one corner", pool_with_raft)):
        with make(SLEEP_SPEED) as sleeping, make(0.0) as awake:
            for scene in (sleeping, awake):
                scene.run(SETTLED)
            spent, whole = (row[0] for row in take_turns([sleeping, awake], steps))
            count = sleeping.fluid.particle_count
            share = 100.0 * sleeping.fluid.particles.asleep / count
            table.add_row(name, f"{count}", f"{share:.0f}", f"{spent:.2f}", f"{whole:.2f}", f"{spent / whole:.3f}")
    return table


def take_turns(scenes: list[TankScene], steps: int) -> list[tuple[float, int, int]]:
    """Of each scene: median of a step [ms], how often walls were laid out and how often the engine stepped after the start.

    Scenes take turns, so that what else the machine does falls on all of them.
    """
    seconds: list[list[float]] = [[] for _ in scenes]
    calls = np.zeros((len(scenes), 2), dtype=int)
    for _ in range(WARM_UP):
        for scene in scenes:
            scene.step()
    with counted(Walls, "_arrange") as sorted_again, counted(pybullet, "stepSimulation") as stepped:
        for _ in range(steps):
            for index, scene in enumerate(scenes):
                before, begin = np.array([len(sorted_again), len(stepped)]), time.perf_counter()
                scene.step()
                seconds[index].append(time.perf_counter() - begin)
                calls[index] += np.array([len(sorted_again), len(stepped)]) - before
    return [(1e3 * float(np.median(own)), *count) for own, count in zip(seconds, calls.tolist(), strict=True)]


def shares(steps: int, demo: bool) -> dict[str, float]:
    """Parts of the wall time of a step of the U-sweep [%], by participant; `master` is the exchange, checks and ledger."""
    run = build(load_scenario("u-sweep", demo=demo).scenario).co_simulation()
    run.initialize()
    for _ in range(WARM_UP):
        run.step()
    before, begin = run.wall_seconds, time.perf_counter()
    for _ in range(steps):
        run.step()
    whole = time.perf_counter() - begin
    parts = {name: 100.0 * (seconds - before[name]) / whole for name, seconds in run.wall_seconds.items()}
    run.terminate()
    return {"step [ms]": 1e3 * whole / steps, **parts, "master": 100.0 - sum(parts.values())}


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=40)
    steps = parser.parse_args().steps
    console = Console()
    table = Table(
        "u-sweep", "step [ms]", "fluid", "bodies", "controls", "master, transfer, ledger", title="part of the step [%]"
    )
    for name, demo in (("as shipped", False), ("demo", True)):
        part = shares(steps, demo)
        controls = sum(value for key, value in part.items() if key.endswith("-control"))
        figures = part["step [ms]"], part["fluid"], part["bodies"], controls, part["master"]
        table.add_row(name, *(f"{figure:.2f}" for figure in figures))
    console.print(table)
    table = Table(
        "scene", "wall particles", "step [ms]", "walls sorted again", "engine steps", title="what is not needed"
    )
    scenes = (
        ("still water", water),
        (f"+ {FAR} resting boxes far away", with_walls_far_away),
        ("in a domain of 64,000 m3", in_a_vast_domain),
        ("+ a held body", with_fixed_body),
        ("+ a plate that moves far above", with_moving_body_far_away),
    )
    with ExitStack() as stack:
        made = [stack.enter_context(make()) for _, make in scenes]
        for (name, _), scene, (median, sorted_again, stepped) in zip(
            scenes, made, take_turns(made, steps), strict=True
        ):
            table.add_row(name, f"{scene.fluid.boundary_count}", f"{median:.2f}", f"{sorted_again}", f"{stepped}")
    console.print(table)
    console.print(sleep_table(steps))


if __name__ == "__main__":
    main()
