"""The pytest plugin in sessions of its own: idle, limits, seeds, and what failing tests leave in reports and files."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from recordings.files.checkpoint import load_checkpoint
from recordings.replay.recording import Replay

pytest_plugins = ["pytester"]

FAILING = """
    from coupling.solids.bodies import box
    from coupling.testkit import assert_draft

    def test_float(water_tank):
        scene = water_tank(size=(0.3, 0.3, 0.4), depth=0.2, particle_spacing=0.1)
        scene.add_body("raft", box((0.2, 0.2, 0.2)), density=500.0, position=(0.15, 0.15, 0.2))
        scene.run(0.03)
        assert_draft(scene, "raft", 0.19, within=0.001)

    def test_still(water_tank):
        water_tank(size=(0.3, 0.3, 0.4), depth=0.2, particle_spacing=0.1).step()
"""


def run_apart(pytester: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    """Run a session in a process of its own, which loads the plugin by its module where the package is not installed."""
    installed = any(entry.name == "oilsim" for entry in entry_points(group="pytest11"))
    plugin = [] if installed else ["-p", "scenarios.bench.plugin"]
    return pytester.runpytest_subprocess(*plugin, "-p", "no:cacheprovider", *arguments)


def test_plugin_is_idle_until_asked(pytester: pytest.Pytester) -> None:
    heavy = "{'numpy', 'numba', 'pybullet', 'rerun', 'matplotlib'} & set(sys.modules)"
    code = f"import sys, scenarios.bench.plugin; assert not {heavy}, {heavy}"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_failing_test_leaves_recording_checkpoint_and_picture(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(FAILING)
    result = run_apart(
        pytester, "--oilsim-record=always", "--junitxml=junit.xml", "--html=report.html", "--self-contained-html"
    )
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(
        [
            "*draft of 'raft' is * m, expected: 0.19 m within 0.001 m at 0.03 s; the particles are 0.1 m apart*",
            "recording: *oilsim-report*test_float.rrd",
            "checkpoint: *test_float.npz",
            "picture: *test_float.png",
        ]
    )
    (recording,) = Path(pytester.path, "oilsim-report").glob("*test_float.rrd")
    replay = Replay(recording)
    assert replay.bodies["raft"].time.tolist() == pytest.approx([0.0, 0.03])
    assert "draft of 'raft'" in replay.events[-1].text
    assert load_checkpoint(recording.with_suffix(".npz")).index == 3
    assert recording.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    properties = {one.get("name"): one.get("value") for one in ET.parse("junit.xml").iter("property")}
    assert {"oilsim_recording", "oilsim_checkpoint", "oilsim_picture"} <= set(properties)
    assert len(list(recording.parent.glob("*test_still.*"))) == 3
    assert "data:image/png;base64" in Path("report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_what_tests_leave_goes_into_the_folder_that_is_asked_for(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(FAILING)
    run_apart(pytester, "-k", "still", "--oilsim-record=always", "--oilsim-output=kept/here").assert_outcomes(passed=1)
    left = {file.suffix for file in Path(pytester.path, "kept", "here").glob("*test_still.*")}
    assert left == {".rrd", ".npz", ".png"}
    assert not Path(pytester.path, "oilsim-report").exists()


@pytest.mark.slow
def test_limits_seeds_and_one_run_after_the_other(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import random
        import numpy as np
        import pytest

        def still(water_tank):
            scene = water_tank(size=(0.3, 0.3, 0.4), depth=0.2, particle_spacing=0.1)
            for _ in range(5):
                scene.step()

        @pytest.mark.oilsim_limits(particles=17)
        def test_particles(water_tank):
            still(water_tank)

        @pytest.mark.oilsim_limits(seconds=1e-9)
        def test_seconds(water_tank):
            still(water_tank)

        @pytest.mark.oilsim_limits(seconds=60.0, particles=18)
        def test_within(water_tank):
            still(water_tank)

        @pytest.mark.oilsim_limits(hours=1)
        def test_strange(water_tank):
            pass

        def test_seed(oilsim_bench):
            drawn = random.random(), np.random.random()
            random.seed(oilsim_bench.seed), np.random.seed(oilsim_bench.seed)
            assert drawn == (random.random(), np.random.random())
        """
    )
    result = run_apart(pytester)
    assert not list(Path(pytester.path).glob("oilsim-report/*test_within*"))
    result.assert_outcomes(passed=2, failed=2, errors=1)
    result.stdout.fnmatch_lines(
        [
            "*oilsim_limits has *hours*, allowed: seconds=..., particles=...*",
            "*the run has 18 particles, allowed by oilsim_limits: 17*",
            "*steps have taken * s, allowed by oilsim_limits: 1e-09 s*",
        ],
        consecutive=False,
    )


@pytest.mark.slow
def test_references_are_written_and_held_to(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        from coupling.solids.bodies import box
        from coupling.testkit import assert_matches_recording

        DENSITY = 500.0

        def test_reference(water_tank):
            scene = water_tank(size=(0.3, 0.3, 0.4), depth=0.2, particle_spacing=0.1)
            scene.add_body("raft", box((0.2, 0.2, 0.2)), density=DENSITY, position=(0.15, 0.15, 0.2))
            scene.run(0.04)
            assert_matches_recording(scene, "reference.rrd")
        """
    )
    run_apart(pytester, "--oilsim-record=never").assert_outcomes(failed=1)
    run_apart(pytester, "--oilsim-record=never", "--oilsim-update").assert_outcomes(passed=1)
    run_apart(pytester, "--oilsim-record=never").assert_outcomes(passed=1)
    file = next(Path(pytester.path).glob("test_*.py"))
    file.write_text(file.read_text().replace("500.0", "520.0"))
    result = run_apart(pytester, "--oilsim-record=never")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*position of 'raft' against the recording differs by * m, expected: 0 m at most*"])
