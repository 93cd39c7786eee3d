"""FMUs in processes of their own: the same numbers, and those that crash or hang in a step are named and end their run in order."""

from __future__ import annotations

import gc
import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from coupling.fmu.export import FmuContent, export_fmu
from coupling.fmu.fmu_participant import FmuParticipant
from coupling.fmu.isolated_fmu import Fmu, IsolatedFmu
from coupling.fmu.scalar_model import MODEL_FILE
from coupling.fmu.trial_process import STOPPING
from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError

MODEL = """
from coupling.fmu.scalar_model import ScalarModel, given, taken

class Trouble(ScalarModel):
    push = taken("N")
    way = given("m")

    def advance(self, time, step_size):
        self.way += step_size * (1.0 + self.push)
        if time > 0.05:
            {trouble}
"""
TROUBLES = {
    "none": "pass",
    "crash": "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)",
    "exit": "import os; os._exit(3)",
    "hang": "import time; time.sleep(1000)",
    "print": "print('x' * 100000, flush=True)",
}


@pytest.fixture
def built(tmp_path: Path) -> Callable[[str], Path]:
    def build(trouble: str) -> Path:
        source = tmp_path / f"{trouble}.py"
        source.write_text(MODEL.format(trouble=TROUBLES[trouble]))
        content = FmuContent(
            identifier="Trouble",
            factory="coupling.fmu.scalar_model:model_in_folder",
            description="trouble",
            step_size=0.01,
            stop_time=1.0,
            any_step=True,
            files={MODEL_FILE: source},
        )
        export_fmu(content, tmp_path / f"{trouble}.fmu", 3)
        return tmp_path / f"{trouble}.fmu"

    return build


@pytest.fixture(autouse=True)
def _leaves_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    yield
    STOPPING.clear()
    assert list(folder.iterdir()) == []


def run_of(fmu: IsolatedFmu | FmuParticipant, steps: int) -> list[float]:
    run = CoSimulation([fmu], [], 0.02)
    run.initialize()
    fmu.set("push", np.array([2.5]))
    found = []
    for _ in range(steps):
        run.step()
        found.append(float(fmu.get("way")[0]))
    run.terminate()
    return found


@pytest.mark.parametrize("trouble", ["none", "print"])
def test_numbers_are_those_of_the_fmu_in_this_process(built: Callable[[str], Path], trouble: str) -> None:
    path = built(trouble)
    assert run_of(IsolatedFmu("one", path), 6) == run_of(FmuParticipant("one", path), 6)


def test_states_are_saved_and_restored(built: Callable[[str], Path]) -> None:
    fmu = IsolatedFmu("one", built("none"))
    fmu.enter_initialization_mode(0.0)
    fmu.exit_initialization_mode()
    assert fmu.why_not_kept == ""
    state = fmu.save_state()
    assert isinstance(state, bytes)
    fmu.do_step(0.0, 0.01)
    fmu.restore_state(state)
    assert fmu.get("way")[0] == 0.0
    with pytest.raises(ValueError, match="has no variable 'nothing'"):
        fmu.get("nothing")
    fmu.terminate()
    with pytest.raises(RuntimeError, match="'one' is not running"):
        fmu.get("way")


@pytest.mark.parametrize(
    ("trouble", "told"),
    [
        ("crash", r"crash\.fmu crashes in do_step \(SIGSEGV\)"),
        ("exit", r"exit\.fmu ends its process in do_step"),
        ("hang", r"hang\.fmu does not come back from do_step within 2 s"),
    ],
)
def test_trouble_in_a_step_is_told_by_name(built: Callable[[str], Path], trouble: str, told: str) -> None:
    with pytest.raises(CoSimulationError, match=f"'one' failed at 0.06 s: {told}"):
        run_of(IsolatedFmu("one", built(trouble), step_patience=2.0), 6)


@pytest.mark.slow
def test_a_stop_is_heeded_while_an_fmu_hangs(built: Callable[[str], Path]) -> None:
    run = CoSimulation([IsolatedFmu("one", built("hang"))], [], 0.06)
    run.initialize()
    run.step()
    timer = threading.Timer(1.0, STOPPING.set)
    timer.start()
    with pytest.raises(CoSimulationError, match=r"does not come back from do_step within 5 s after the run was asked"):
        run.step()
    timer.cancel()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", [IsolatedFmu, FmuParticipant])
def test_one_that_nobody_has_ended_leaves_nothing(built: Callable[[str], Path], kind: type[Fmu]) -> None:
    """Its process, pipes and unpacked files go with it, without a warning."""
    path = built("none")
    opened = len(os.listdir("/proc/self/fd"))
    one = kind("dropped", path)
    one.enter_initialization_mode(0.0)
    assert list(Path(tempfile.gettempdir()).iterdir())
    process = one.process_id if isinstance(one, IsolatedFmu) else None
    held: list[object] = [one]
    held.append(held)  # a cycle, so that the collector finds it
    del one, held
    gc.collect()
    assert not list(Path(tempfile.gettempdir()).iterdir())
    if process is not None:
        assert len(os.listdir("/proc/self/fd")) == opened
        with pytest.raises(ProcessLookupError):
            os.kill(process, 0)
