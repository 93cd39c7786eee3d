"""Can a participant be taken back? Tested before anything relies on it: step, restore, step again, compare bit by bit.

Compared are the outputs after both steps and every number and array in the two saved states; what a participant keeps as opaque
bytes is not, since such bytes may hold addresses. One that cannot save or restore its state at all is told so before it has made a
step. One whose repeated step differs has moved by what its restore leaves out, and no call of the interface brings it to the
beginning any more: to go on from there would be a run that nobody asked for.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from coupling.master.stepper import NotExchanged, Snapshot, Stepper


def rollback_fault(stepper: Stepper, begin: float, end: float) -> str:
    """Why the participant cannot be taken back from `end` to `begin` [s], empty if it can; it is at `begin` afterwards.

    CoSimulationError for one that was stepped and does not come back.
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
        allowed = "the same bit for bit, or NotImplementedError from save_state"
        stepper.fail(begin, f"restore_state leaves something out: {difference}, allowed: {allowed}")
    return ""


def _difference(first: Snapshot, second: Snapshot) -> str:
    """What differs between two ends of one step, empty if nothing does."""
    for name, value in first.outputs.items():
        if not _same(value, second.outputs[name]):
            largest = float(np.abs(value - second.outputs[name]).max())
            return f"output {name!r} of a repeated step differs by up to {largest:.3g}"
    if not _same(first.state, second.state):
        return "saved states after a step and after the same step repeated differ"
    return ""


def _same(first: object, second: object) -> bool:
    """Whether two saved values are equal bit for bit, as far as they can be looked into."""
    if isinstance(first, np.ndarray | np.generic) and isinstance(second, np.ndarray | np.generic):
        return first.shape == second.shape and first.dtype == second.dtype and first.tobytes() == second.tobytes()
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        return first.keys() == second.keys() and all(_same(first[key], second[key]) for key in first)
    if isinstance(first, list | tuple) and isinstance(second, list | tuple):
        return len(first) == len(second) and all(map(_same, first, second))
    if isinstance(first, float | int | complex | str) and isinstance(second, float | int | complex | str):
        return repr(first) == repr(second)
    return type(first) is type(second)
