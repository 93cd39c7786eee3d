"""The bench of a test, without a pytest session: limits that stop a test, and references that `--oilsim-update` writes anew."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from coupling.solids.bodies import box
from coupling.testkit import CheckFailed, TankScene, assert_matches_recording, tank
from scenarios.bench.evidence import LimitExceeded, TestBench


@contextmanager
def bucket(
    marker: pytest.MarkDecorator | None = None, *, density: float = 500.0, updating: bool = False
) -> Iterator[TankScene]:
    """A raft in a bucket of 14 particles, on a bench of its own."""
    mark = None if marker is None else marker.mark
    with TestBench("bucket", keeps_frames=updating, marker=mark, is_updating=updating, worker=False) as bench:
        scene = bench.making(tank)(size=(0.3, 0.3, 0.4), depth=0.2, particle_spacing=0.1)
        scene.add_body("raft", box((0.2, 0.2, 0.2)), density=density, position=(0.15, 0.15, 0.2))
        yield scene


def run(scene: TankScene) -> TankScene:
    scene.run(0.04)
    return scene


def test_test_that_exceeds_its_limits_fails_with_numbers() -> None:
    with bucket() as scene:
        count = len(run(scene).readings().particles("water"))
    with bucket(pytest.mark.oilsim_limits(seconds=60.0, particles=count)) as scene:
        run(scene)
    told = f"the run has {count} particles, allowed by oilsim_limits: {count - 1}"
    with bucket(pytest.mark.oilsim_limits(particles=count - 1)) as scene, pytest.raises(LimitExceeded, match=told):
        run(scene)
    told = r"steps have taken \S+ s, allowed by oilsim_limits: 1e-09 s"
    with bucket(pytest.mark.oilsim_limits(seconds=1e-9)) as scene, pytest.raises(LimitExceeded, match=told):
        run(scene)


@pytest.mark.parametrize(
    ("marker", "told"),
    [
        (
            pytest.mark.oilsim_limits(hours=1),
            r"oilsim_limits has \['hours'\], allowed: seconds=\.\.\., particles=\.\.\.",
        ),
        (pytest.mark.oilsim_limits(2.0), r"oilsim_limits has \[2\.0\], allowed"),
        (pytest.mark.oilsim_limits(seconds=0.0), r"oilsim_limits: seconds is 0\.0, allowed: above 0"),
        (pytest.mark.oilsim_limits(particles="few"), r"oilsim_limits: particles is 'few', allowed: above 0"),
    ],
)
def test_limits_that_mean_nothing_are_refused(marker: pytest.MarkDecorator, told: str) -> None:
    with pytest.raises(ValueError, match=told), bucket(marker):
        pass


def test_reference_is_written_by_an_update_and_only_then(tmp_path: Path) -> None:
    file = tmp_path / "reference.rrd"
    with bucket() as scene, pytest.raises(FileNotFoundError, match="which --oilsim-update writes"):
        assert_matches_recording(run(scene), file)
    for density in (500.0, 520.0):
        with bucket(density=density, updating=True) as scene:
            assert_matches_recording(run(scene), file)
        with bucket(density=density) as scene:
            assert_matches_recording(run(scene), file)
    written = file.read_bytes()
    told = r"position of 'raft' against the recording differs by \S+ m, expected: 0 m at most"
    with bucket(density=500.0) as scene, pytest.raises(CheckFailed, match=told):
        assert_matches_recording(run(scene), file)
    assert file.read_bytes() == written
