"""Initial values that fit each other: outputs reach inputs through chains of any length, and loops are solved.

A sweep carries every connection's value once, in order. Where no output depends on an input at once, the second sweep changes
nothing; along a chain of n participants the n-th does not. What still changes then goes round in a loop, x = H(x) with H a sweep,
which is solved by quasi-Newton iteration (see `fixed_point`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.connection import Link
from coupling.errors import CoSimulationError
from coupling.fixed_point import QuasiNewton
from coupling.participant import Array
from coupling.stepper import Stepper

LOOP_TOLERANCE = 1e-10  # relative change of a value from sweep to sweep
LOOP_SWEEPS = 100


def exchange_initial_values(steppers: dict[str, Stepper], links: Sequence[Link], time: float) -> None:
    """Set all connected inputs; CoSimulationError, naming the connections, for a loop that does not settle."""
    values = sweep(steppers, links)
    for _ in steppers:
        before, values = values, sweep(steppers, links)
        changing = [index for index, pair in enumerate(zip(before, values, strict=True)) if not np.array_equal(*pair)]
        if not changing:
            return
    _solve_loop(steppers, links, changing, time)


def sweep(steppers: dict[str, Stepper], links: Sequence[Link]) -> list[Array]:
    """Carry every value once; returns the values."""
    values = []
    for link in links:
        where = link.connection
        values.append(link.carried(steppers[where.source].get(where.source_variable)))
        steppers[where.target].set(where.target_variable, values[-1])
    return values


def _solve_loop(steppers: dict[str, Stepper], links: Sequence[Link], changing: list[int], time: float) -> None:
    """Iterate on the values that go round until a sweep leaves them as they are."""
    iteration = QuasiNewton(relaxation=1.0)
    values = [np.asarray(value) for value in sweep(steppers, links)]
    for _ in range(LOOP_SWEEPS):
        for index in changing:
            where = links[index].connection
            steppers[where.target].set(where.target_variable, values[index])
        results = sweep(steppers, links)
        x, y = (np.concatenate([np.ravel(given[index]) for index in changing]) for given in (values, results))
        if not np.isfinite(y).all():
            break
        scale = np.maximum(np.abs(x), np.abs(y)).max() or 1.0
        if np.abs(y - x).max() <= LOOP_TOLERANCE * scale:
            return
        proposal = iteration.proposal(x, y - x, np.full(len(x), scale))
        values = [np.asarray(value) for value in results]
        for index, part in zip(
            changing, np.split(proposal, np.cumsum([values[i].size for i in changing])), strict=False
        ):
            values[index] = part.reshape(values[index].shape)
    names = ", ".join(str(links[index].connection) for index in changing)
    raise CoSimulationError("master", time, f"initial values go round in a loop that does not settle: {names}")
