"""Initial values that fit each other: outputs reach inputs through chains of any length, and loops are solved.

A sweep carries every connection's value once, in order. Where no output depends on an input at once, the second sweep changes
nothing; along a chain of n participants the n-th does not. What still changes then goes round in a loop, x = H(x) with H a sweep,
which is solved by quasi-Newton iteration (see `fixed_point`). Each value is solved to a tolerance of its own size, so that a small one
is as good as a large one beside it; but what is small may be a difference of large values, and be no better than their rounding, and so
one that no longer comes closer is taken as it is.

A value that is not finite is not carried: whoever gives it is found by it, and not those that it would have spoilt.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from coupling.errors import CoSimulationError
from coupling.master.connection import Connection, Link
from coupling.master.fixed_point import QuasiNewton
from coupling.master.stepper import Stepper
from coupling.participant import Array

LOOP_TOLERANCE = 1e-10  # relative change of a value from sweep to sweep
LOOP_SWEEPS = 100
PATIENCE = 10  # sweeps in which the worst value must come twice as close to its tolerance
SMALLEST_SCALE = 1e-5  # of the loop's largest value: of what rounding it makes may spoil the others
ROUNDING = (
    1e-8  # of the largest singular value, below which rounding tells: nothing else disturbs what outputs say of inputs
)


def exchange_initial_values(steppers: dict[str, Stepper], links: Sequence[Link], time: float) -> None:
    """Set all connected inputs.

    CoSimulationError for an output that is not finite, by its participant; for a loop that does not settle, naming the connections.
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
            steppers[where.source].fail(time, f"output {where.source_variable!r} is {value}, allowed: finite numbers")
    if changing:
        _solve_loop(steppers, links, changing, time)


def sweep(steppers: dict[str, Stepper], links: Sequence[Link]) -> list[Array]:
    """Carry every value that is finite once; returns the values."""
    values = []
    for link in links:
        where = link.connection
        values.append(link.carried(steppers[where.source].get(where.source_variable)))
        if np.isfinite(values[-1]).all():
            steppers[where.target].set(where.target_variable, values[-1])
    return values


def _solve_loop(steppers: dict[str, Stepper], links: Sequence[Link], changing: list[int], time: float) -> None:
    """Iterate on the values that go round until a sweep leaves them as they are."""
    iteration = QuasiNewton(relaxation=1.0, noise=ROUNDING)
    loops = _loops([links[index].connection for index in changing])
    values = [np.asarray(value) for value in sweep(steppers, links)]
    sizes, settled, best, waited = [values[index].size for index in changing], False, math.inf, 0
    for _ in range(LOOP_SWEEPS):
        for index in changing:
            where = links[index].connection
            steppers[where.target].set(where.target_variable, values[index])
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
        raise CoSimulationError("master", time, f"initial values go round in a loop that does not settle: {names}")


def _loops(connections: Sequence[Connection]) -> list[int]:
    """A number for each connection, the same for those that share a participant, if only through others."""
    numbers = list(range(len(connections)))
    for later, one in enumerate(connections):
        for earlier, other in enumerate(connections[:later]):
            old, new = numbers[later], numbers[earlier]
            if old != new and {one.source, one.target} & {other.source, other.target}:
                numbers = [new if number == old else number for number in numbers]
    return numbers


def _scale(x: Array, y: Array, sizes: Sequence[int], loops: Sequence[int]) -> tuple[Array, Array]:
    """The size (n,) of every entry of x and y (n,), which is that of the value it belongs to: its largest entry; and the same, but not
    below what the rounding of its loop's largest value leaves.

    sizes: number of entries of each value; loops: the number of the loop that each goes round in.
    """
    parts = np.split(np.maximum(np.abs(x), np.abs(y)), np.cumsum(sizes)[:-1])
    own = [float(part.max(initial=0.0)) for part in parts]
    largest = [max(size for size, other in zip(own, loops, strict=True) if other == loop) for loop in loops]
    least = [max(size, SMALLEST_SCALE * most) for size, most in zip(own, largest, strict=True)]
    return np.repeat([size or 1.0 for size in own], sizes), np.repeat([size or 1.0 for size in least], sizes)
