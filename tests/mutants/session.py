"""Try many faults of one file in one session of pytest: each in a fork in which the faulty function has other code.

The session imports and collects once. A fork without a fault tells which tests call which functions of the file, how long each test takes,
and which fail anyway. Each fault then meets the tests that call its function, the quick ones first.
"""

from __future__ import annotations

import ast
import builtins
import gc
import json
import os
import signal
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

from tests.mutants.mutations import Mutant, functions_around
from tests.mutants.trial import LONGEST, QUIET, Outcome, enter, forked, processor_time

NOTICE = "__mutants_notice__"  # the builtin that observed functions call with their first line


def run_session(
    faults: list[Mutant], tests: list[str], cache: Path, seconds: float
) -> Iterator[tuple[Mutant, Outcome | None]]:
    """Yield what came of each fault, all in plain functions of one file, when it is known; None where a session of its own must tell."""
    with tempfile.TemporaryDirectory(prefix="oilsim-mutants-") as folder:
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            _session(faults, tests, cache, seconds, Path(folder), writing)
        os.close(writing)
        with os.fdopen(reading, encoding="utf-8") as lines:
            for line in lines:
                number, outcome = json.loads(line)
                yield faults[number], None if outcome is None else Outcome(*outcome)
        if os.waitpid(child, 0)[1]:
            raise RuntimeError(f"the session of pytest for {faults[0].file} broke off")


def _session(faults: list[Mutant], tests: list[str], cache: Path, seconds: float, folder: Path, writing: int) -> None:
    import pytest

    try:
        enter(cache, folder)
        arguments = [*QUIET, "--continue-on-collection-errors", *tests]
        code = pytest.main(arguments, plugins=[Loop(faults, seconds, folder, writing)])
        os._exit(1 if code in (pytest.ExitCode.INTERNAL_ERROR, pytest.ExitCode.USAGE_ERROR) else 0)
    finally:
        os._exit(1)


def first_line(node: ast.FunctionDef) -> int:
    """Return the line that Python counts as a function's first: that of its first decorator."""
    return min([node.lineno, *(one.lineno for one in node.decorator_list)])


class Loop:
    """A plugin of pytest that runs its tests again and again, in forks with a fault each."""

    def __init__(self, faults: list[Mutant], seconds: float, folder: Path, writing: int) -> None:
        self._faults, self._seconds, self._folder, self._writing = faults, seconds, folder, writing
        self._failed = False

    def pytest_runtest_logreport(self, report: Any) -> None:
        self._failed = self._failed or report.failed

    def pytest_runtestloop(self, session: Any) -> bool:
        """Observe the tests without a fault, then run each fault's; tells pytest that nothing is left to do."""
        seen = self._observed(session.items)
        for number, fault in enumerate(self._faults):
            line = first_line(functions_around(fault)[-1])
            calling = [item for item in session.items if line in seen.get(item.nodeid, ())[:-1]]
            calling.sort(key=lambda item: seen[item.nodeid][-1])
            outcome = self._tried(fault, calling)
            os.write(self._writing, f"{json.dumps([number, outcome])}\n".encode())
        return True

    def _observed(self, items: list[Any]) -> dict[str, tuple[float, ...]]:
        """Return the first lines of the faulty functions that each sound test calls, and its seconds [s] as the last entry."""
        report = self._folder / "observed.jsonl"

        def call() -> None:
            limit, lines = processor_time() + 2.0 * self._seconds, set[int]()

            observe(self._faults, lines.add)
            with report.open("w") as out:
                for item, following in zip(items, [*items[1:], None], strict=True):
                    lines.clear()
                    begun, self._failed = processor_time(), False
                    item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
                    if not self._failed:
                        out.write(json.dumps([item.nodeid, [*lines, processor_time() - begun]]) + "\n")
                        out.flush()
                    if processor_time() > limit:
                        return

        forked(call)
        return {name: tuple(what) for name, what in map(json.loads, report.read_text().splitlines())}

    def _tried(self, fault: Mutant, items: list[Any]) -> list[Any] | None:
        """Return a trial's outcome; None if no function has the fault's code, or the fork stood still, as those of threads' owners may."""
        report = self._folder / "trial.json"
        report.unlink(missing_ok=True)

        def call() -> None:
            if not put_into_function(fault):
                return
            limit = processor_time() + self._seconds
            report.write_text(json.dumps(["", 0]))
            for count, (item, following) in enumerate(zip(items, [*items[1:], None], strict=True), 1):
                report.write_text(json.dumps([item.nodeid, count]))
                signal.setitimer(signal.ITIMER_PROF, LONGEST)
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
                if self._failed:
                    return
                report.write_text(json.dumps(["", count]))
                if processor_time() > limit:
                    return

        self._failed = False
        status, spent = forked(call)
        return [*json.loads(report.read_text()), spent] if report.exists() and status != -signal.SIGKILL else None


def observe(faults: list[Mutant], notice: Callable[[int], None]) -> None:
    """Make the live functions that faults of one file are to be put into call `notice` with their first line, before all else."""
    around = [functions_around(fault) for fault in faults]
    lines, tree = {first_line(functions[-1]) for functions in around}, ast.parse(faults[0].file.read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and first_line(node) in lines:
            call = ast.Call(ast.Name(NOTICE, ast.Load()), [ast.Constant(first_line(node))], [])
            node.body.insert(0, ast.fix_missing_locations(ast.copy_location(ast.Expr(call), node.body[0])))
    setattr(builtins, NOTICE, notice)
    for place in {(first_line(functions[0]), functions[0].name) for functions in around}:
        _replaced(faults[0].file, place, tree)


def put_into_function(fault: Mutant) -> bool:
    """Give the live functions that come from the fault's place code with the fault; tell whether there are any."""
    outermost = functions_around(fault)[0]
    return _replaced(fault.file, (first_line(outermost), outermost.name), fault.apply())


def _replaced(source: Path, place: tuple[int, str], text: str | ast.Module) -> bool:
    """Give the live functions of this first line and name the code from another text of their file; tell whether there are any."""
    file = str(source.absolute())
    (code,) = [one for one in _codes(compile(text, file, "exec")) if (one.co_firstlineno, one.co_name) == place]
    found = [
        one for one in gc.get_objects()
        if isinstance(one, FunctionType) and one.__code__.co_filename == file
        and (one.__code__.co_firstlineno, one.__code__.co_name) == place
    ]  # fmt: skip
    for function in found:
        function.__code__ = code
    return bool(found)


def _codes(code: CodeType) -> Iterator[CodeType]:
    """Yield a code and all that it holds."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)
