"""A random pybullet world is run and held to what physics allows, as far as pybullet itself can follow it.

The figures are those of `trials`, but for what keeps bodies in, which are pybullet's own walls, and for checkpoints: the same world made
again, on two threads, is the same bit for bit. A body that turns further in a step than pybullet's forces hold for, which the plugin says,
ends the trial: what comes then is the engine's.
"""

from __future__ import annotations

import warnings

import numpy as np

from coupling.bullet.default_warnings import TURN_LIMIT
from tests.stress.random_worlds import RandomWorld, random_world
from tests.stress.trials import FASTEST, LEAKED, MADE, SOME, Trial


def run_world_trial(seed: int) -> Trial:
    """Run a world to its end, and its beginning once more."""
    trial = Trial(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of links too small for a particle, damping and the like
        try:
            world = random_world(seed)
        except ValueError as error:
            trial.refused = str(error)
            return trial
        trial.particles = world.fluid.particle_count
        seen = _watch(world, trial)
        if seen and _again(seed, len(seen)) != seen[-1]:
            trial.faults["same again"] = "other particles on two threads, allowed: the same bits"
    return trial


def _watch(world: RandomWorld, trial: Trial) -> list[bytes]:
    """Step a world, note its figures, and close it; returns how its particles lay after the first steps."""
    before, mass = world.energy(), world.mass()
    seen: list[bytes] = []
    longest = 0.0
    for step in range(world.steps):
        if world.furthest_turn() >= TURN_LIMIT:
            trial.note("part cut off", 1.0 - step / world.steps, np.inf)
            break
        try:
            report = world.step()
        except ValueError as error:
            trial.faults["end"] = str(error)
            break
        longest = max(longest, report.time_step)
        velocity = world.fluid.particles.velocity.astype(np.float64)
        trial.note("speed", float(np.sqrt((velocity**2).sum(axis=0).max(initial=0.0))) / world.speed, FASTEST)
        trial.note("body's speed", world.fastest_body() / world.speed, FASTEST)
        if not world.is_driven:
            scale = 0.5 * mass * world.speed**2
            trial.note("energy", (world.energy() - before) / scale, MADE + world.gravity * longest / world.speed)
        trial.note("mass", world.count_leaked() / max(trial.particles, 1), LEAKED + 1.0 / max(trial.particles, 1))
        trial.note("compression", report.density_error, np.inf)
        trial.note("products", report.iterations["divergence"], np.inf)
        if len(seen) < SOME:
            seen.append(world.fluid.particles.position.tobytes())
    world.close()
    return seen


def _again(seed: int, steps: int) -> bytes:
    """How the particles lie after some steps of the world made anew, on two threads."""
    world = random_world(seed, threads=2)
    for _ in range(steps):
        world.step()
    places = world.fluid.particles.position.tobytes()
    world.close()
    return places
