"""Orders to a run, signals, and criteria of a debrief, with values that nobody wants."""

from __future__ import annotations

import random
import sys
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.controls.signals import SignalBoard, signals_of
from scenarios.controls.table import KEYS
from scenarios.debrief.grade import CRITERIA, read_criteria
from scenarios.running.assembly import Assembly, build
from scenarios.running.plan import TERM_KEYS, Plan
from scenarios.spec.load import load_scenario
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError
from tests.fuzz.scenario_files import EXTREMES, OTHERS, damaged

EXERCISE = Path(__file__).parents[1] / "scenarios" / "files" / "all_inputs.toml"
NUMBERS = (0.0, -0.0, -1.0, 1.0, 100.0, 5e4, -5e4, 1e12, 1.1e12, 1e300, -1e300, 1e-300, np.nan, np.inf, -np.inf)


def make_exercise() -> tuple[Scenario, Assembly]:
    """Build the exercise that orders and signals are given to."""
    scenario = load_scenario(EXERCISE).scenario
    return scenario, build(scenario)


def _told(error: ValueError) -> int:
    print(error, file=sys.stderr)
    return 2


def order_trial(seed: int, scenario: Scenario) -> int:
    """Order something of a run that goes on."""
    chance = random.Random(seed)
    key = chance.choice((*KEYS, *TERM_KEYS, "fluid.particle_spacing", "tank.upper.2"))
    key = key.replace("*", chance.choice(("legged", "pipe", "0", "x", "speed", "frame_rate")))
    value = chance.choice(EXTREMES + OTHERS)
    text = damaged(f"{key}={value}", chance) if chance.random() < 0.2 else f"{key}={value}"
    try:
        plan = Plan(scenario=scenario).changed((text,), chance.choice((0, 1, 10**6)))
        plan.fingerprint(2)
    except ScenarioError as error:
        return _told(error)
    return 0


def signal_trial(seed: int, exercise: tuple[Scenario, Assembly]) -> int:
    """Set a signal of a run, or go back to values of signals that somebody has made up."""
    chance = random.Random(seed)
    scenario, assembly = exercise
    signals = signals_of(scenario.parts)
    board = SignalBoard("orders", {name: signal for name, signal in signals.items() if signal.is_input}, assembly.parts)
    name, number = chance.choice(list(signals)), chance.choice(NUMBERS)
    value: Any = chance.choice(
        (np.array([number]), np.array(number), np.array([number, number]), [number], np.array(["x"]), None)
    )
    try:
        if chance.random() < 0.5:
            board.set(name, value)
        else:
            board.restore_state({name: number})
    except ValueError as error:
        return _told(error)
    except (TypeError, KeyError) as error:  # no number, or an output: as restored states of other runs are told
        print(error, file=sys.stderr)
        return 2
    limits = signals[name].limits
    assert limits is None or limits.accepts(float(board.get(name)[0]))
    return 0


def criteria_trial(seed: int) -> int:
    """Read spoiled criteria."""
    chance = random.Random(seed)
    lines = [
        f"[{one.key}]\ngood = {one.good}\nacceptable = {one.acceptable}\nweight = {one.weight}\n"
        for one in CRITERIA.values()
    ]
    text = "".join(chance.sample(lines, chance.randint(1, len(lines))))
    for _ in range(chance.randint(1, 3)):
        number = chance.choice([word for word in text.split() if word[0].isdigit()] or ["0"])
        text = text.replace(number, chance.choice(EXTREMES + OTHERS), 1)
    text = damaged(text, chance) if chance.random() < 0.5 else text
    file = Path("criteria.toml")
    file.write_text(text, encoding="utf-8")
    try:
        read_criteria(file)
    except ScenarioError as error:
        return _told(error)
    finally:
        file.unlink()
    return 0
