"""A team of threads that runs compiled kernels over ranges of particles.

A kernel is a plain `@njit(nogil=True)` function `kernel(begin, end, *arguments)` that writes rows begin to end only, so that results do not
depend on how the range is cut. Threads around serial kernels compile three times faster than numba's own parallel loops. Each block of
particles has its own partial sum, and partial sums are added in order: results are equal bit for bit on any number of threads.

A step runs some 70 kernels. A thread that slept in between would be late by 0.1 to 0.4 ms where a virtual machine must first be given its
processor back, as long as a kernel takes. So threads wait for each other awake, outside Python's lock and letting others go first, and
sleep only after a while without work. The caller stays out of the lock for a moment too, so that the others can take their work. On two
processors a step of 40,000 particles takes 0.8 of the time that it takes with threads that sleep, one of 10,000 particles a half.
"""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import numpy as np
from numba import config, types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from oilsim.backend.jit import njit

# [particles] that share one partial sum; numerical; not on record
BLOCK = 1024
# [particles] under which one thread works; measured; handing work over costs more than it saves
SERIAL_BELOW = 8 * BLOCK
# [looks] in which others take their work before the caller begins its own; measured; some microseconds
HEAD_START = 4000
# [looks] for which a thread waits awake; measured; a millisecond or so, longer than between two kernels
PATIENCE = 300_000
# [looks] after which a waiting thread lets others have its processor; measured; a microsecond or so
POLITE = 64
# [cells] of 8 bytes between those of two threads; theory; each has its own line of the cache
APART = 8
yield_processor = types.ExternalFunction("sched_yield" if os.name == "posix" else "SwitchToThread", types.int32())


def block_count(count: int) -> int:
    """Return the number of partial sums that `count` particles need."""
    return (count + BLOCK - 1) // BLOCK


@intrinsic
def look(typing_context, cells, place):
    """Return cells[place] as it is now in memory; cells (n,) int64."""

    def generate(context, builder, signature, arguments):
        data = make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.load_atomic(builder.gep(data, [arguments[1]]), "acquire", 8)

    return types.int64(cells, place), generate


@intrinsic
def show(typing_context, cells, place, value):
    """Set cells[place] = value once all earlier writes are visible; cells (n,) int64."""

    def generate(context, builder, signature, arguments):
        data = make_array(signature.args[0])(context, builder, arguments[0]).data
        builder.store_atomic(arguments[2], builder.gep(data, [arguments[1]]), "release", 8)
        return context.get_dummy_value()

    return types.void(cells, place, value), generate


@njit(nogil=True, cache=True)
def meet(cells, own, value, other, expected, looks, polite=POLITE):
    """Show `value` at place `own` of cells (n,) int64, wait for `expected` or more at place `other`, and return whether it came.

    The wait lasts so many `looks`; after each `polite` of them others may have the processor.
    """
    show(cells, np.int64(own), np.int64(value))
    for n in range(looks):
        if look(cells, np.int64(other)) >= expected:
            return True
        if n % polite == polite - 1:
            yield_processor()
    return False


def meet_uncompiled(cells, own, value, other, expected, looks, polite=POLITE):
    """Do as `meet` does in plain Python, for runs with the compiler switched off."""
    cells[own] = value
    return bool(cells[other] >= expected)


if config.DISABLE_JIT:
    meet = meet_uncompiled


