"""Random scenes whose bodies meet the liquid in one of the ways for participants that do not tell how they answer an impulse.

One of the two participants also fails to make a step at times, as simulators that were made by others do: it stops half way, or refuses.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import partial

from coupling.bullet.assembly import BODIES, FLUID
from coupling.master.body_exchange import Aitken, BodyExchange, QuasiNewton
from coupling.testkit.faults import Fault, FaultyParticipant
from scenarios.running.assembly import Assembly, build
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import Problem, ScenarioError
from tests.stress.random_scenes import LENGTH, Dice, random_scene
from tests.stress.trials import Trial, run_trial

TELLING = ("inverse_mass", "free_acceleration")  # variables of the monolithic exchange


def run_exchange_trial(seed: int) -> Trial:
    """Run the scene of a seed with another exchange."""
    scene = random_scene(seed)
    # how a body answers is taken as it was when a step began, in which it must not turn far
    scene["run"]["communication_step"] = min(
        scene["run"]["communication_step"], 0.25 * scene["run"]["duration"] / LENGTH
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of blows that no acceleration explains
        return run_trial(seed, scene, partial(build_silent, seed))


def build_silent(seed: int, scenario: Scenario) -> Assembly:
    """A scenario's run in which bodies do not tell how they answer; ScenarioError where none is free to."""
    assembly = build(scenario)
    if not assembly.exchange.interfaces:
        assembly.fluid.close()
        raise ScenarioError([Problem("bodies", "are not free, allowed: one that is")])
    dice = Dice(seed + 1)
    interfaces = assembly.exchange.interfaces
    if dice.chance(0.5):  # nobody knows their mass: it is measured, and the exchange iterated
        interfaces = tuple(replace(interface, mass_matrix=None) for interface in interfaces)
    iteration = dice.choice(Aitken, QuasiNewton)
    faulty = dice.choice(FLUID, BODIES)
    fault, time = dice.choice(Fault.EARLY_RETURN, Fault.DISCARD), dice.between(0.0, scenario.run.duration)
    return replace(
        assembly,
        exchange=BodyExchange(interfaces, iteration=iteration),
        participants=tuple(
            FaultyParticipant(one, fault, at_time=time) if one.name == faulty else one for one in assembly.participants
        ),
        connections=tuple(one for one in assembly.connections if not one.source_variable.endswith(TELLING)),
    )
