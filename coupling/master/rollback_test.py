"""The rollback test: step, restore, step again, and compare bit by bit, before a run relies on rollback.

The outputs after both steps, and every number and array in the two saved states, are compared. Opaque bytes are not, because they may
contain addresses. A participant that cannot save or restore its state is found before it has made a step. If the repeated step differs,
the participant has moved by something that its restore leaves out. No call of the interface can bring it back to the beginning then, and
the run ends.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from coupling.master.stepper import NotExchanged, Snapshot, Stepper


def rollback_fault(stepper: Stepper, begin: float, end: float) -> str:
    """Give the reason why a participant cannot be rolled back from `end` to `begin` [s]; empty if it can. It is at `begin` afterwards.

    Raises CoSimulationError for a participant that was stepped and does not come back.
    """
    try:
        start = stepper.save()
        stepper.restore(start)
    except NotExchanged as refusal:
        return refusal.message
    results = []
    for _ in range(2):
        stepper.advance(begin, end)
        results.append(stepper.save())
        stepper.restore(start)
    difference = _difference(*results)
    if difference:
        allowed = "equality bit for bit, or NotImplementedError from save_state"
        stepper.fail(begin, f"restore_state leaves something out: {difference}, allowed: {allowed}")
    return ""


def _difference(first: Snapshot, second: Snapshot) -> str:
    """Describe the difference between two ends of one step; empty if there is none."""
    for name, value in first.outputs.items():
        if not _same(value, second.outputs[name]):
            largest = float(np.abs(value - second.outputs[name]).max())
            return f"the output {name!r} of a repeated step differs by up to {largest:.3g}"
    if not _same(first.state, second.state):
        return "the saved states after a step and after its repetition differ"
    return ""


def _same(first: object, second: object) -> bool:
    """Tell whether two saved values are equal bit for bit, as far as their contents are visible."""
    if isinstance(first, np.ndarray | np.generic) and isinstance(second, np.ndarray | np.generic):
        return first.shape == second.shape and first.dtype == second.dtype and first.tobytes() == second.tobytes()
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        return first.keys() == second.keys() and all(_same(first[key], second[key]) for key in first)
    if isinstance(first, list | tuple) and isinstance(second, list | tuple):
        return len(first) == len(second) and all(map(_same, first, second))
    if isinstance(first, float | int | complex | str) and isinstance(second, float | int | complex | str):
        return repr(first) == repr(second)
    return type(first) is type(second)