class Crew:
    """Threads that work beside the caller's, and the cells by which they hear of work.

    A crew knows nothing of the `Team` that hands out work, so that Python can delete the team.
    """

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._given = 0  # how many kernels the others have been given
        self._cells = np.zeros(APART * threads, np.int64)  # that number, and how many each of the others has done
        self._task: tuple[Callable[..., Any], list[int], tuple[Any, ...]] | None = None
        self._errors: list[BaseException | None] = [None] * threads
        self._asleep = [False] * threads
        self._bells: list[SimpleQueue[None]] = [SimpleQueue() for _ in range(threads)]
        for member in range(1, threads):
            threading.Thread(target=self._work, args=(member,), daemon=True).start()
        _CREWS.add(self)

    def _work(self, member: int) -> None:
        done = 0
        while True:
            while not meet(self._cells, APART * member, done, 0, done + 1, PATIENCE):
                self._asleep[member] = True
                if self._cells[0] == done:
                    self._bells[member].get()
                self._asleep[member] = False
            if self._task is None:
                return
            kernel, cuts, arguments = self._task
            try:
                kernel(cuts[member], cuts[member + 1], *arguments)
            except BaseException as error:
                self._errors[member] = error
            del kernel, arguments
            done += 1

    def _give(self, looks: int) -> None:
        """Tell the others that there is a new task, and wake those that sleep."""
        self._given += 1
        meet(self._cells, 0, self._given, 0, self._given + 1, looks, looks)
        for bell, asleep in zip(self._bells, self._asleep, strict=True):
            if asleep:
                bell.put(None)

    def share(self, kernel: Callable[..., Any], cuts: list[int], arguments: tuple[Any, ...]) -> None:
        """Let each thread run a kernel from its cut to the next one."""
        self._task = kernel, cuts, arguments
        self._give(HEAD_START)
        try:
            kernel(cuts[0], cuts[1], *arguments)
        finally:
            for member in range(1, self.threads):
                while not meet(self._cells, 0, self._given, APART * member, self._given, PATIENCE):
                    pass
            self._task = None
        for member, error in enumerate(self._errors):
            if error is not None:
                self._errors[member] = None
                raise error

    def dismiss(self) -> None:
        """End the other threads."""
        if self.threads > 1:
            self._give(0)
        self.threads = 1

    def lose(self) -> None:
        """Forget the other threads, which do not exist in the child of a fork."""
        self.threads = 1


_CREWS: weakref.WeakSet[Crew] = weakref.WeakSet()


def _lose_all() -> None:
    for crew in _CREWS:
        crew.lose()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_lose_all)


class Team:
    """Threads that run one kernel at a time and end with the team; the caller's thread is one of them.

    In the child of a fork, which has the caller's thread alone, that thread does all the work. ValueError for fewer than 1 thread.
    """

    def __init__(self, threads: int | None = None) -> None:
        available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
        threads = available if threads is None else threads
        if not (isinstance(threads, int) and threads >= 1):
            raise ValueError(f"threads is {threads}, allowed: 1, 2, ...")
        self._crew = Crew(threads)
        self._end = weakref.finalize(self, self._crew.dismiss)
        self._end.atexit = False  # threads of a program that ends need no word

    @property
    def threads(self) -> int:
        """Return how many threads work, the caller's included."""
        return self._crew.threads

    def run(self, kernel: Callable[..., Any], count: int, *arguments: Any) -> None:
        """Run `kernel(begin, end, *arguments)` over all of range(count); cuts fall between blocks."""
        threads = self._crew.threads
        if count < SERIAL_BELOW or threads == 1:
            kernel(0, count, *arguments)
            return
        blocks = block_count(count)
        self._crew.share(kernel, [blocks * t // threads * BLOCK for t in range(threads)] + [count], arguments)

    def run_parts(self, kernel: Callable[..., Any], parts: int, *arguments: Any) -> None:
        """Run `kernel(begin, end, *arguments)` over all of range(parts), each part of which is much work."""
        threads = self._crew.threads
        if parts < threads or threads == 1:
            kernel(0, parts, *arguments)
            return
        self._crew.share(kernel, [parts * t // threads for t in range(threads + 1)], arguments)

    def close(self) -> None:
        """End the other threads; after that the caller's thread does all the work."""
        self._end()


def total(partial: NDArray[Any]) -> float:
    """Return the sum of the block sums `partial` (blocks,), in their unit, in float64 and always in the same order."""
    return float(np.add.reduce(partial, dtype=np.float64))
