"""Claims about the numerics: each passes on runs for which it holds, and fails on others with all its numbers."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from coupling.solids.bodies import box
from coupling.testkit import (
    CheckFailed,
    TankScene,
    assert_converges,
    assert_draft,
    assert_dry,
    assert_energy_not_created,
    assert_fmu_agrees,
    assert_force,
    assert_matches_recording,
    assert_no_leak,
    assert_restarts_exactly,
    assert_same_at_half_step,
    assert_same_on_threads,
    assert_volume,
    tank,
)
from recordings.sink.recorder import Recorder
from tests.coupling.accumulator import Accumulator

SPACING = 0.1


def small(density: float = 500.0, threads: int = 1) -> TankScene:
    """A raft in a bucket of a dozen particles."""
    scene = tank(size=(0.3, 0.3, 0.4), depth=0.2, particle_spacing=SPACING, threads=threads)
    scene.add_body("raft", box((0.2, 0.2, 0.2)), density=density, position=(0.15, 0.15, 0.2))
    return scene


def test_order_of_convergence_with_and_without_the_exact_result() -> None:
    def second(spacing: float) -> float:
        return 1.0 + 3.0 * spacing**2

    assert_converges(second, (0.1, 0.05), order=2.0, exact=1.0, within=1e-6)
    assert_converges(second, (0.1, 0.05, 0.025), order=2.0, within=1e-6)
    told = r"order of convergence is 2, expected: 3 within 0\.3 or higher; the results are 1\.03 at 0\.1 m, 1\.0075 at 0\.05 m"
    with pytest.raises(CheckFailed, match=told):
        assert_converges(second, (0.1, 0.05), order=3.0, exact=1.0)
    with pytest.raises(CheckFailed, match=r"is nan, .* they do not approach a limit one by one"):
        assert_converges(lambda spacing: {0.1: 1.0, 0.05: 2.0, 0.025: 1.0}[spacing], (0.1, 0.05, 0.025), order=1.0)
    for spacings, exact in (((0.1, 0.05), None), ((0.05, 0.1), 1.0)):
        with pytest.raises(ValueError, match=r"spacings are \[.*\] m, allowed: . or more, decreasing"):
            assert_converges(second, spacings, order=2.0, exact=exact)


def test_result_that_hangs_on_the_step_is_found() -> None:
    def euler(step: float) -> float:
        return (1.0 + step) ** (1.0 / step)

    assert_same_at_half_step(euler, 0.01, within=0.01, unit="m")
    told = r"result is 2\.59\d* m with steps of 0\.1 s and 2\.6\d* m with half of them: the change is 0\.\d+ m, expected: 0\.01 m at most"
    with pytest.raises(CheckFailed, match=told):
        assert_same_at_half_step(euler, 0.1, within=0.01, unit="m")


def test_state_that_hangs_on_the_number_of_threads_is_found() -> None:
    assert_same_on_threads(lambda threads: small(threads=threads), steps=2)
    with pytest.raises(
        CheckFailed, match=r"depends on the number of threads: [0-9a-f]+ on 1, [0-9a-f]+ on 2, expected: equal"
    ):
        assert_same_on_threads(lambda threads: small(density=500.0 + threads), steps=2)


def test_restart_that_is_another_run_is_found() -> None:
    assert_restarts_exactly(small, at=1, steps=2)
    densities = count(500)
    with pytest.raises(
        CheckFailed, match=r"state 2 steps after a restart is [0-9a-f]+, expected: [0-9a-f]+, as without it"
    ):
        assert_restarts_exactly(lambda: small(float(next(densities))), at=1, steps=2)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of 0.04 s of the raft."""
    path = tmp_path_factory.mktemp("recorded") / "raft.rrd"
    with small() as scene:
        scene.watch(Recorder(path, frame_rate=100.0))
        scene.run(0.04)
    return path


def test_run_that_leaves_its_recording_is_found(recorded: Path) -> None:
    with small() as scene:
        scene.run(0.04)
        assert_matches_recording(scene, recorded)
    with small(density=520.0) as scene:
        scene.run(0.04)
        told = r"position of 'raft' against the recording differs by 0\.0\d+ m, expected: 0 m at most at 0\.04 s"
        with pytest.raises(CheckFailed, match=told):
            assert_matches_recording(scene, recorded)
        assert_matches_recording(scene, recorded, within={"raft": 0.01})
        with pytest.raises(
            FileNotFoundError, match=r"none\.rrd does not exist, allowed: a file, which --oilsim-update"
        ):
            assert_matches_recording(scene, recorded.with_name("none.rrd"))


CHECKS: list[Callable[[object], None]] = [
    lambda run: assert_draft(run, "raft", 0.15, within=0.01),
    lambda run: assert_force(run, "raft", 0.0, along="z", within=1.0, since=0.02),
    lambda run: assert_volume(run, 1.0, within=0.1),
    lambda run: assert_no_leak(run, (0.0, 0.0, 0.0), (0.2, 0.3, 0.4)),
]


def test_recording_fails_checks_as_its_run_does(recorded: Path) -> None:
    with small() as scene:
        scene.run(0.04)
        for check in CHECKS:
            with pytest.raises(CheckFailed) as of_the_run:
                check(scene)
            with pytest.raises(CheckFailed) as of_the_recording:
                check(recorded)
            assert str(of_the_recording.value) == str(of_the_run.value)
        assert_dry(recorded, "raft", within=0.05)
    with pytest.raises(
        TypeError, match=r"the recording raft\.rrd holds no energy, allowed: a scene, a watched world or"
    ):
        assert_energy_not_created(recorded)


def test_energy_that_is_created_is_found() -> None:
    with small() as scene:
        scene.world.set_applied_wrench("raft", np.array([0.0, 0.0, 400.0, 0.0, 0.0, 0.0]))
        told = r"energy of liquid and bodies has grown by \d\S* J, expected: \S+ J at most at 0\.0\d s"
        with pytest.raises(CheckFailed, match=told):
            assert_energy_not_created(scene, steps=5)


def test_participant_that_differs_from_its_model_is_found() -> None:
    def model(time: float, inputs: object) -> dict[str, float]:
        return {"y": 1.0 + 2.0 * (time + 0.1)}

    terms = {"inputs": lambda time: {"u": 2.0}, "step_size": 0.1, "steps": 3}
    assert_fmu_agrees(Accumulator("pump", []), model, within=1e-12, **terms)
    assert_fmu_agrees(Accumulator("pump", []), Accumulator("model", []), **terms)
    told = (
        r"output 'y' is 1\.2 m, of the reference 1\.3 m: the difference is 0\.1 m, expected: 0\.01 m at most at 0\.1 s"
    )
    with pytest.raises(CheckFailed, match=told):
        assert_fmu_agrees(Accumulator("pump", []), lambda time, inputs: {"y": 1.3}, within=0.01, **terms)
    with pytest.raises(ValueError, match="'pump' has no output 'z', allowed: y, mean"):
        assert_fmu_agrees(Accumulator("pump", []), lambda time, inputs: {"z": 1.3}, **terms)
