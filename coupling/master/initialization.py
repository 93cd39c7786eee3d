"""Initial values that are consistent: outputs reach inputs through chains of any length, and loops are solved.

A sweep transfers every connection's value once, in order. If no output depends directly on an input, the second sweep changes nothing;
along a chain of n participants, the n-th does not. Values that still change then form a loop, x = H(x) with H a sweep, which quasi-Newton
iteration solves (see `fixed_point`). Each value is solved to a tolerance of its own size, so that a small value is as accurate as a
large one. But a small value may be a difference of large ones and have only the accuracy of their rounding; therefore a value that does
not come closer any more is accepted.

A value that is not finite is not transferred, so that its source is found, and not the participants that it would have spoilt.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from coupling.master.algorithms import QuasiNewton
from coupling.master.connection import Connection, Link
from coupling.master.errors import CoSimulationError
from coupling.master.stepper import Stepper
from oilsim.backend.arrays import Array

LOOP_TOLERANCE = 1e-10  # relative change of a value between sweeps
LOOP_SWEEPS = 100
PATIENCE = 10  # number of sweeps in which the worst value must halve its distance to its tolerance
SMALLEST_SCALE = 1e-5  # relative to the loop's largest value, whose rounding may affect the others
ROUNDING = (
    1e-8  # of the largest singular value, below which rounding tells: nothing else disturbs what outputs say of inputs
)


def exchange_initial_values(steppers: dict[str, Stepper], links: Sequence[Link], time: float) -> None:
    """Set all connected inputs to consistent values.

    Raises CoSimulationError for an output that is not finite, under its participant's name, and for a loop that does not converge, with its
    connections.
    """
    values = sweep(steppers, links)
    changing: list[int] = []
    for _ in steppers:
        before, values = values, sweep(steppers, links)
        pairs = enumerate(zip(before, values, strict=True))
        changing = [index for index, pair in pairs if not np.array_equal(*pair, equal_nan=True)]
        if not changing:
            break
    for index, value in enumerate(values):
        if index not in changing and not np.isfinite(value).all():
            where = links[index].connection
            steppers[where.source].fail(
                time, f"the output {where.source_variable!r} is {value}, allowed: finite numbers"
            )
    if changing:
        _solve_loop(steppers, links, changing, time)


def sweep(steppers: dict[str, Stepper], links: Sequence[Link]) -> list[Array]:
    """Transfer every value that is finite once; return the values, arrays of any shape (N, ...) in their own units [-]."""
    values = []
    for link in links:
        where = link.connection
        values.append(link.carried(steppers[where.source].get(where.source_variable)))
        if np.isfinite(values[-1]).all():
            steppers[where.target].set(where.target_variable, values[-1], where)
    return values


def _solve_loop(steppers: dict[str, Stepper], links: Sequence[Link], changing: list[int], time: float) -> None:
    """Iterate on the values of the loop until a sweep does not change them."""
    iteration = QuasiNewton(relaxation=1.0, noise=ROUNDING)
    loops = _loops([links[index].connection for index in changing])
    values = [np.asarray(value) for value in sweep(steppers, links)]
    sizes, settled, best, waited = [values[index].size for index in changing], False, math.inf, 0
    for _ in range(LOOP_SWEEPS):
        for index in changing:
            where = links[index].connection
            steppers[where.target].set(where.target_variable, values[index], where)
        results = sweep(steppers, links)
        x, y = (np.concatenate([np.ravel(given[index]) for index in changing]) for given in (values, results))
        if not np.isfinite(y).all():
            settled = False
            break
        own, least = _scale(x, y, sizes, loops)
        worst, settled = float((np.abs(y - x) / own).max()), bool((np.abs(y - x) <= LOOP_TOLERANCE * least).all())
        best, waited = (worst, 0) if worst < 0.5 * best else (best, waited + 1)
        if worst <= LOOP_TOLERANCE or (settled and waited > PATIENCE):
            return
        proposal = iteration.proposal(x, y - x, own if settled else least)
        values = [np.asarray(value) for value in results]
        for index, part in zip(changing, np.split(proposal, np.cumsum(sizes)), strict=False):
            values[index] = part.reshape(values[index].shape)
    if not settled:
        names = ", ".join(str(links[index].connection) for index in changing)
        raise CoSimulationError("master", time, f"initial values form a loop that does not converge: {names}")


def _loops(connections: Sequence[Connection]) -> list[int]:
    """Give each connection the number of its loop; connections that share a participant, also through others, share it."""
    numbers = list(range(len(connections)))
    for later, one in enumerate(connections):
        for earlier, other in enumerate(connections[:later]):
            old, new = numbers[later], numbers[earlier]
            if old != new and {one.source, one.target} & {other.source, other.target}:
                numbers = [new if number == old else number for number in numbers]
    return numbers


def _scale(x: Array, y: Array, sizes: Sequence[int], loops: Sequence[int]) -> tuple[Array, Array]:
    """Return the size (n,) of every entry of x and y (n,), and the same with a lower limit from rounding.

    The size is that of the value's largest entry; the limit is the rounding of its loop's largest value. sizes: number of entries of each
    value; loops: the number of each value's loop.
    """
    parts = np.split(np.maximum(np.abs(x), np.abs(y)), np.cumsum(sizes)[:-1])
    own = [float(part.max(initial=0.0)) for part in parts]
    largest = [max(size for size, other in zip(own, loops, strict=True) if other == loop) for loop in loops]
    least = [max(size, SMALLEST_SCALE * most) for size, most in zip(own, largest, strict=True)]
    return np.repeat([size or 1.0 for size in own], sizes), np.repeat([size or 1.0 for size in least], sizes)
