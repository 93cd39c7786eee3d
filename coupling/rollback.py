"""Can a participant be taken back? Tested before anything relies on it: step, restore, step again, compare bit by bit.

Compared are the outputs after both steps and every number and array in the two saved states; what a participant keeps as opaque
bytes is not, since such bytes may hold addresses. A participant that fails has moved by what its restore leaves out.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from coupling.stepper import Stepper


def rollback_fault(stepper: Stepper, begin: float, end: float) -> str:
    """Why the participant cannot be taken back from `end` to `begin` [s], empty if it can; it is at `begin` afterwards."""
    try:
        start = stepper.save()
    except NotImplementedError as cause:
        return str(cause) or "it cannot save its state"
    results = []
    for _ in range(2):
        stepper.advance(begin, end)
        results.append(stepper.save())
        stepper.restore(start)
    first, second = results
    for name, value in first.outputs.items():
        if not _same(value, second.outputs[name]):
            largest = float(np.abs(value - second.outputs[name]).max())
            return f"output {name!r} of a repeated step differs by up to {largest:.3g}"
    if not _same(first.state, second.state):
        return "its saved states after a step and after the same step repeated differ"
    return ""


def _same(first: object, second: object) -> bool:
    """Whether two saved values are equal bit for bit, as far as they can be looked into."""
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        return first.shape == second.shape and first.dtype == second.dtype and first.tobytes() == second.tobytes()
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        return first.keys() == second.keys() and all(_same(first[key], second[key]) for key in first)
    if isinstance(first, list | tuple) and isinstance(second, list | tuple):
        return len(first) == len(second) and all(map(_same, first, second))
    if isinstance(first, float | int | str) and isinstance(second, float | int | str):
        return repr(first) == repr(second)
    return type(first) is type(second)
